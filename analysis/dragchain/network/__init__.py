"""The contact network: statistics, force chains and clusters."""
