"""Sets of many small runs: verification, stability map, calibration, costs."""
