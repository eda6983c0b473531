"""What LIGGGHTS writes: the grammar of its dumps, an index of whole frames, and readers."""
