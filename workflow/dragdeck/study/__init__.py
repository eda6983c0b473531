"""The study file and the cases it describes."""
