"""Statistics that know neither tables nor runs."""
