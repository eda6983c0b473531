"""Read the output of LIGGGHTS and make tables, force chains, figures and reports.

`load` opens the results of a study, `plot` draws them.

The names below are imported on first use, so that the command line starts without delay.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dragchain import plot as plot
    from dragchain.errors import SeriesError as SeriesError
    from dragchain.errors import TableError as TableError
    from dragchain.errors import UnknownNameError as UnknownNameError
    from dragchain.network.foreign import NetworkOfDump as NetworkOfDump
    from dragchain.network.foreign import network_of_dump as network_of_dump
    from dragchain.results import FinishedRun as FinishedRun
    from dragchain.results import Study as Study
    from dragchain.results import load as load
    from dragchain.run.run_parts import iter_frames as iter_frames
    from dragchain.run.run_parts import iter_prints as iter_prints
    from dragchain.statistics.correlated import MeanEstimate as MeanEstimate
    from dragchain.statistics.correlated import estimate_mean as estimate_mean
    from dragchain.tables.parquet import dump_to_parquet as dump_to_parquet
    from dragchain.tables.write import write_tables as write_tables
    from dragdeck.decks.outputs import OutputOfRun as OutputOfRun
    from dragdeck.decks.outputs import load_outputs as load_outputs
    from dragdeck.dumps.frame import Frame as Frame
    from dragdeck.dumps.reader import read_dump as read_dump
    from dragdeck.errors import DocumentError as DocumentError
    from dragdeck.errors import DragdeckError as DragdeckError
    from dragdeck.errors import DumpError as DumpError
    from dragdeck.errors import RecordError as RecordError
    from dragdeck.errors import RejectedRunError as RejectedRunError
    from dragdeck.errors import TruncatedDumpError as TruncatedDumpError
    from dragdeck.records.case import CaseOfRun as CaseOfRun
    from dragdeck.records.case import load_case as load_case

_MODULES = {
    "dragchain.errors": ("SeriesError", "TableError", "UnknownNameError"),
    "dragchain.network.foreign": ("NetworkOfDump", "network_of_dump"),
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
__all__ = sorted([*_HOMES, "plot"])


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "plot":
        return import_module(f"{__name__}.plot")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
