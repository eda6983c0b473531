"""Scenes: what one engine run models, and nothing it does not need."""
