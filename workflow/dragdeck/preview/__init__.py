"""What a study describes, drawn before anything is run."""
