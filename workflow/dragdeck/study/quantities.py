"""The registry of the quantities of runs."""

from pathlib import Path

from dragdeck.files import table_rows

QUANTITIES = table_rows(Path(__file__).with_name("quantities.csv"))
"""Its rows, in the order of the report. `kind`: how a trade-off and windows treat it; none: they do
not have it. `tolerance`: whether a tolerance may apply to it. `reported`: whether the report and a
search have it. `negative`: whether it may be negative. Other columns: see
`dragchain.quantities.registry.Quantity`."""
