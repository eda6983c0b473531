"""Everything that the page shows on peaks and chains: tables, figures, pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from dragchain.figures.style import drawing, png
from dragchain.files import write_bytes
from dragchain.report.bundle import write_bundle
from dragchain.tables.parquet import write_parquet
from evidence.validation.peaks.figures import draw
from evidence.validation.peaks.film import FILM, PICTURES, peak_pictures
from evidence.validation.peaks.findings import Findings, study
from evidence.validation.peaks.runs import peak_rows
from evidence.validation.peaks.tests import test_table


@dataclass(frozen=True)
class PeaksReport:
    """What a study of peaks and chains writes.

    Attributes
    ----------
    findings : Findings
    peaks, tests : DataFrame
        One row per peak and setting, and one row per test.
    pictures : mapping of str to bytes
        PNG pictures by name.
    film : bytes
        The first run's highest peak as a GIF.
    """

    findings: Findings
    peaks: pd.DataFrame
    tests: pd.DataFrame
    pictures: Mapping[str, bytes]
    film: bytes

    def write(self, out_dir: Path) -> None:
        """Write ``peaks.json``, ``chain_peaks.parquet``, ``chain_tests.*`` and ``figures/``."""
        write_parquet(self.peaks, out_dir / "chain_peaks.parquet")
        write_bytes(out_dir / "figures" / FILM, self.film)
        write_bundle(
            out_dir,
            tables={"chain_tests": self.tests},
            figures=self.pictures,
            documents={"peaks": self.findings},
        )


def report_peaks(run_dirs: Sequence[Path], pictures: int = PICTURES) -> PeaksReport:
    """Test the runs and draw all that the page shows; the film is of the first run.

    Parameters
    ----------
    run_dirs : sequence of Path
        Folders of process runs that differ by their packing, with tables and chains made.
    pictures : int
        Number of pictures of the film, at the most.

    Raises
    ------
    TableError
        No run is given, a table is missing, or a run has no peak.
    RenderError
        Pictures cannot be rendered here.
    """
    made = study(run_dirs)
    with drawing():
        figures = {name: png(figure) for name, figure in draw(made).items()}
    moments, film = peak_pictures(run_dirs[0], pictures)
    tests = test_table(made.findings.tests)
    return PeaksReport(made.findings, peak_rows(made.runs), tests, figures | moments, film)
