"""Limits of LIGGGHTS itself."""

ENGINE_SOFTEST_PA = 5e6
"""The engine's `units si` refuses a softer Young's modulus."""

ENGINE_HARD_PA = 1e9
"""Above this the engine wants `hard_particles yes`."""
