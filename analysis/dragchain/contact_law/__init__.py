"""The Hertz-Mindlin contact law: Hertz contacts and the Coulomb limit."""
