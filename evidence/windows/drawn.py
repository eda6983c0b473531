"""Scenes of drag finishing drawn from a seed, for what windows are judged by.

    python -m evidence draw-scenes 17 --scenes 12    # studies in this project
    python -m evidence draw-scenes 17 --packings 3   # the same, each with plain runs beside it
    ./run $(python -m evidence window-targets drawn-17-00) --config study=drawn-17-00
    python -m evidence collect-windows drawn.tar.xz results/drawn-17-*

Workpiece, wall and floor are at least 2.8 diameters apart: in narrower gaps, particles jam at the
physical modulus, and single forces decide the means.
"""

import math
import tarfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.quantities.document import MEASURED_FILE
from dragchain.windows.rounds import measured_window
from dragdeck.errors import InputError, choices
from dragdeck.project import project_here
from dragdeck.records.case import load_case
from dragdeck.scenes.lead import windows_of
from dragdeck.scenes.process import PROCESS
from dragdeck.sweep.cases import settle_case
from evidence.windows.judge import write_pair

MATERIALS = {
    "glass": (63e9, 0.22, 2500.0),
    "alumina": (370e9, 0.22, 3900.0),
    "zirconia": (205e9, 0.31, 6000.0),
    "porcelain": (77e9, 0.19, 2656.0),
    "steel": (210e9, 0.30, 7800.0),
    "polyester": (4e9, 0.38, 1400.0),
    "acrylic": (3e9, 0.37, 1190.0),
    "polyamide": (2.5e9, 0.40, 1140.0),
    "polypropylene": (1.5e9, 0.42, 905.0),
}
"""Young's modulus, Pa, Poisson's ratio, and density, kg/m3, of common media."""

_USUAL = 6
"""So many of them are drawn if none are named."""

_SOLID, _GRAVITY = 0.59, 9.81


def drawn(
    random: np.random.Generator, number: int, name: str, inertial: Sequence[float]
) -> dict[str, Any]:
    """A scene as plain data: 400 to 800 particles, lengths in particle diameters d.

    Parameters
    ----------
    random : numpy.random.Generator
    number : int
        From 0.
    name : str
        Of the material of the media.
    inertial : (2,) sequence of float
        Range of the inertial number.
    """
    d = random.uniform(4e-3, 9e-3)
    thick, gap, reach = random.uniform(0.8, 1.4), random.uniform(2.8, 3.2), random.uniform(1.2, 1.8)
    outer, height = reach + thick / 2 + gap, random.uniform(6.0, 7.0)
    depth = height - random.uniform(2.8, 3.2)
    low, high = (math.log(limit) for limit in inertial)
    speed = math.exp(random.uniform(low, high)) * math.sqrt(_SOLID * _GRAVITY * depth * d)
    restitution, friction = random.uniform(0.5, 0.9), random.uniform(0.15, 0.5)
    on_tool = friction * random.uniform(0.6, 1.0)
    scene: dict[str, Any] = {
        "title": f"Drawn scene {number}: {name}",
        "materials": {"media": _material(*MATERIALS[name]), "tool": _material(210e9, 0.3, 7800.0)},
        "pairs": {
            "media-media": {"restitution": restitution, "friction": friction},
            "media-tool": {"restitution": restitution - 0.05, "friction": on_tool},
        },
        "media": {
            "material": "media",
            "count": math.ceil(6 * _SOLID * outer**2 * height),
            "radius_mean_m": d / 2,
            "radius_std_m": random.uniform(0.02, 0.08) * d / 2,
        },
        "bowl": {"material": "tool", "radius_m": outer * d, "height_m": 1.6 * height * d},
        "workpiece": {"material": "tool", "shape": {"kind": "cylinder", "radius_m": thick * d / 2}},
        "motion": {
            "path": {
                "kind": "circle",
                "radius_m": reach * d,
                "revolutions": random.uniform(10.0, 20.0) / (2 * math.pi * reach),
            },
            "speed_m_s": speed,
            "immersion_depth_m": depth * d,
            "transient_m": 1.5 * d,
        },
        "outputs": {
            "workpiece_force_hz": 100 * speed / d,
            "workpiece_contacts_hz": 50 * speed / d,
            "network_hz": 12 * speed / d,
        },
        "seed": int(random.integers(1, 10_000)),
    }
    short: dict[str, Any] = _short(scene)
    return short


def _material(modulus: float, poisson: float, density: float) -> dict[str, float]:
    return {"youngs_modulus_pa": modulus, "poissons_ratio": poisson, "density_kg_m3": density}


def _short(part: Any) -> Any:
    """Plain data with numbers of four digits."""
    if isinstance(part, dict):
        return {name: _short(entry) for name, entry in part.items()}
    return float(f"{part:.4g}") if isinstance(part, float) else part


def draw_scenes(
    seed: int,
    scenes: int,
    fidelity: str,
    packings: int,
    materials: Sequence[str] | None,
    inertial: Sequence[float],
) -> str:
    """Write a study for each scene into the project, and perhaps one of plain runs; their names.

    Parameters
    ----------
    seed : int
    scenes : int
    fidelity : str
        Block of each study, as YAML.
    packings : int
        Of the plain runs; 0: no such study.
    materials : sequence of str, optional
        Of the media, names in `MATERIALS`; scenes have them in turn.
    inertial : (2,) sequence of float
        Range of the inertial number.

    Raises
    ------
    InputError
        No such material.
    """
    random, names = np.random.default_rng(seed), []
    media = materials or list(MATERIALS)[:_USUAL]
    for name in set(media) - set(MATERIALS):
        limit = choices(name, MATERIALS)
        raise InputError("no such material", field="--materials", value=name, limit=limit)
    for number in range(scenes):
        names.append(f"drawn-{seed}-{number:02d}")
        scene = drawn(random, number, media[number % len(media)], inertial)
        case = settle_case(Path(names[-1]), scene, {})
        write_pair(names[-1], case, fidelity, packings)
    return "\n".join(names)


def window_targets(study: str) -> str:
    """The files that Snakemake makes of all windows of a study, and of its soft runs; in a line.

    Parameters
    ----------
    study : str
    """
    project = project_here()
    runs = [run for case in project.cases(study) for run in (case, *windows_of(case))]
    folders = (project.run_folder(run, PROCESS).relative_to(project.root) for run in runs)
    return " ".join(str(folder / MEASURED_FILE) for folder in folders)


def collect_windows(archive: Path, results: Sequence[Path]) -> str:
    """Write an archive with the quantities of soft runs and windows, one folder per soft run.

    Windows that a study would refuse, and those that were not run, are left out.

    Parameters
    ----------
    archive : Path
        A ``.tar.xz`` file.
    results : sequence of Path
        Folders of results of studies.
    """
    number = 0
    with tarfile.open(archive, "w:xz") as files:
        for study in results:
            for file in sorted(study.glob(f"windows/*_window-*/{MEASURED_FILE}")):
                folder = file.parents[1]
                lead = load_case(folder).lead
                assert lead is not None
                if measured_window(folder).refused:
                    continue
                soft = f"{study.name}/{lead}/soft.json"
                if soft not in files.getnames():
                    files.add(study / "process" / lead / MEASURED_FILE, soft)
                files.add(file, f"{study.name}/{lead}/{folder.name}.json")
                number += 1
    return f"{archive}: {number} windows"
