"""LIGGGHTS as a process: start, watch, resume, accept."""
