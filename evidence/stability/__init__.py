"""The map of stable and unstable time steps."""
