"""Write what was found on peaks and chains: tables, figures, pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

from dragchain.figures.style import STYLE, png
from dragchain.files import write_json
from dragchain.tables.parquet import write_parquet
from dragchain.validation.peaks.figures import draw
from dragchain.validation.peaks.film import write_peak_pictures
from dragchain.validation.peaks.tests import Found, peak_rows, study


def write_peaks(out_dir: Path, run_dirs: Sequence[Path]) -> Found:
    """Test the runs and write all that the page shows; the film is of the first run.

    Parameters
    ----------
    out_dir : Path
        Gets ``peaks.json``, ``chain_peaks.parquet`` (a row a peak and setting),
        ``chain_tests.parquet`` and ``.csv`` (a row a test) and ``figures/``.
    run_dirs : sequence of Path
        Folders of process runs that differ by their fill, with tables and chains made.

    Returns
    -------
    dict
        What ``peaks.json`` holds.

    Raises
    ------
    TableError
        No run is given, a table is missing, or a run has no peak.
    RenderError
        Pictures cannot be rendered here.
    """
    made = study(run_dirs)
    figures = out_dir / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    write_json(out_dir / "peaks.json", made.found)
    write_parquet(peak_rows(made.runs), out_dir / "chain_peaks.parquet")
    write_parquet(made.tests, out_dir / "chain_tests.parquet")
    made.tests.to_csv(out_dir / "chain_tests.csv", index=False, lineterminator="\n")
    with matplotlib.rc_context(STYLE):
        for name, make in draw(made).items():
            (figures / f"{name}.png").write_bytes(png(make()))
    write_peak_pictures(run_dirs[0], figures)
    return made.found
