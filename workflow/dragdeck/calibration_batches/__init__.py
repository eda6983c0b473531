"""Batches of short runs for a calibration: drop tests, heaps and drums."""
