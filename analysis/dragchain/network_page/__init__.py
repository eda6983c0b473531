"""The interactive page on a run's contact network: one HTML file that needs no other file."""
