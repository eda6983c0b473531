"""What the suite of attacks is made of."""
