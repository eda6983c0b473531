"""The cases of a study: sweeps and plans."""
