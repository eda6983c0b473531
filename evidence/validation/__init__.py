"""A study beside the publication that it reproduces."""
