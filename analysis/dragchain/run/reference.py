"""Figures of a study's source, to set our own beside."""

from dragchain.errors import TableError
from dragchain.statistics.estimate import Estimate
from dragdeck.parts import Part
from dragdeck.study.reference import Reference


class ReferenceDrag(Part):
    """A published mean drag to compare with.

    Attributes
    ----------
    label : str
        ``experiment`` or ``simulation``.
    mean_n, std_n : float
        Published mean, not zero, and standard deviation, N; the latter is None if it is not
        reported.
    source : str
        Where it is published.
    """

    label: str
    mean_n: float
    std_n: float | None
    source: str

    def difference(self, ours: Estimate) -> Estimate:
        """Relative difference of our mean to this one; its interval is that of our mean alone."""
        low, high = sorted(edge / self.mean_n - 1.0 for edge in (ours.ci95_low, ours.ci95_high))
        return Estimate(ours.value / self.mean_n - 1.0, low, high)


def reference_drags(reference: Reference | None) -> list[ReferenceDrag]:
    """Every mean drag of a study's ``reference``, the experiment first.

    Raises
    ------
    TableError
        If one is zero, and so no force to compare with.
    """
    if reference is None:
        return []
    drags = []
    for label in ("experiment", "simulation"):
        drag = getattr(reference, label)
        if drag is None:
            continue
        if drag.drag_mean_n == 0.0:
            raise TableError(
                f"case.json: reference.{label}.drag_mean_n is 0, so no relative difference exists"
            )
        mean_n, std_n = drag.drag_mean_n, drag.drag_std_n
        source = reference.source
        drags.append(ReferenceDrag(label=label, mean_n=mean_n, std_n=std_n, source=source))
    return drags
