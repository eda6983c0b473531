"""The decks of the cost variants, and the beds that they start from, each made once.

What no study field can say is said by blocks of templates, in ``variants.yaml``.
"""

import hashlib
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import jinja2

from cost_variants import BASES, BEDS, Variant, bed_case, variant_case
from dragchain.tables.write import write_tables
from dragdeck.cases.bed import bed_rayleigh_time, particle_material
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.outputs import Column, Output
from dragdeck.decks.render import deck_text
from dragdeck.engine.batch import Batch
from dragdeck.physics.contact_mechanics import particle_mass
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import timestep
from dragdeck.scenes.drop_test import DropDeck, drop_scene
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.motion import MovedWorkpiece, ProcessDeck, Stop
from dragdeck.scenes.process import process_scene
from dragdeck.scenes.scene import read_bed
from dragdeck.study.model import Study
from dragdeck.study.workpiece import Workpiece

DAMPED_S, DAMPING_TIME_S, FREE_S = 0.005, 0.001, 0.05
"""How a bed comes to rest with another modulus or other facets: damped for the
first time, speeds falling with the second, then free for the third, s."""

_FRAME_FRACTION = 0.05
"""Fraction of a frame's steps by which a drag may be shorter than asked, to end with a frame."""


# --- templates ------------------------------------------------------------------------------


def with_own_blocks(templates: jinja2.Environment) -> "CostTemplates":
    """Templates to which those of the variants are added as they are made."""
    texts: dict[str, str] = {}
    assert templates.loader is not None
    own = jinja2.ChoiceLoader([templates.loader, jinja2.DictLoader(texts)])
    return CostTemplates(templates.overlay(loader=own), texts)


@dataclass(frozen=True)
class CostTemplates:
    """The templates of a study, and those that extend them for a variant."""

    environment: jinja2.Environment
    _texts: dict[str, str]

    def extended(
        self, scene: AnyScene, name: str, blocks: Mapping[str, str], **values: float
    ) -> AnyScene:
        """The scene with blocks of its template overridden, in which these values are known."""
        if not blocks:
            return scene
        known = [f"{{% set {key} = {value!r} %}}" for key, value in values.items()]
        own = [f"{{% block {key} %}}\n{text}{{% endblock %}}" for key, text in blocks.items()]
        lines = [f'{{% extends "{scene.template}" %}}', *known, *own, ""]
        file = f"costs/{name}.in.j2"
        self._texts[file] = "\n".join(lines)
        return replace(scene, override=file)


# --- what is timed --------------------------------------------------------------------------


@dataclass(frozen=True)
class Settled:
    """A settled bed, and its restart file as a deck sees it."""

    bed: Bed
    source: str


@dataclass(frozen=True)
class TimedDecks:
    """The timed deck of each variant: whole, or cut short after its start.

    Attributes
    ----------
    base : Case
        The standard case.
    templates : CostTemplates
    steps : int
        About so many are timed of a drag and of a filling.
    """

    base: Case
    templates: CostTemplates
    steps: int

    def scene(self, variant: Variant, settled: Settled | None, start: bool) -> AnyScene:
        """The scene of a variant; a drop test starts from no bed."""
        case = variant_case(self.base, variant)
        if settled is None:
            scene, steps, period = _timed_drop(case, start), 0, 0
        elif variant.scene == "filling":
            period = _filling_period(case.study)
            steps = 1 if start else _whole_frames(self.steps, period)
            scene = filling_scene(case)
            deck = replace(scene.deck, source=settled.source, checkpoint_steps=0)
            scene = replace(scene, deck=deck, files={})
        else:
            scene = process_scene(case, settled.bed)
            period = scene.deck.thermo_steps
            steps = 1 if start else _whole_frames(self.steps, period)
            scene = _begun(scene, settled.source, steps)
        scene = _written(scene, variant)
        values = {"start": start, "steps": steps, "frame_steps": period}
        for one in dict.fromkeys((variant.base, variant.name)):
            name, own = f"{one}-start" if start else one, BASES.get(one, variant)
            scene = self.templates.extended(scene, name, own.blocks, **values)
        return scene


def _written(scene: AnyScene, variant: Variant) -> AnyScene:
    """A scene with the outputs and the columns of contacts that a variant writes."""
    outputs = [
        _all_columns(output, variant.contact_columns)
        for output in scene.deck.outputs
        if not variant.outputs or output.name in variant.outputs
    ]
    return replace(scene, deck=replace(scene.deck, outputs=outputs))


def _all_columns(output: Output, width: int) -> Output:
    """An output of contacts with so many columns of its compute; any other as it is."""
    if not width or output.kind != "local":
        return output
    compute = output.columns[0].engine.partition("[")[0]
    columns = tuple(Column(f"column{at}", f"{compute}[{at}]") for at in range(1, width + 1))
    return replace(output, columns=columns)


def _timed_drop(case: Case, start: bool) -> AnyScene:
    """The drop test to its first impact, or its first steps."""
    scene = drop_scene(case)
    deck = scene.deck
    assert isinstance(deck, DropDeck)
    return replace(scene, deck=replace(deck, impact_steps=1)) if start else scene


def _filling_period(study: Study) -> int:
    """Steps of the fill between frames at the rate of the network."""
    dt = timestep(bed_rayleigh_time(study), study.chosen_fidelity().filling_timestep_fraction)
    return max(1, math.floor(1 / (study.outputs.network_hz * dt)))


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


# --- beds -----------------------------------------------------------------------------------


def workpiece_in(case: Case, settled: Settled, templates: CostTemplates) -> AnyScene:
    """A run that brings the workpiece into a settled bed and keeps the particles."""
    scene = process_scene(case, settled.bed)
    assert isinstance(scene.deck, ProcessDeck)
    workpieces = [replace(one, legs=one.legs[:-1]) for one in scene.deck.workpieces]
    stops = [Stop(workpieces[0].legs[-1].end_step)]
    deck = replace(
        scene.deck, source=settled.source, workpieces=workpieces, stops=stops, outputs=()
    )
    phases = scene.case.model_copy(update={"phases": scene.case.phases[:-1]})
    name = "workpiece_in"
    return templates.extended(replace(scene, deck=deck, case=phases), name, BEDS[name])


def at_rest(case: Case, settled: Settled, templates: CostTemplates) -> AnyScene:
    """A run that brings a bed with the workpiece in it to rest with a case's modulus and facets."""
    scene, study = process_scene(case, settled.bed), case.study
    begun, dt = _begun(scene, settled.source, 0), scene.deck.timestep_s
    no_phases = scene.case.model_copy(update={"phases": ()})
    begun = replace(begun, deck=replace(begun.deck, outputs=()), case=no_phases)
    return templates.extended(
        begun,
        "at_rest",
        {**BEDS["workpiece_in"], **BEDS["at_rest"]},
        damping_kg_s=particle_mass(particle_material(study), study.media.typical_radius_m)
        / DAMPING_TIME_S,
        damped_steps=math.ceil(DAMPED_S / dt),
        free_steps=math.ceil(FREE_S / dt),
    )


@dataclass(frozen=True)
class Beds:
    """Beds that timed decks start from.

    Attributes
    ----------
    batch : Batch
        Runs that fill a bed, bring the workpiece in or let a bed come to rest.
    templates : CostTemplates
        Those of the batch.
    """

    batch: Batch
    templates: CostTemplates
    _filled: dict[str, Settled] = field(default_factory=dict, init=False)

    def of(self, base: Case, variant: Variant) -> Settled:
        """The bed of a variant, made if it is not there yet.

        Raises
        ------
        InputError, EngineError, RejectedRunError
            As `Batch.result`.
        DumpError, TableError
            Its tables could not be made.
        """
        owner = bed_case(base, variant)
        settled = self._settled(owner)
        if variant.scene == "filling":
            return settled
        begun = self._kept("workpiece-in", workpiece_in(owner, settled, self.templates))
        inside, case = Settled(settled.bed, begun), variant_case(base, variant)
        if _walls(case) == _walls(owner):
            return inside
        return Settled(settled.bed, self._kept("at-rest", at_rest(case, inside, self.templates)))

    def _settled(self, owner: Case) -> Settled:
        run = FILLING.run_id(owner)
        if run not in self._filled:
            self.batch.result(run, FILLING.build(owner, None))
            folder = self.batch.folder / run
            write_tables(folder)
            bed = read_bed(folder / "tables" / "packing.json")
            self._filled[run] = Settled(bed, self._seen(folder / "packing.restart"))
        return self._filled[run]

    def _kept(self, name: str, scene: AnyScene) -> str:
        run = f"{name}-{text_hash(deck_text(scene, self.batch.templates))}"
        self.batch.result(run, scene)
        return self._seen(self.batch.folder / run / "bed.restart")

    def _seen(self, file: Path) -> str:
        """Path of a file as a deck sees it, from a folder two below that of the costs."""
        return os.path.relpath(file.resolve(), self.batch.folder.resolve().parent / "any" / "any")


def _walls(case: Case) -> tuple[float, float | None, Workpiece]:
    """What a bed with a workpiece in it has to come to rest with: stiffness and facets."""
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    return scale, study.bowl.facet_size_m, study.workpiece


def text_hash(text: str) -> str:
    """The start of a text's hash."""
    return hashlib.sha256(text.encode()).hexdigest()[:8]
