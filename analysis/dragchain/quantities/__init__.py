"""The quantities of a process run: what they are, and what a run says of each."""
