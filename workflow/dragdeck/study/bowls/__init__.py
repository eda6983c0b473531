"""Kinds of bowl: one module for each."""
