"""Formulae and limits that need no study file."""
