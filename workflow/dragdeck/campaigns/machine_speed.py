"""How fast this machine runs a study: a short run of its own decks.

Steps per second depend on the number of particles and of contacts, hardly on the
modulus. So a soft bed is settled, which takes few steps, and the workpiece is
dragged through it for some thousand of them. What happens in one step, the way
of the workpiece and the fraction of steps with output, is that of the settings asked.
"""

import math
from pathlib import Path

import jinja2

from dragdeck.advice.advise import SCALE, consistent
from dragdeck.cases.bed import bed_timestep
from dragdeck.cases.case import Case
from dragdeck.engine.batch import Batch
from dragdeck.engine.log import loops
from dragdeck.engine.reports import Report
from dragdeck.errors import EngineError, RejectedRunError
from dragdeck.physics.packing import Bed
from dragdeck.records.advice import Speed
from dragdeck.records.run import RunRecord
from dragdeck.scenes.filling import FILLING, expected_surface
from dragdeck.scenes.motion import plunge_point
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.scene import SceneType
from dragdeck.study.model import Fidelity, Motion, Outputs, Study

_TIMESTEP_FRACTION = 0.5
"""Step of its process over the Rayleigh time."""

DRAG_STEPS = 6000
"""Steps that are timed."""

_ARRIVAL_STEPS = 3000
"""Steps in which the workpiece goes in, and steps in which it goes to its path."""

_LONGEST_PERIOD_STEPS = 1000
"""Most steps between frames of the slowest output; the legs are multiples of it."""

_CLEAR_DIAMETERS = 3
"""Particle diameters above the expected surface at which the workpiece begins."""


def measure_machine_speed(
    case: Case, folder: Path, templates: jinja2.Environment, report: Report
) -> Speed:
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
    EngineError, RejectedRunError
        The short run failed, so nothing is known of the speed.
    """
    short = short_case(case)
    settled = _result(Batch(folder / FILLING.name, templates, report), FILLING, short, None)
    _result(Batch(folder / PROCESS.name, templates, report), PROCESS, short, _low_bed(short.study))
    screen = folder / PROCESS.name / PROCESS.run_id(short) / "screen.1.txt"
    return Speed(
        filling_steps_per_s=settled.steps_per_s,
        drag_steps_per_s=last_loop(screen.read_text(errors="replace")),
        particles=case.study.particle_count,
        ranks=settled.ranks,
        engine_version=settled.engine_version,
    )


def _low_bed(study: Study) -> Bed:
    """The bed as it is expected: the workpiece begins well above it."""
    surface = expected_surface(study)
    return Bed(surface, surface + 2 * _CLEAR_DIAMETERS * study.media.typical_radius_m)


def _result(batch: Batch, kind: SceneType, case: Case, bed: Bed | None) -> RunRecord:
    try:
        return batch.result(kind.run_id(case), kind.build(case, bed))
    except RejectedRunError as error:
        raise RejectedRunError(
            f"{error}\n  the speed of LIGGGHTS could not be measured; "
            "to skip the measurement: dragdeck advise --quick"
        ) from None


def last_loop(screen: str) -> float:
    """Steps per second of the engine's last ``run`` command: that of the drag.

    Raises
    ------
    EngineError
        The engine's output has no such line.
    """
    timed = loops(screen)
    if not timed or timed[-1].wall_time_s <= 0:
        raise EngineError("LIGGGHTS printed no duration of its last run")
    return timed[-1].steps_per_s


def short_case(case: Case) -> Case:
    """The case as it is run for its speed: soft, quickly on the path, and soon done."""
    study = case.study
    asked = study.chosen_fidelity()
    soft = Fidelity(
        youngs_modulus_scale=SCALE,
        timestep_fraction=min(_TIMESTEP_FRACTION, asked.timestep_fraction),
        filling_timestep_fraction=asked.filling_timestep_fraction,
        skin_m=asked.skin_m,
        ranks=case.ranks,
    )
    accepted = study.accepted.model_copy(update={"unsafe_timestep": "only its speed counts"})
    changed = study.model_copy(update={"fidelity": soft, "accepted": accepted})
    fidelity = consistent(Case(case.file, {}, changed))
    changed = changed.model_copy(update={"fidelity": fidelity})
    dt = bed_timestep(changed, "timestep_fraction")
    pace = asked.speed_factor * bed_timestep(study, "timestep_fraction") / dt
    update = {"motion": _motion(changed, pace, dt), "outputs": _outputs(study.outputs, pace, dt)}
    return Case(case.file, {}, changed.model_copy(update=update))


def _motion(study: Study, pace: float, timestep_s: float) -> Motion:
    """A plunge, an approach and a drag of few steps.

    Parameters
    ----------
    study : Study
    pace : float
        On the speeds of the drag, so that the workpiece's way in a step stays as it is.
    timestep_s : float
    """
    motion = study.motion
    length = pace * motion.axis_speed_m_s * DRAG_STEPS * timestep_s
    arrival_s = _ARRIVAL_STEPS * timestep_s
    way = math.dist(plunge_point(motion), motion.path.start_point) or motion.immersion_depth_m
    if motion.path.revolution_m is None:  # a circle may go round again, a line may end at a wall
        length = min(length, motion.path_length_m)
    return motion.at(pace, length).model_copy(
        update={
            "plunge_speed_m_s": expected_surface(study) / arrival_s,
            "approach_speed_m_s": way / arrival_s,
        }
    )


def _outputs(outputs: Outputs, pace: float, timestep_s: float) -> Outputs:
    """As many frames a step as asked, or more: no leg is shorter than a frame."""
    least = 1 / (_LONGEST_PERIOD_STEPS * timestep_s)
    names = ("workpiece_force_hz", "workpiece_contacts_hz", "network_hz")
    rates = {name: max(pace * getattr(outputs, name), least) for name in names}
    return outputs.model_copy(update={**rates, "n_checkpoints": 0})
