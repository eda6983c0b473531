"""The input scripts of the cost variants: what is timed, and the beds that it starts from.

What no study field can say is said by the templates in ``templates/costs/`` and by the
decks here.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from cost_variants import Change
from dragdeck.cases.bed import bed_rayleigh_time, particle_material
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.outputs import Column
from dragdeck.physics.contact_mechanics import particle_mass
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import timestep
from dragdeck.scenes.drop_test import DropDeck, drop_scene
from dragdeck.scenes.filling import FillingDeck, filling_scene
from dragdeck.scenes.legs import Stop
from dragdeck.scenes.moved_workpiece import MovedWorkpiece, ProcessDeck
from dragdeck.scenes.process import process_scene
from dragdeck.study.model import Study

DAMPED_S, DAMPING_TIME_S, FREE_S = 0.005, 0.001, 0.05
"""How a bed comes to rest with another modulus or other facets: damped for the
first time, speeds falling with the second, then free for the third, s."""

_FRAME_FRACTION = 0.05
"""Fraction of a frame's steps by which a drag may be shorter than asked, to end with a frame."""

CONTACT_COLUMNS = (
    "pos vel id force force_normal force_tangential torque torque_normal torque_tangential "
    "history contactArea delta contactPoint"
)
"""All that LIGGGHTS's contact computes give in these scenes."""

CONTACT_WIDTH = 41
"""Numbers of a contact with `CONTACT_COLUMNS`."""

_CONTACT_COMPUTES = {"contacts": "particle_contacts", "workpiece_contacts": "workpiece_contacts"}
"""The compute that each output of contacts writes."""


@dataclass(frozen=True, kw_only=True)
class _ColumnsDeck(ProcessDeck):
    """A process that writes all columns of its contacts."""

    contact_columns: str


@dataclass(frozen=True, kw_only=True)
class _RestDeck(ProcessDeck):
    """A bed that comes to rest: damping of a particle, kg/s, and steps with and without it."""

    damping_kg_s: float
    damped_steps: int
    free_steps: int


@dataclass(frozen=True, kw_only=True)
class _TimedDropDeck(DropDeck):
    """A drop test whose first flight may be cut short."""

    flight_steps: int | None


@dataclass(frozen=True, kw_only=True)
class _TimedFillingDeck(FillingDeck):
    """A settled bed that goes on: steps, and steps between frames of contacts."""

    timed_steps: int
    frame_steps: int


def changed(scene: AnyScene, change: Change) -> AnyScene:
    """The scene of a variant with what no study field can say."""
    if change == "none":
        return scene
    if change in _IN_DECK:
        return _IN_DECK[change](scene)
    return replace(scene, override=f"costs/{change}.in.j2")


def _early_outputs(scene: AnyScene) -> AnyScene:
    """A process that writes only what it writes before the drag."""
    early = [
        output for output in scene.deck.outputs if output.name in ("thermo", "workpiece_force")
    ]
    return replace(scene, deck=replace(scene.deck, outputs=early))


def _restart_points(scene: AnyScene) -> AnyScene:
    """A process with a restart point at every frame of the network."""
    return replace(scene, deck=replace(scene.deck, checkpoint_steps=scene.deck.thermo_steps))


def _with_all_columns(scene: AnyScene) -> AnyScene:
    """A process that writes every column of a contact instead of those that are read."""
    wide = [
        replace(output, columns=_all_columns(_CONTACT_COMPUTES[output.name]))
        if output.name in _CONTACT_COMPUTES
        else output
        for output in scene.deck.outputs
    ]
    own = vars(scene.deck) | {"outputs": wide}
    deck = _ColumnsDeck(**own, contact_columns=CONTACT_COLUMNS)
    return replace(scene, deck=deck, override="costs/contact_columns.in.j2")


def _all_columns(compute: str) -> tuple[Column, ...]:
    return tuple(Column(f"column{at}", f"c_{compute}[{at}]") for at in range(1, CONTACT_WIDTH + 1))


_IN_DECK: Mapping[Change, Callable[[AnyScene], AnyScene]] = {
    "early_outputs": _early_outputs,
    "restart_points": _restart_points,
    "all_columns": _with_all_columns,
}
"""Changes of the deck's values; the others are templates of that name."""


def timed_drop(case: Case, start: bool) -> AnyScene:
    """The drop test to its first impact, or its first steps."""
    scene = drop_scene(case)
    deck = _TimedDropDeck(**vars(scene.deck), flight_steps=1 if start else None)
    deck = replace(deck, impact_steps=1) if start else deck
    return replace(scene, deck=deck, override="costs/drop_test.in.j2")


def timed_filling(case: Case, steps: int, source: str, start: bool) -> AnyScene:
    """The fill once its bed is at rest, for about so many steps, or its first step."""
    scene, period = filling_scene(case), _filling_period(case.study)
    own = vars(scene.deck) | {"source": source, "checkpoint_steps": 0}
    timed = 1 if start else _whole_frames(steps, period)
    deck = _TimedFillingDeck(**own, timed_steps=timed, frame_steps=period)
    return replace(scene, deck=deck, files={}, override="costs/filling.in.j2")


def _filling_period(study: Study) -> int:
    """Steps of the fill between frames at the rate of the network."""
    dt = timestep(bed_rayleigh_time(study), study.chosen_fidelity().filling_timestep_fraction)
    return max(1, math.floor(1 / (study.outputs.network_hz * dt)))


def timed_drag(case: Case, steps: int, bed: Bed, source: str, start: bool) -> AnyScene:
    """The drag for about so many steps, or its first step."""
    scene = process_scene(case, bed)
    return _begun(scene, source, 1 if start else _whole_frames(steps, scene.deck.thermo_steps))


def _whole_frames(steps: int, period: int) -> int:
    """About that many steps, to the end of a frame."""
    return period * max(1, math.ceil(steps / period - _FRAME_FRACTION))


def _begun(scene: AnyScene, source: str, steps: int) -> AnyScene:
    """A process that begins where its drag does, with a bed that has the workpiece in it."""
    deck = scene.deck
    assert isinstance(deck, ProcessDeck)
    workpieces = [_in_its_drag(workpiece, steps) for workpiece in deck.workpieces]
    stops = [Stop(steps, writes=True)]
    deck = replace(deck, source=source, workpieces=workpieces, stops=stops)
    return replace(scene, deck=deck)


def _in_its_drag(workpiece: MovedWorkpiece, steps: int) -> MovedWorkpiece:
    x, y, z = workpiece.start_m
    for leg in workpiece.legs[:-1]:
        u, v, w = leg.velocity_m_s
        x, y, z = (place + leg.duration_s * speed for place, speed in ((x, u), (y, v), (z, w)))
    last, drive = workpiece.legs[-1], workpiece.driven.drive
    way = replace(workpiece.driven, drive=replace(drive, start=0, end=drive.steps))
    drag = replace(
        last,
        start_step=0,
        end_step=steps,
        duration_s=last.duration_s * steps / last.steps,
        motion=way.motion.path.on_engine(way.drive).ending(workpiece.ending),
    )
    return replace(workpiece, start_m=(x, y, z), legs=(drag,), driven=way)


def workpiece_in(case: Case, bed: Bed, source: str) -> AnyScene:
    """A run that brings the workpiece into a settled bed and keeps the particles."""
    scene = process_scene(case, bed)
    assert isinstance(scene.deck, ProcessDeck)
    workpieces = [replace(one, legs=one.legs[:-1]) for one in scene.deck.workpieces]
    stops = [Stop(workpieces[0].legs[-1].end_step)]
    deck = replace(scene.deck, source=source, workpieces=workpieces, stops=stops, outputs=())
    phases = scene.case.model_copy(update={"phases": scene.case.phases[:-1]})
    return replace(scene, deck=deck, case=phases, override="costs/keep_particles.in.j2")


def at_rest(case: Case, bed: Bed, source: str) -> AnyScene:
    """A run that brings a bed with the workpiece in it to rest with a case's modulus and facets."""
    scene, study = process_scene(case, bed), case.study
    begun, dt = _begun(scene, source, 0).deck, scene.deck.timestep_s
    mass = particle_mass(particle_material(study), study.media.radius_mean_m)
    deck = _RestDeck(
        **vars(begun) | {"outputs": ()},
        damping_kg_s=mass / DAMPING_TIME_S,
        damped_steps=math.ceil(DAMPED_S / dt),
        free_steps=math.ceil(FREE_S / dt),
    )
    no_phases = scene.case.model_copy(update={"phases": ()})
    return replace(scene, deck=deck, case=no_phases, override="costs/bed_at_rest.in.j2")
