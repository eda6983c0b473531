"""Solid fraction of poured beds (docs/evidence/packing.md).

    python benchmarks/solid_fraction.py docs/data/scenes/solid_fraction.csv [--folder FOLDER]

Fills a bowl with each of the media in ``solid_fraction.yaml`` and writes a row for each packing:
shape, spread of the sizes, friction and width of the bowl, and the solid fraction obtained. The
runs are ordinary fillings; the same command resumes an interrupted measurement.
"""

import argparse
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dragchain.tables.write import write_tables
from dragdeck.cases.bed import bed_radii, bed_volume, expected_surface
from dragdeck.cases.case import Case
from dragdeck.command_line import guarded
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.project import find_project
from dragdeck.records.packing import Packing
from dragdeck.scenes.filling import FILLING
from dragdeck.study.yaml import read_yaml
from dragdeck.sweep.cases import Design, Variation, settle_case

DESIGN = Path(__file__).with_suffix(".yaml")


class Beds(Variation):
    """Beds of the design with the name of their shape."""

    shape: str = "sphere"


def cases() -> Iterator[tuple[str, Case]]:
    """Shape and case of each packing."""
    study, design = read_yaml(DESIGN)["study"], Design[Beds].read(DESIGN, "beds")
    for block in (design.reference, *design.points):
        for _, values in block.points():
            yield block.shape, settle_case(DESIGN, study, {**design.base, **values})


def row(shape: str, case: Case, bed: Packing) -> dict[str, Any]:
    """A packing of the record."""
    study, radii = case.study, bed_radii(case.study)
    around = (radii - radii.mean()) / radii.mean()
    return {
        "shape": shape,
        "spread": around.std(),
        "size_ratio": radii.max() / radii.min(),
        "friction": study.pairs["ceramic-ceramic"].friction,
        "bowl_m": study.bowl.radius_m,
        "particles": len(radii),
        "seed": study.seed,
        "bed_height_m": bed.bed_height_m,
        "solid_fraction": bed.solid_fraction,
        "expected": bed_volume(study) / expected_surface(study) / np.pi / study.bowl.radius_m**2,
    }


def measure(out: Path, folder: Path) -> None:
    """Make the beds that are missing, and write the record."""
    batch, rows = Batch(folder, environment(find_project(Path.cwd()).templates)), []
    for shape, case in cases():
        run = FILLING.run_id(case)
        file = folder / run / "tables" / "packing.json"
        if not file.is_file():
            batch.result(run, FILLING.build(case, None))
            write_tables(folder / run)
        rows.append(row(shape, case, Packing.read(file)))
        say(f"{shape}: {rows[-1]['solid_fraction']:.3f}")
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.5g")


def main() -> int:
    """Measure and return the exit status; see `dragdeck.command_line.guarded`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--folder", type=Path, default=Path("results/solid_fraction"))
    asked = parser.parse_args()
    return guarded("solid_fraction", partial(measure, asked.out, asked.folder))


if __name__ == "__main__":
    sys.exit(main())
