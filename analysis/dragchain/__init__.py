"""Tables, networks and figures from what a DEM engine wrote about a dragged tool.

`load_case` and `load_outputs` say what a run models and wrote; `iter_frames`
and `iter_prints` stream its raw outputs; `write_tables` makes the Parquet
tables that everything else starts from. `read_dump` and `dump_to_parquet` read
any other dump of the engine.
"""

from __future__ import annotations

from dragchain.case import Case, Output, load_case, load_outputs
from dragchain.dumps import iter_frames, iter_prints
from dragchain.errors import (
    CaseError,
    DragchainError,
    DumpError,
    GateError,
    SeriesError,
    TableError,
    TruncatedDumpError,
)
from dragchain.formats import Frame
from dragchain.reading import dump_to_parquet, read_dump
from dragchain.stats import MeanEstimate, estimate_mean
from dragchain.tables import write_tables

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
    "dump_to_parquet",
    "estimate_mean",
    "iter_frames",
    "iter_prints",
    "load_case",
    "load_outputs",
    "read_dump",
    "write_tables",
]
