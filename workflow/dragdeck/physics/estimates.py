"""What a poured bed is expected to be before it exists."""

SOLID_FRACTION_ESTIMATE = 0.59
"""Solid fraction of a poured bed of spheres of about one size, about twelve of them wide, an
estimate used only for expectations before the bed exists (measured beds replace it)."""

COORDINATION_ESTIMATE = 5.0
"""Contacts of a particle in a poured bed with friction, an estimate used only for expectations."""
