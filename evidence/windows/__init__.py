"""What designed scenes say of windows and time steps, for the advice of dragdeck."""
