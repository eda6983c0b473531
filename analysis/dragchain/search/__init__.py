"""A search for a setting of the machine by Bayesian optimisation."""
