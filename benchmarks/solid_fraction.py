"""Solid fraction of poured beds (docs/evidence/packing.md).

    python benchmarks/solid_fraction.py docs/data/scenes/solid_fraction.csv [--folder FOLDER]

Fills a bowl with each of the media below, several times, and writes a row for each packing: shape,
spread of the sizes, friction and width of the bowl, and the solid fraction obtained. The runs are
ordinary fillings; the same command resumes an interrupted measurement.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
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
from dragdeck.sweep.cases import settle_case

_RADIUS_M = 3.27e-3

_STUDY: Mapping[str, Any] = {
    "title": "Solid fraction of poured beds",
    "materials": {
        "ceramic": {"youngs_modulus_pa": 77e9, "poissons_ratio": 0.19, "density_kg_m3": 2656},
        "steel": {"youngs_modulus_pa": 210e9, "poissons_ratio": 0.30, "density_kg_m3": 7610},
    },
    "pairs": {
        "ceramic-ceramic": {"restitution": 0.86, "friction": 0.34},
        "ceramic-steel": {"restitution": 0.68, "friction": 0.28},
    },
    "bowl": {"material": "steel", "radius_m": 7 * _RADIUS_M, "height_m": 0.5},
    "workpiece": {"material": "steel", "shape": {"kind": "cylinder", "radius_m": 0.004}},
    "motion": {
        "path": {"kind": "circle", "radius_m": 0.010, "revolutions": 0.1},
        "speed_m_s": 0.02, "immersion_depth_m": 0.01,
        "plunge_speed_m_s": 0.1, "approach_speed_m_s": 0.05, "transient_m": 0.001,
    },
    "fidelity": {
        "youngs_modulus_scale": 3e-4, "timestep_fraction": 0.5,
        "filling_timestep_fraction": 0.5, "ranks": 1, "skin_m": 1e-3,
    },
}  # fmt: skip

_MEAN = {"material": "ceramic", "radius_mean_m": _RADIUS_M}
_COUNT, _COUNT_OF_CLUMPS = 300, 240

_SHAPES: Mapping[str, Mapping[str, Any]] = {
    "cylinder 1.2, cut": {"kind": "cylinder", "aspect": 1.2, "cut_deg": 30, "spheres": 4},
    "tetrahedron": {"kind": "tetrahedron", "spheres": 4},
    "cylinder 2": {"kind": "cylinder", "aspect": 2.0, "spheres": 4},
    "ellipsoid 2": {"kind": "ellipsoid", "axes": [2, 1, 1], "spheres": 4},
    "prism 1": {"kind": "triangular_prism", "aspect": 1.0, "spheres": 4},
    "cylinder 1": {"kind": "cylinder", "aspect": 1.0, "spheres": 6},
    "cylinder 3": {"kind": "cylinder", "aspect": 3.0, "spheres": 5},
    "cone 1": {"kind": "cone", "aspect": 1.0, "spheres": 4},
}


def _classes(ratio: float, fine: float) -> dict[str, Any]:
    """Two sizes, the smaller one with this fraction of the mass."""
    small = {"material": "ceramic", "radius_mean_m": _RADIUS_M / ratio, "fraction": fine}
    large = {**_MEAN, "fraction": 1 - fine}
    return {"classes": {"coarse": large, "fine": small}}


def media() -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Name, `media` and other fields of each bed."""
    for name, shape in _SHAPES.items():
        yield name, {**_MEAN, "shape": shape, "count": _COUNT_OF_CLUMPS}, {}
    spheres = {**_MEAN, "count": _COUNT}
    mass = 2656 * 4 / 3 * np.pi * _RADIUS_M**3 * _COUNT
    for seed in (1, 2):
        for spread in (0.0, 0.1, 0.2):
            yield "sphere", {**spheres, "radius_std_m": spread * _RADIUS_M}, {"seed": seed}
        for ratio in (1.5, 2.0):
            yield "sphere", {**_classes(ratio, 0.3), "mass_kg": mass}, {"seed": seed}
        for friction in (0.1, 0.7):
            fields = {"pairs.ceramic-ceramic.friction": friction, "seed": seed}
            yield "sphere", dict(spheres), fields
    yield "sphere", {**spheres, "count": 3 * _COUNT}, {"bowl.radius_m": 12 * _RADIUS_M}
    yield "sphere", {**_classes(3.0, 0.3), "mass_kg": mass}, {}


def cases() -> Iterator[tuple[str, Case]]:
    """Shape and case of each packing."""
    for name, media_of_case, others in media():
        values = {"seed": 1, **others}
        yield name, settle_case(Path("study.yaml"), {**_STUDY, "media": media_of_case}, values)


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
