"""Input scripts and the other files that a run starts from."""
