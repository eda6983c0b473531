"""How fast this machine runs a study: a short run of its own decks.

Steps per second depend on the number of balls and of contacts, hardly on the
modulus. So a soft bed is settled, which takes few steps, and the tool is
dragged through it for some thousand of them. What happens in one step, the way
of the tool and the share of steps with output, is that of the settings asked.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import jinja2

from dragdeck.cases import Case
from dragdeck.errors import EngineError, GateError
from dragdeck.motion import plunge_point, start_point
from dragdeck.render import write_run
from dragdeck.runner import run
from dragdeck.scenes import Bed, Scene, fill_scene, process_scene
from dragdeck.scenes.common import bed_rayleigh_time, timestep
from dragdeck.scenes.fill import expected_surface
from dragdeck.similarity import softest_scale
from dragdeck.stability_map import tabulate
from dragdeck.study import CirclePath, Fidelity, Motion, Outputs, Study

SCALE = 1e-3
"""On the modulus of the short run; more where the engine refuses so soft a ball."""

TIMESTEP_FRACTION = 0.5
"""Step of its process over the Rayleigh time."""

DRAG_STEPS = 6000
"""Steps that are timed."""

ARRIVAL_STEPS = 3000
"""Steps in which the tool goes in, and steps in which it goes to its path."""

LONGEST_PERIOD_STEPS = 1000
"""Most steps between frames of the slowest output; the legs are multiples of it."""

Report = Callable[[str], None]


@dataclass(frozen=True)
class Speed:
    """A measured speed of the engine on this machine.

    Attributes
    ----------
    fill_steps_per_s, drag_steps_per_s : float
    balls, ranks : int
    engine_version : str
    """

    fill_steps_per_s: float
    drag_steps_per_s: float
    balls: int
    ranks: int
    engine_version: str

    def of(self, balls: int) -> Speed:
        """The speed with another number of balls: a step takes a time a ball."""
        ratio = self.balls / balls
        fill, drag = ratio * self.fill_steps_per_s, ratio * self.drag_steps_per_s
        return replace(self, fill_steps_per_s=fill, drag_steps_per_s=drag, balls=balls)


def calibrate(case: Case, folder: Path, templates: jinja2.Environment, report: Report) -> Speed:
    """Run a study's bed and drag for some seconds and see how fast they are.

    Parameters
    ----------
    case : Case
        At the settings whose speed is asked.
    folder : Path
        Gets the runs.
    templates : jinja2.Environment
    report : callable
        Gets a line a run.

    Raises
    ------
    EngineError, GateError
        The short run failed, so nothing is known of the speed.
    """
    short = short_case(case)
    fill, process = (folder / scene / short.run_ids[scene] for scene in ("fill", "process"))
    _run(fill_scene(short), fill, templates, report)
    tabulate(fill)
    bed = json.loads((fill / "tables" / "fill.json").read_text(encoding="utf-8"))
    scene = process_scene(short, Bed(bed["fill_height_m"], bed["top_m"]))
    _run(scene, process, templates, report)
    settled = json.loads((fill / "run.json").read_text(encoding="utf-8"))
    return Speed(
        fill_steps_per_s=settled["steps_per_s"],
        drag_steps_per_s=last_loop((process / "screen.1.txt").read_text(errors="replace")),
        balls=case.study.media.count,
        ranks=settled["ranks"],
        engine_version=settled["engine_version"],
    )


def _run(scene: Scene, folder: Path, templates: jinja2.Environment, report: Report) -> None:
    write_run(scene, folder, templates)
    try:
        run(folder, report)
    except GateError as error:
        raise GateError(
            f"{error}\n  the calibration of the speed failed; without it: dragdeck advise --quick"
        ) from None


def last_loop(screen: str) -> float:
    """Steps per second of the engine's last ``run`` command: that of the drag.

    Raises
    ------
    EngineError
        The engine's output has no such line.
    """
    loops = re.findall(r"^Loop time of (\S+) on \d+ procs for (\d+) steps", screen, re.MULTILINE)
    if not loops or float(loops[-1][0]) <= 0:
        raise EngineError("the engine does not say how long its last run took")
    seconds, steps = loops[-1]
    return int(steps) / float(seconds)


def short_case(case: Case) -> Case:
    """The case as it is run for its speed: soft, quickly on the path, and soon done."""
    study = case.study
    asked = study.chosen_fidelity()
    soft = Fidelity(
        youngs_modulus_scale=max(SCALE, softest_scale(study)),
        timestep_fraction=min(TIMESTEP_FRACTION, asked.timestep_fraction),
        fill_timestep_fraction=asked.fill_timestep_fraction,
        skin_m=asked.skin_m,
        ranks=case.ranks,
    )
    changed = study.model_copy(update={"fidelity": soft})
    dt = _timestep(changed)
    pace = asked.speed_factor * _timestep(study) / dt
    update = {"motion": _motion(changed, pace, dt), "outputs": _outputs(study.outputs, pace, dt)}
    return Case(case.file, {}, changed.model_copy(update=update))


def _timestep(study: Study) -> float:
    return timestep(bed_rayleigh_time(study), study.chosen_fidelity().timestep_fraction)


def _motion(study: Study, pace: float, timestep_s: float) -> Motion:
    """A plunge, an approach and a drag of few steps.

    Parameters
    ----------
    study : Study
    pace : float
        On the drag's speed, so that the tool's way in a step stays as it is.
    timestep_s : float
    """
    motion = study.motion
    speed = pace * motion.speed_m_s
    length, arrival_s = speed * DRAG_STEPS * timestep_s, ARRIVAL_STEPS * timestep_s
    here, there = plunge_point(motion), start_point(motion)
    way = math.dist(here, there) or motion.submersion_m
    path = motion.path
    if isinstance(path, CirclePath):
        turns = length / (2 * math.pi * path.radius_m)
        path = path.model_copy(update={"revolutions": turns})
    else:
        path = path.model_copy(update={"length_m": min(length, path.length_m)})
    return motion.model_copy(
        update={
            "path": path,
            "speed_m_s": speed,
            "plunge_speed_m_s": expected_surface(study) / arrival_s,
            "approach_speed_m_s": way / arrival_s,
            "run_in_m": 0.0,
        }
    )


def _outputs(outputs: Outputs, pace: float, timestep_s: float) -> Outputs:
    """As many frames a step as asked, or more: no leg is shorter than a frame."""
    least = 1 / (LONGEST_PERIOD_STEPS * timestep_s)
    names = ("tool_force_hz", "tool_contacts_hz", "network_hz")
    rates = {name: max(pace * getattr(outputs, name), least) for name in names}
    return outputs.model_copy(update={**rates, "checkpoints": 0})
