"""Solid fraction of poured beds (docs/evidence/packing.md).

Fills a bowl with each of the media in ``solid_fraction.yaml`` and writes a row for each packing:
shape, spread of the sizes, friction and width of the bowl, and the solid fraction obtained. The
runs are ordinary fillings; the same command resumes an interrupted measurement.
"""

from pathlib import Path
from typing import Any

import pandas as pd

from dragdeck.cases.bed import bed_radii, bed_volume, expected_surface
from dragdeck.cases.case import Case
from dragdeck.engine.reports import say
from dragdeck.records.packing import Packing
from dragdeck.sweep.design import Design
from evidence.beds import Repeated, batch_here, designed, filled

DESIGN = Path(__file__).with_suffix(".yaml")


class Beds(Repeated):
    """Beds of the design with the name of their shape."""

    shape: str = "sphere"


def row(shape: str, case: Case, bed: Packing) -> dict[str, Any]:
    """A packing of the record."""
    study, radii = case.study, bed_radii(case.study)
    around = (radii - radii.mean()) / radii.mean()
    return {
        "shape": shape,
        "spread": around.std(),
        "size_ratio": radii.max() / radii.min(),
        "friction": study.pairs["ceramic-ceramic"].friction,
        "bowl_m": study.bowl.container.clear_m,
        "particles": len(radii),
        "seed": study.seed,
        "bed_height_m": bed.bed_height_m,
        "solid_fraction": bed.solid_fraction,
        "expected": bed_volume(study) / study.bowl.container.volume_m3(expected_surface(study)),
    }


def measure_beds(out: Path) -> None:
    """Make the beds that are missing, and write the record."""
    batch, rows = batch_here("solid_fraction"), []
    for block, case in designed(Design[Beds], DESIGN, "beds"):
        rows.append(row(block.shape, case, Packing.read(filled(batch, case))))
        say(f"{block.shape}: {rows[-1]['solid_fraction']:.3f}")
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.5g")
