"""The contact network: statistics and force chains."""
