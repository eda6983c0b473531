"""Tables, networks and figures from what a DEM engine wrote about a dragged tool.

`load_case` and `load_outputs` say what a run models and wrote; `iter_frames`
and `iter_prints` stream its raw outputs; `write_tables` makes the Parquet
tables that everything else starts from.
"""

from __future__ import annotations

from .case import Case, Output, load_case, load_outputs
from .dumps import iter_frames, iter_prints
from .errors import (
    CaseError,
    DragchainError,
    DumpError,
    GateError,
    SeriesError,
    TableError,
    TruncatedDumpError,
)
from .formats import Frame
from .stats import MeanEstimate, estimate_mean
from .tables import write_tables

__all__ = [
    "Case",
    "CaseError",
    "DragchainError",
    "DumpError",
    "Frame",
    "GateError",
    "MeanEstimate",
    "Output",
    "SeriesError",
    "TableError",
    "TruncatedDumpError",
    "estimate_mean",
    "iter_frames",
    "iter_prints",
    "load_case",
    "load_outputs",
    "write_tables",
]
