"""Tables, figures and page of a validation."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from dragchain.figures.style import drawing, png
from dragchain.report.page import data_uri, render_page, write_bundle
from dragchain.scaling.document import ScalingFile
from dragchain.scaling.fit import draw_scalings, read_scalings
from dragchain.statistics.estimate import EstimateColumns
from dragdeck.documents import Document
from evidence.validation import chain_peaks, figures
from evidence.validation import loading_over_packings as loading
from evidence.validation.around_workpiece import Profile, Statements, of_packings
from evidence.validation.claims import Claim, claim_table, claims
from evidence.validation.effects import Effect, effect_table, effects
from evidence.validation.force import Compared, Force, compare
from evidence.validation.force import of_packings as force_of
from evidence.validation.runs_by_bed import Points, read_points

_SAME_SCENE = ("bowl_to_particle", "particle_friction", "lowest_restitution", "particles")
"""Numbers that a scene shares with the sweeps that are shown beside it."""


class Validation(Document):
    """The content of ``validation.json``."""

    study: str
    command: str
    measured: str
    versions: Mapping[str, str]
    engine_hours: float
    force: Force
    comparison: tuple[Compared, ...]
    load: loading.LoadingOverPackings
    statements: Statements
    scalings: tuple[ScalingFile, ...]
    claims: tuple[Claim, ...]
    effects: tuple[Effect, ...]


def write_validation(out_dir: Path, run_dirs: Sequence[Path], command: str) -> None:
    """Write tables, figures and page of the runs of a validation.

    Parameters
    ----------
    out_dir : Path
        Gets ``validation.json``, ``*.parquet``, ``*.csv``, ``figures/*`` and ``report.html``.
    run_dirs : sequence of Path
        Folders of measured runs; the first is at the reference's settings.
    command : str
        What made them, for the page.

    Raises
    ------
    DocumentError
        A run has no measures.
    TableError
        Fewer than two packings are complete.
    SeriesError
        There are too few runs to compare settings.
    """
    points = read_points(run_dirs)
    found = validate(points, command)
    peaks = chain_peaks.of_runs([point.folder for point in points.packings])
    pictures = _draw(points, found)
    write_bundle(
        out_dir,
        tables={**tables(points, found), "chain_tests": peaks.table()},
        figures=pictures,
        documents={"validation": found, "peaks": peaks},
        pages={"report": render(points, found, peaks, pictures)},
    )


def validate(points: Points, command: str) -> Validation:
    """All numbers of the page but those of peaks and chains."""
    first = points.packings[0]
    force, statements = force_of(points.packings), of_packings(points.packings)
    return Validation(
        study=first.case.study,
        command=command,
        measured=max(point.measures.started for point in points.all)[:10],
        versions=first.measures.versions,
        engine_hours=sum(point.measures.cost.cpu_time_s for point in points.all) / 3600.0,
        force=force,
        comparison=compare(force.together["drag_n"], first.case),
        load=loading.of_packings(points.packings),
        statements=statements,
        scalings=tuple(_scalings_of(first.measures.numbers)),
        claims=claims(statements),
        effects=tuple(effects(points)),
    )


def _scalings_of(numbers: Mapping[str, float]) -> list[ScalingFile]:
    """The packaged sweeps that were made in a scene with these numbers."""
    return [
        found
        for found in read_scalings()
        if all(math.isclose(found.scene[k], numbers[k], rel_tol=0.01) for k in _SAME_SCENE)
    ]


def tables(points: Points, found: Validation) -> dict[str, pd.DataFrame]:
    """The numbers of the page as tables, by name."""
    force, statements = found.force, found.statements
    network, spectrum = statements.network, force.spectrum
    return {
        "packings": pd.json_normalize([row.model_dump() for row in force.packings], sep="_"),
        "effects": effect_table(found.effects),
        "load": pd.DataFrame([dict(row) for row in found.load.rows]),
        "facets": loading.facets(points.packings),
        "comparison": pd.json_normalize([_flat(row) for row in found.comparison], sep="_"),
        "statements": claim_table(found.claims),
        "corridor": pd.DataFrame(
            {
                **_bins(network.edges_diameters, "diameters"),
                **_side("ahead", network.ahead_n),
                **_side("behind", network.behind_n),
            }
        ),
        "around": _profile(statements.azimuth, "rad"),
        "depth": _profile(statements.depth, "m"),
        "spectrum": pd.DataFrame(
            {"waves_per_diameter": spectrum.waves_per_diameter, **dict(spectrum.density)}
        ),
    }


def _flat(row: Compared) -> dict[str, Any]:
    return row.model_dump(exclude={"std_ratio"} if row.std_ratio is None else None)


def _bins(edges: Sequence[float], unit: str) -> dict[str, Sequence[float]]:
    return {f"from_{unit}": edges[:-1], f"to_{unit}": edges[1:]}


def _side(side: str, columns: EstimateColumns) -> dict[str, Sequence[float]]:
    return {f"{side}_{name}_n": values for name, values in vars(columns).items()}


def _profile(profile: Profile, unit: str) -> pd.DataFrame:
    values = profile.model_dump(exclude={"edges"})
    return pd.DataFrame({**_bins(profile.edges, unit), **values})


def _draw(points: Points, found: Validation) -> dict[str, bytes]:
    """The figures of the page as PNG, by name."""
    with drawing():
        drawn = {
            "comparison": figures.comparison(found.force, found.comparison, found.effects),
            "traces": figures.traces(points.packings, found.comparison),
            "spectrum": figures.spectrum(found.force.spectrum),
            "around": figures.around(found.statements),
            "corridor": figures.corridor(found.statements.network),
        }
        if any(row.field for row in found.effects):
            drawn["assumed"] = figures.assumed(found.effects)
        if found.scalings:
            drawn["scaling"] = draw_scalings(found.scalings)
        pictures = {name: png(figure) for name, figure in drawn.items()}
    workpiece = points.packings[0].folder / "figures" / "workpiece.png"
    return pictures | {"workpiece": workpiece.read_bytes()}


def render(
    points: Points, found: Validation, peaks: chain_peaks.Findings, pictures: Mapping[str, bytes]
) -> str:
    """The page: HTML that needs no other file and no network."""

    def picture(name: str) -> str | None:
        shown = pictures.get(Path(name).stem)
        return data_uri(shown, "png") if shown else None

    return render_page(
        "validation/validation.html.j2",
        None,
        "evidence",
        found=json.loads(found.as_text()),
        scalings=found.scalings,
        peaks=json.loads(peaks.as_text()),
        assumptions=points.packings[0].case.assumptions,
        varied={row.field for row in found.effects},
        points=points,
        picture=picture,
    )
