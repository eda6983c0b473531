"""The Hertz-Mindlin contact law as exact formulae."""
