"""Runs in the formats of other programs: ParaView and OVITO."""
