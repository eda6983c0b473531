"""An impact of two particles by the Hertz-Mindlin law: exact formulae, and integrated."""
