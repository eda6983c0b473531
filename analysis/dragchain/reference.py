"""Figures of a study's source, to set our own beside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dragchain.errors import TableError
from dragchain.findings import Estimate

MEAN, SD = "_drag_mean_n", "_drag_sd_n"
"""Ends of the names of figures in a study's ``reference``."""


@dataclass(frozen=True)
class Reference:
    """A mean drag of the source.

    Attributes
    ----------
    label : str
        What it is, for example ``measured``.
    mean_n : float
        In N, not zero.
    sd_n : float or None
        Its standard deviation in N, None if the source gives none.
    source : str
        Where it stands.
    """

    label: str
    mean_n: float
    sd_n: float | None
    source: str

    def difference(self, ours: Estimate) -> Estimate:
        """Our mean over this one, less one; its interval is that of our mean alone."""
        low, high = sorted(edge / self.mean_n - 1.0 for edge in (ours.low, ours.high))
        return Estimate(ours.value / self.mean_n - 1.0, low, high)


def read_references(known: Mapping[str, object] | None) -> list[Reference]:
    """Every mean drag of a study's ``reference``, ``<label>_drag_mean_n``, by name.

    Raises
    ------
    TableError
        If one is no force to compare with.
    """
    known = known or {}
    names = sorted(name for name in known if name.endswith(MEAN))
    return [_reference(name.removesuffix(MEAN), known) for name in names]


def _reference(label: str, known: Mapping[str, object]) -> Reference:
    mean, sd = known[label + MEAN], known.get(label + SD)
    if not isinstance(mean, int | float) or mean == 0.0:
        raise TableError(
            f"case.json: reference.{label}{MEAN} is {mean!r}, not a force to compare with"
        )
    spread = float(sd) if isinstance(sd, int | float) else None
    return Reference(label, float(mean), spread, str(known.get("source", "")))
