"""From a measured drop test to the coefficient of restitution of the input script."""
