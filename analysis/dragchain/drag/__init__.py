"""The force on the workpiece."""
