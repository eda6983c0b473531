"""Paths of the workpiece's axis: one module for each kind."""
