"""Solid fraction of poured beds (docs/evidence/packing.md).

Fills a bowl with each of the media in ``solid_fraction.yaml`` and writes a row for each packing:
shape, spread of the sizes, friction and width of the bowl, and the solid fraction obtained. The
runs are ordinary fillings; the same command resumes an interrupted measurement.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from dragdeck.cases.bed import bed_radii, bed_volume, expected_surface
from dragdeck.cases.case import Case
from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.project import find_project
from dragdeck.records.packing import Packing
from dragdeck.scenes.filling import FILLING
from dragdeck.study.yaml import read_yaml
from dragdeck.sweep.cases import settle_case
from dragdeck.sweep.design import Design, Variation
from evidence.beds import settled

DESIGN = Path(__file__).with_suffix(".yaml")


class Beds(Variation):
    """Beds of the design with the name of their shape."""

    shape: str = "sphere"


def bed_cases() -> Iterator[tuple[str, Case]]:
    """Shape and case of each packing."""
    data: Any = read_yaml(DESIGN)
    design = Design[Beds].read(DESIGN, "beds")
    for block, values in design.settings():
        yield block.shape, settle_case(DESIGN, data["study"], values)


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
    project = find_project(Path.cwd())
    batch = Batch(project.results("solid_fraction"), environment(project.templates))
    rows = []
    for shape, case in bed_cases():
        run = FILLING.run_id(case)
        bed = Packing.read(settled(batch, run, FILLING.build(case, None)))
        rows.append(row(shape, case, bed))
        say(f"{shape}: {rows[-1]['solid_fraction']:.3f}")
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.5g")
