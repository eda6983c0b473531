"""LIGGGHTS and LAMMPS beside each other: runs from the same packings, and their quantities.

Apart from the contact law (`evidence.second_engine.script`), they may differ by the workpiece and
the bowl, whose curvature LAMMPS takes into the effective radius of a contact, by the facets that
LIGGGHTS has in place of the cylinder, by the tangential springs of the filling, which only LIGGGHTS
keeps, and by chance: trajectories diverge.
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import Estimate
from dragdeck.arrays import Floats
from dragdeck.cases.case import Case
from dragdeck.decks.deck import Scene
from dragdeck.dumps.reader import read_dump
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.project import project_here
from dragdeck.records.case import ProcessCase
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.yaml import read_study
from dragdeck.sweep.cases import settle_case, study_file
from dragdeck.sweep.design import Design, Variation
from evidence.beds import batch_here, dragged
from evidence.second_engine.script import SCRIPT_FILE, script, write_particles

DESIGN = Path(__file__).with_name("design.yaml")


def compare_engines(out_dir: Path) -> None:
    """Make the runs that are missing, and write their quantities and the differences.

    Parameters
    ----------
    out_dir : Path
        Gets ``engine_runs.csv`` and ``engines.csv``.

    Raises
    ------
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        A check of a run did not pass.
    CalledProcessError
        LAMMPS stopped, or is not installed.
    """
    batch, rows = batch_here("second_engine"), []
    out_dir.mkdir(parents=True, exist_ok=True)
    for case in design_cases(study_file(project_here().studies, "quickstart")):
        rows += rows_of_case(batch, case)
        runs = pd.DataFrame(rows)
        runs.to_csv(out_dir / "engine_runs.csv", index=False, float_format="%.5g")
        engine_differences(runs).to_csv(out_dir / "engines.csv", index=False, float_format="%.5g")
        say(f"compared: {PROCESS.run_id(case)}")


def rows_of_case(batch: Batch, case: Case) -> list[dict[str, Any]]:
    """Run a case in both engines; a row of quantities of each."""
    folder = dragged(batch, PROCESS.run_id(case), case)
    filling = batch.folder / FILLING.run_id(case) / "tables"
    scene = process_scene(case, read_bed(filling / "packing.json"))
    other = run_lammps(folder / "lammps", scene, filling / "particles.parquet")
    engines = {
        "LIGGGHTS": quantities_of_liggghts(folder, scene.case.media.count),
        "LAMMPS": quantities_of_lammps(other, scene),
    }
    scale = case.study.chosen_fidelity().youngs_modulus_scale
    known = {"modulus_scale": scale, "seed": case.study.seed}
    return [
        {**known, "engine": engine, "quantity": name, "value": of.value, "half": of.half_width}
        for engine, quantities in engines.items()
        for name, of in quantities.items()
    ]


def design_cases(file: Path) -> Iterator[Case]:
    """The cases of the design, of a study file."""
    design, study = Design[Variation].read(DESIGN), {**read_study(file), "fidelity": {}}
    for _, values in design.settings():
        yield settle_case(file, study, values)


def run_lammps(folder: Path, scene: Scene[ProcessCase], particles: Path) -> Path:
    """Run a process in LAMMPS, unless its script has been run to its end; its folder."""
    text, done = script(scene), folder / "done.txt"
    if done.is_file() and done.read_text() == text:
        return folder
    folder.mkdir(exist_ok=True)
    bed = pd.read_parquet(particles)
    write_particles(folder, bed[bed.step == bed.step.max()], scene.case.media.density_kg_m3)
    (folder / SCRIPT_FILE).write_text(text)
    # The library of the package mpich is where no loader looks for it.
    variables = {**os.environ, "LD_LIBRARY_PATH": str(Path(sys.prefix, "lib"))}
    call = [str(Path(sys.prefix, "bin", "lmp")), "-in", SCRIPT_FILE, "-screen", "none"]
    subprocess.run(call, cwd=folder, env=variables, check=True)
    done.write_text(text)
    return folder


# --- quantities ----------------------------------------------------------------------------------


def quantities_of_liggghts(folder: Path, particles: int) -> dict[str, Estimate]:
    """The quantities of a run, from its tables."""
    force, loads, network = (
        pd.read_parquet(folder / "tables" / f"{name}.parquet")
        for name in ("workpiece_force", "workpiece_contacts", "contacts")
    )
    force, loads = force[force.in_statistics], loads[loads.in_statistics]
    pairs = network[(network.kind == "particle-particle") & network.step.isin(force.step)]
    components = force[["drag_n", "lateral_n", "vertical_n"]].to_numpy()
    return _quantities(components, _strengths(loads), _strengths(pairs), particles)


def _strengths(rows: pd.DataFrame) -> list[Floats]:
    """The forces of each frame, N, without contacts of no force."""
    forces = np.linalg.norm(rows[["force_x_n", "force_y_n", "force_z_n"]], axis=1)
    acting = pd.Series(forces[forces > 0]).groupby(rows.step.to_numpy()[forces > 0])
    return [frame.to_numpy() for _, frame in acting]


def quantities_of_lammps(folder: Path, scene: Scene[ProcessCase]) -> dict[str, Estimate]:
    """The same, from the output of LAMMPS."""
    deck: Any = scene.deck
    begin = deck.legs[-1].start_step + scene.case.statistics.transient_s / deck.timestep_s
    step, turn, *on_particles = np.loadtxt(folder / "force.txt", skiprows=1).T
    x, y, z = -np.array(on_particles)[:, step >= begin]
    direction = scene.case.motion.start_direction_rad + turn[step >= begin]
    along = x * np.cos(direction) + y * np.sin(direction)
    left = y * np.cos(direction) - x * np.sin(direction)
    columns = {"workpiece": [f"f_workpiece[{column}]" for column in (2, 3, 4)],
               "network": ["c_network[2]", "c_network[3]"]}  # fmt: skip
    loads, network = (
        [np.linalg.norm(frame.vectors(*names), axis=1)
         for frame in read_dump(folder / f"{file}.dump") if frame.step >= begin]
        for file, names in columns.items()
    )  # fmt: skip
    return _quantities(np.column_stack([along, left, z]), loads, network, scene.case.media.count)


def _quantities(
    force: Floats, loads: Sequence[Floats], network: Sequence[Floats], particles: int
) -> dict[str, Estimate]:
    """Ten means over a drag, with the intervals of correlated samples.

    Parameters
    ----------
    force : (N, 3) ndarray
        Drag, lateral and vertical force on the workpiece, N.
    loads, network : sequence of ndarray
        Forces of all contacts on the workpiece, and of those between particles, N, in each frame.
    particles : int
    """
    drag, lateral, vertical = force.T
    series = {
        "drag_n": drag,
        "drag_variance_n2": (drag - drag.mean()) ** 2,
        "lateral_n": lateral,
        "vertical_n": vertical,
        "workpiece_contacts": [len(frame) for frame in loads],
        "contact_force_n": [frame.mean() for frame in loads],
        "contact_force_p90_n": [np.quantile(frame, 0.9) for frame in loads],
        "coordination": [2 * len(frame) / particles for frame in network],
        "network_force_n": [frame.mean() for frame in network],
        "network_force_cv": [frame.std() / frame.mean() for frame in network],
    }
    return {name: estimate_mean(values).estimate for name, values in series.items()}


def engine_differences(runs: pd.DataFrame) -> pd.DataFrame:
    """The quantities of both engines, and the mean of their differences packing by packing.

    Parameters
    ----------
    runs : DataFrame
        As `compare_engines` writes it.

    Returns
    -------
    DataFrame
        One row per modulus and quantity. The interval of the difference is that of the means of
        the single runs: packings are the same in both engines.
    """
    index, rows = ["modulus_scale", "quantity", "seed"], []
    wide = runs.pivot(index=index, columns="engine", values=["value", "half"])
    for (scale, quantity), part in wide.groupby(level=index[:2], sort=False):
        ours, theirs = (part["value", engine] for engine in ("LIGGGHTS", "LAMMPS"))
        reach = np.sqrt((part["half"] ** 2).to_numpy().sum()) / len(part)
        known = Estimate.around((theirs - ours).mean(), reach)
        rows.append({
            "modulus_scale": scale, "quantity": quantity, "packings": len(part),
            "liggghts": ours.mean(), "lammps": theirs.mean(), "difference": known.value,
            "difference_low": known.ci95_low, "difference_high": known.ci95_high,
        })  # fmt: skip
    return pd.DataFrame(rows)
