"""Power laws of the mean drag."""
