"""Published results that were not used for the model: predicted, then compared."""
