"""Windows: short runs at physical stiffness along the path of a softer run."""
