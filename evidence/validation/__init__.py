"""A study against what its source says: forces, load, and the source's statements."""
