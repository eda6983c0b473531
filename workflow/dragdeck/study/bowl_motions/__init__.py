"""Motions of the bowl: one module for each kind."""
