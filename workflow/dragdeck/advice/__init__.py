"""From a tolerance to settings."""
