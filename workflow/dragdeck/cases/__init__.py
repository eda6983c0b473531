"""A case of a study: its settings, its runs and its media."""
