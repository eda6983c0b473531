"""Tables, figures and page of the stability map."""

from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from dragchain.figures.style import drawing, png
from dragchain.report.page import data_uri, render_page, write_bundle
from evidence.stability import safe_steps
from evidence.stability.classes import CLASSES, ENERGY_LIMITS, OVERLAP_LIMIT, REFUSED, TOLERANCE
from evidence.stability.document import Criteria, StabilityFile
from evidence.stability.figures import draw
from evidence.stability.map import REGIMES
from evidence.stability.measured import REST_FLOOR
from evidence.stability.point_table import ClassifiedPoint, classify_points, point_table
from evidence.stability.points import PointRun, read_points

_CRITERIA = Criteria(
    tolerance=TOLERANCE,
    overlap_limit=OVERLAP_LIMIT,
    energy_limits=ENERGY_LIMITS,
    rest_floor=REST_FLOOR,
)


def write_stability(out_dir: Path, lists: Sequence[Path]) -> None:
    """Write tables, figures and page of a map whose points were run.

    Parameters
    ----------
    out_dir : Path
        Gets ``points.csv``, ``points.parquet``, ``conditions.csv``, ``conditions.parquet``,
        ``stability.json``, ``figures/*.png`` and ``report.html``.
    lists : sequence of Path
        ``points/<regime>.json``, as ``python -m evidence stability`` wrote them.

    Raises
    ------
    DocumentError, DumpError
        A list or a file of a run cannot be used.
    TableError
        A run was interrupted.
    """
    runs = read_points(lists)
    classified = classify_points(runs)
    points = point_table(classified)
    by_condition = safe_steps.conditions(points)
    document = _summarise(points, by_condition, runs)
    sizes = _run_sizes(runs)
    with drawing():
        drawn = draw(points, by_condition, document.restitution_error, sizes)
        pictures = {name: png(figure) for name, figure in drawn.items()}
    write_bundle(
        out_dir,
        tables={"points": points, "conditions": by_condition},
        figures=pictures,
        documents={"stability": document},
        pages={"report": render(classified, points, by_condition, document, pictures, sizes)},
    )


def _summarise(
    points: pd.DataFrame, by_condition: pd.DataFrame, runs: Sequence[PointRun]
) -> StabilityFile:
    """What ``dragdeck check`` uses: safe steps, errors of impacts, and where they come from."""
    records = [run.record for run in runs if run.record]
    cases = [run.case for run in runs if run.record and run.case]
    started = max((record.started for record in records), default=datetime.now(UTC).isoformat())
    return StabilityFile(
        commands=("snakemake stability",),
        engine_versions=tuple(sorted({record.engine_version for record in records})),
        dragdeck_versions=tuple(sorted({case.versions["dragdeck"] for case in cases})),
        measured=started[:10],
        points=len(points),
        engine_wall_time_s=round(sum(record.wall_time_s for record in records), 1),
        safety_factor=safe_steps.SAFETY_FACTOR,
        criteria=_CRITERIA,
        regimes=safe_steps.regimes(by_condition),
        restitution_error=safe_steps.error_table(points),
    )


def _run_sizes(runs: Sequence[PointRun]) -> dict[str, int]:
    """Impacts, or particles, of a run, by regime; of the base point where it was run."""
    sizes: dict[str, int] = {}
    for run in sorted(runs, key=lambda run: run.point.axis != "base"):
        if run.case is not None:
            pairs = 2 if run.point.settings.get("size_ratio") else 1
            sizes.setdefault(run.point.regime, run.case.media.count // pairs)
    return sizes


def render(
    classified: Sequence[ClassifiedPoint],
    points: pd.DataFrame,
    by_condition: pd.DataFrame,
    document: StabilityFile,
    pictures: Mapping[str, bytes],
    sizes: Mapping[str, int],
) -> str:
    """The page: HTML that needs no other file and no network."""
    tested = points[~points["reference"]]
    axes = points.groupby(["regime", "axis"], sort=False)["label"]
    return render_page(
        "stability/stability.html.j2",
        None,
        "evidence",
        summary=document,
        sizes=sizes,
        class_names=CLASSES,
        classes={
            regime: Counter(tested.loc[tested["regime"] == regime, "class"])
            for regime in REGIMES
            if (tested["regime"] == regime).any()
        },
        axes=[(*names, list(dict.fromkeys(group)), len(group)) for names, group in axes],
        conditions=by_condition.to_dict("records"),
        refusals=list(dict.fromkeys(points.loc[points["class"] == REFUSED, "why"])),
        past_limits=sum(point.verdict.check == "within_limits" for point in classified),
        pictures={name: data_uri(picture) for name, picture in pictures.items()},
        rule=safe_steps.RULE,
    )
