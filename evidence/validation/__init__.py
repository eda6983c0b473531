"""A study against what its source says: forces, chains and peaks, and the source's statements."""
