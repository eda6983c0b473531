"""Whether force chains explain the peaks of the drag."""
