"""Runs in the format of ParaView, which OVITO reads too."""
