"""Readers of what LIGGGHTS writes, frame by frame."""
