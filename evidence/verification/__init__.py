"""Verification of the contact law on the engine: references, checks, report."""
