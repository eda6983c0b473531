"""Sets of many small runs: calibration, speed of this machine."""
