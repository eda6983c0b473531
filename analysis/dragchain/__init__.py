"""Read the output of LIGGGHTS and make tables, force chains, figures and reports.

`load` opens the results of a study, `plot` draws them.

The names below are imported on first use, so that the command line starts without delay.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dragchain import plot
    from dragchain.errors import (
        SeriesError,
        TableError,
        UnknownNameError,
    )
    from dragchain.results import FinishedRun, Study, load
    from dragchain.run.run_parts import iter_frames, iter_prints
    from dragchain.statistics.correlated import MeanEstimate, estimate_mean
    from dragchain.tables.parquet import dump_to_parquet
    from dragchain.tables.write import write_tables
    from dragdeck.decks.outputs import OutputOfRun, load_outputs
    from dragdeck.dumps.frame import Frame
    from dragdeck.dumps.reader import read_dump
    from dragdeck.errors import (
        DocumentError,
        DragdeckError,
        DumpError,
        RecordError,
        RejectedRunError,
        TruncatedDumpError,
    )
    from dragdeck.records.case import CaseOfRun, load_case

__all__ = [
    "CaseOfRun",
    "DocumentError",
    "DragdeckError",
    "DumpError",
    "FinishedRun",
    "Frame",
    "MeanEstimate",
    "OutputOfRun",
    "RecordError",
    "RejectedRunError",
    "SeriesError",
    "Study",
    "TableError",
    "TruncatedDumpError",
    "UnknownNameError",
    "dump_to_parquet",
    "estimate_mean",
    "iter_frames",
    "iter_prints",
    "load",
    "load_case",
    "load_outputs",
    "plot",
    "read_dump",
    "write_tables",
]

_MODULES = {
    "dragchain.results": ("FinishedRun", "Study", "load"),
    "dragchain.run.run_parts": ("iter_frames", "iter_prints"),
    "dragchain.statistics.correlated": ("MeanEstimate", "estimate_mean"),
    "dragchain.tables.parquet": ("dump_to_parquet",),
    "dragchain.tables.write": ("write_tables",),
    "dragdeck.decks.outputs": ("OutputOfRun", "load_outputs"),
    "dragdeck.dumps.frame": ("Frame",),
    "dragdeck.dumps.reader": ("read_dump",),
    "dragdeck.errors": (
        *("DocumentError", "DragdeckError", "DumpError", "RecordError", "RejectedRunError"),
        "TruncatedDumpError",
    ),
    "dragdeck.records.case": ("CaseOfRun", "load_case"),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "plot":
        return import_module(f"{__name__}.plot")
    return getattr(import_module(_HOMES.get(name, "dragchain.errors")), name)


def __dir__() -> list[str]:
    return __all__
