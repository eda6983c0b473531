"""What a run folder says before any dump is read."""
