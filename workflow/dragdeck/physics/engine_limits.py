"""Limits of LIGGGHTS itself."""

ENGINE_SOFTEST_PA = 5e6
"""The engine's `units si` refuses a softer Young's modulus."""

ENGINE_NEIGHBOURS = 2000
"""Neighbours of a particle for which the engine has room by itself (`neigh_modify one`)."""

ENGINE_HARD_PA = 1e9
"""Above this the engine wants `hard_particles yes`."""
