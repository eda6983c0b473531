"""The report on a calibration: figures and one self-contained page."""

from pathlib import Path

import pandas as pd

from dragchain.calibration.figures import draw_bias, draw_fit, draw_impacts
from dragchain.calibration.fit import calibrate_file
from dragchain.calibration.force_record import read_record
from dragchain.calibration.results import CalibrationFile, confirmed
from dragchain.calibration.simulated_drops import read_drops
from dragchain.errors import TableError
from dragchain.figures.style import drawing, png
from dragchain.report.page import data_uri, render_page, write_bundle


def write_report(record: Path, folder: Path) -> None:
    """Draw the figures and write ``report.html`` of a calibration.

    Parameters
    ----------
    record : Path
        The CSV.
    folder : Path
        With ``result.json``, ``impacts.csv``, ``bias.csv``, ``sweep/drops.json`` and
        ``confirm/drops.json``.

    Raises
    ------
    DragchainError
        A file is missing, or the record cannot be used.
    """
    result = CalibrationFile.read(folder / "result.json")
    sweep, confirm = (read_drops(folder / name / "drops.json") for name in ("sweep", "confirm"))
    found = calibrate_file(record, sweep)
    impacts, bias = (_csv(folder / f"{name}.csv") for name in ("impacts", "bias"))
    with drawing():
        figures = {
            "impacts": png(draw_impacts(read_record(record), found, confirm)),
            "fit": png(draw_fit(found)),
            "bias": png(draw_bias(bias, result)),
        }
    page = render_page(
        "calibration/calibration.html.j2",
        result=result,
        impacts=impacts.to_dict("records"),
        bias=_by_deck_value(bias),
        confirm=confirmed(confirm),
        pictures={name: data_uri(picture) for name, picture in figures.items()},
    )
    write_bundle(folder, figures=figures, pages={"report": page})


def _csv(file: Path) -> pd.DataFrame:
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `snakemake calibrate`")
    return pd.read_csv(file)


def _by_deck_value(bias: pd.DataFrame) -> pd.DataFrame:
    """Effective restitution, one row per deck value, one column per purpose and contact option."""
    return bias.pivot(
        index="restitution_deck",
        columns=["purpose", "limit_force"],
        values="restitution_effective",
    )
