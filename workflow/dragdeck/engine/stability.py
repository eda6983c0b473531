"""Whether the time step of a finished run was stable on its contact network."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dragdeck.decks import CASE_FILE
from dragdeck.decks.case_file import CaseOfStudy
from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.completeness import part_files, read_frame, whole_frames
from dragdeck.engine.record import AcceptanceCheck, RunPart
from dragdeck.physics.contact_network import stability_number

_FRAMES = 20
"""Frames that are looked at. An assumption: the number scatters by 3 % from frame to frame, and
the median of so many by 1 %."""


def stability_check(
    folder: Path, particles: OutputOfRun, parts: Sequence[RunPart]
) -> AcceptanceCheck:
    """Compare the median `stability_number` of a run with 1.

    Parameters
    ----------
    folder : Path
        The run's folder.
    particles : OutputOfRun
        The output with every particle.
    parts : sequence of RunPart
    """
    case = CaseOfStudy.read(folder / CASE_FILE)
    files = [file for file in part_files(folder, {"": particles}, parts) if file.is_file()]
    ends = {file: [end for _, end in whole_frames(file, particles).ends] for file in files}
    frames = [(file, begin) for file in files for begin in [0, *ends[file]][:-1]]
    chosen = np.linspace(0, len(frames) - 1, min(_FRAMES, len(frames))).astype(int)
    found = [_number(case, particles.columns, *frames[place]) for place in chosen]
    number, why = float(np.median(found or [0.0])), case.unsafe_timestep
    passed = number <= 1
    beyond = f"accepted beyond it: {why}" if why else f"{number**-2:.2g} times the step is stable"
    return AcceptanceCheck(
        code="stable_timestep",
        name="stable time step",
        passed=passed or why is not None,
        seen=f"stability number {number:.3g} of the contacts, median of {len(found)} frames",
        limit="1" if passed else f"1; {beyond}",
    )


def _number(case: CaseOfStudy, columns: Sequence[str], file: Path, begin: int) -> float:
    """Stability number of a frame; infinite for one that is no packing."""
    wanted = [columns.index(name) for name in ("x_m", "y_m", "z_m", "radius_m")]
    rows = read_frame(file, begin)[:, wanted]
    if not (rows.size and np.isfinite(rows).all()):
        return math.inf
    constants = [case.contact_moduli[name] for name in ("particle", "bowl")]
    of_case = case.media.density_kg_m3, case.bowl.radius_m, constants, case.timestep_s
    return stability_number(rows[:, :3], rows[:, 3], *of_case)
