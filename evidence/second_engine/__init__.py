"""The process of a study in a second DEM code, LAMMPS, beside LIGGGHTS."""
