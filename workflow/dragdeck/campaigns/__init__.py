"""Sets of many small runs: calibration."""
