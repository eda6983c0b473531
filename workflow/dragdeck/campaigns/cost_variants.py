"""What each thing that a deck leaves out would cost: the decks that are timed, and the statistics.

A variant is the standard deck of a study with one thing changed. It is timed
side by side with the deck it is compared with; `costs_run` does the timing.
"""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import jinja2
import numpy as np
from scipy import stats
from trimesh import Trimesh

from dragdeck.cases.bed import bed_rayleigh_time, particle_material
from dragdeck.cases.case import Case
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.render import deck_text, number
from dragdeck.errors import InputError
from dragdeck.outlook.measured import FidelityParameters
from dragdeck.physics.contact_mechanics import particle_mass
from dragdeck.physics.engine_limits import ENGINE_SOFTEST_PA
from dragdeck.physics.rounding import timestep
from dragdeck.scenes.drop_test import drop_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import ProcessDeck, process_scene
from dragdeck.scenes.scene import Bed
from dragdeck.study.model import CylinderShape, Study
from dragdeck.sweep.cases import settle_case

Unit = Literal["per_step", "per_second"]
Settings = Mapping[str, Any]

DAMPED_S, DAMPING_TIME_S, FREE_S = 0.005, 0.001, 0.05
"""How a bed comes to rest with another modulus or other facets: damped for the
first time, speeds falling with the second, then free for the third, s."""

FRAME_FRACTION = 0.05
"""Share of a frame's steps by which a drag may be shorter than asked, to end with a frame."""

LONGEST_STEP = 0.64
"""Share of the Rayleigh time at which full stiffness is timed against the plain
deck: the largest that docs/stability.md recommends for a slow drag."""

CONTACT_COLUMNS = (
    "pos vel id force force_normal force_tangential torque torque_normal torque_tangential "
    "history contactArea delta contactPoint"
)
"""All that the engine's contact computes give in these scenes."""

CONTACT_WIDTH = 41
"""Numbers of a contact with `CONTACT_COLUMNS`."""

NEEDED_COLUMNS = (
    "c_particle_contacts[1] c_particle_contacts[2] c_particle_contacts[4] c_particle_contacts[5] "
    + ("c_particle_contacts[6] c_particle_contacts[7]")
)


@dataclass(frozen=True)
class Edit:
    """A change of a deck's text that no study field makes.

    Attributes
    ----------
    pattern : str
        Regular expression over lines; it must be found exactly once.
    text : str
        What takes its place; may refer to groups.
    """

    pattern: str
    text: str

    def apply(self, deck: str) -> str:
        """The changed deck.

        Raises
        ------
        InputError
            The pattern is not there, or more than once.
        """
        changed, count = re.subn(self.pattern, self.text, deck, flags=re.MULTILINE)
        if count != 1:
            raise InputError(
                "a cost cannot be measured: the deck has not the text to change",
                field=self.pattern,
                value=f"found {count} times",
                limit="found once",
                remedy="bring the template and the edits in costs.py together",
            )
        return changed


@dataclass(frozen=True)
class Variant:
    """A deck to be timed.

    Attributes
    ----------
    name : str
    what : str
        What is different, in words.
    fields : mapping
        Dotted study field: value.
    edits : tuple of Edit
        What no field can say.
    base : str
        Name of the base it is compared with, one of `BASES`.
    unit : str
        What a cost counts: time steps where the step differs, or simulated seconds.
    """

    name: str
    what: str
    fields: Settings = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()
    base: str = "standard"
    unit: Unit = "per_second"

    @property
    def scene(self) -> str:
        """AnyScene of its deck."""
        return SCENE_OF_BASE[self.base]

    @property
    def parameter(self) -> str | None:
        """The fidelity parameter that is all its change, if it is one."""
        changed = [name.removeprefix("fidelity.") for name in self.fields]
        alone = len(changed) == 1 and not self.edits
        return changed[0] if alone and changed[0] in FidelityParameters.model_fields else None

    @property
    def level(self) -> float | None:
        """The value of that parameter."""
        return float(self.fields[f"fidelity.{self.parameter}"]) if self.parameter else None


SCENE_OF_BASE: Mapping[str, str] = {
    "standard": "process",
    "before_drag": "process",
    "drop_test": "drop_test",
    "filling": "filling",
}

NO_FRAMES = Edit(
    r"^variable workpiece_push (?:.*\n)*?(?=^if \"\$\{now\} < )", "# no frames before the drag\n"
)

BASES: Mapping[str, Variant] = {
    base.name: base
    for base in (
        Variant("standard", "the drag as the standard deck has it, without restart points"),
        Variant(
            "before_drag", "the drag with the outputs of plunge and approach", edits=(NO_FRAMES,)
        ),
        Variant("drop_test", "the drop test to its first impact", base="drop_test"),
        Variant("filling", "the fill once its bed is at rest", base="filling"),
    )
}
"""What variants are compared with, by name."""


def standard_case(case: Case) -> Case:
    """The case whose decks are the standard: its modulus and step, one rank, speed as it is.

    It has no restart points, because a short arc would have one or none by
    chance, and one impact in its drop.
    """
    data = copy.deepcopy(case.study.model_dump(mode="json", exclude_unset=True))
    data["fidelity"] = case.study.chosen_fidelity().model_dump(mode="json", exclude_unset=True)
    values = {
        "fidelity.ranks": 1,
        "fidelity.speed_factor": 1.0,
        "outputs.n_checkpoints": 0,
        "drop_test.impacts": 1,
    }
    return settle_case(case.file, data, values, {})


def variant_case(base: Case, variant: Variant) -> Case:
    """The standard case with a variant's fields."""
    data = base.study.model_dump(mode="json", exclude_unset=True)
    return settle_case(base.file, data, variant.fields, {})


def variants(base: Case) -> list[Variant]:
    """All variants that the study of a standard case allows."""
    study = base.study
    found = [
        *_bowls(),
        *_workpieces(study),
        *_columns(),
        *_rates(base),
        *_neighbours(study),
        *_steps(study),
        *_plain(study),
        *_drops(),
        *_packings(study),
    ]
    return [variant for variant in found if not _is_standard(base, variant)]


def _is_standard(base: Case, variant: Variant) -> bool:
    """Whether the fields only repeat what the standard case has."""
    if variant.edits or not variant.fields:
        return False
    return variant_case(base, variant).study == base.study


def _bowls() -> list[Variant]:
    return [
        Variant("bowl_facets", "the bowl as facets of 5 mm", {"bowl.facet_size_m": 0.005}),
        Variant("bowl_fine", "the bowl as facets of 2.5 mm", {"bowl.facet_size_m": 0.0025}),
    ]


def _workpieces(study: Study) -> list[Variant]:
    shape = study.workpiece.shape
    if not isinstance(shape, CylinderShape):
        return []
    width, length = "workpiece.shape.facet_size_m", "workpiece.shape.facet_length_m"
    wide = shape.facet_size_m
    return [
        Variant(
            "workpiece_short_facets",
            f"facets of the workpiece as short as they are wide, {1000 * wide:g} mm",
            {length: wide},
        ),
        Variant(
            "workpiece_narrow_facets",
            f"facets of the workpiece {500 * wide:g} mm wide",
            {width: wide / 2},
        ),
        Variant(
            "workpiece_wide_facets",
            f"facets of the workpiece {2000 * wide:g} mm wide",
            {width: 2 * wide},
        ),
    ]


def _all_columns(compute: str, style: str, output: str) -> tuple[Edit, ...]:
    """Every column of a contact compute instead of those that are read."""
    columns = " ".join(f"c_{compute}[{i + 1}]" for i in range(CONTACT_WIDTH))
    form = " ".join(["%.9g"] * CONTACT_WIDTH)
    return (
        Edit(rf"^compute {compute} .*$", f"compute {compute} all {style} {CONTACT_COLUMNS}"),
        Edit(rf"^(dump write_{output} all local \d+ \S+) .*$", rf"\1 {columns}"),
        Edit(
            rf"^dump_modify write_{output} format .*$",
            f'dump_modify write_{output} format "{form}"',
        ),
    )


ALL_COLUMNS = (
    *_all_columns("particle_contacts", "pair/gran/local", "contacts"),
    *_all_columns("workpiece_contacts", "wall/gran/local", "workpiece_contacts"),
)


def _columns() -> list[Variant]:
    what = "all contact columns: positions, velocities, torques, history, area"
    return [Variant("contact_columns", what, edits=ALL_COLUMNS)]


def _rates(base: Case) -> list[Variant]:
    rates = base.study.outputs
    scene = process_scene(base)
    assert isinstance(scene.deck, ProcessDeck)
    often = scene.deck.thermo_steps
    whole = scene.deck.legs[-1].end_step * scene.deck.timestep_s
    return [
        Variant(
            "network_rate",
            f"network and particles at the rate of the workpiece's contacts, "
            f"{rates.workpiece_contacts_hz:g} Hz",
            {"outputs.network_hz": rates.workpiece_contacts_hz},
        ),
        Variant(
            "workpiece_contacts_rate",
            f"contacts on the workpiece at the rate of its force, {rates.workpiece_force_hz:g} Hz",
            {"outputs.workpiece_contacts_hz": rates.workpiece_force_hz},
        ),
        Variant(
            "network_before_drag",
            f"network, particles and contacts on the workpiece from the plunge on, "
            f"{rates.network_hz:g} Hz"
            f" and {rates.workpiece_contacts_hz:g} Hz",
            base="before_drag",
        ),
        Variant(
            "restart_points",
            f"a restart point every {often * scene.deck.timestep_s:.2g} s; 50 over the run would"
            f" be one every {whole / 51:.2g} s",
            edits=(Edit(r"^(thermo_modify .*)$", rf"\1\nrestart {often} checkpoint.*.restart"),),
        ),
    ]


def _neighbours(study: Study) -> list[Variant]:
    radius = study.media.radius_mean_m
    fractions = [
        Variant(
            f"skin_{fraction:g}",
            f"a neighbour skin of {fraction:g} of the mean radius",
            {"fidelity.skin_m": float(f"{fraction * radius:.3g}")},
        )
        for fraction in (0.02, 0.05, 0.2, 0.3)
    ]
    return [
        *fractions,
        Variant("skin_1mm", "a neighbour skin of 1 mm", {"fidelity.skin_m": 0.001}),
        Variant("two_ranks", "two ranks instead of one", {"fidelity.ranks": 2}),
    ]


def _steps(study: Study) -> list[Variant]:
    """What changes the number of steps or of particles, by the cost of a step."""
    count, depth = 3 * study.media.count // 4, 0.75 * study.motion.immersion_depth_m
    moduli = [
        Variant(
            f"modulus_{scale:g}",
            f"Young's moduli times {scale:g}, at the same share of Rayleigh",
            {"fidelity.youngs_modulus_scale": scale},
            unit="per_step",
        )
        for scale in (1.0, 0.1, 0.01, 1e-3, 1e-4)
        if scale * min(m.youngs_modulus_pa for m in study.materials.values()) >= ENGINE_SOFTEST_PA
    ]
    steps = [
        Variant(
            f"step_{fraction:g}",
            f"a time step of {100 * fraction:g} % of Rayleigh",
            {"fidelity.timestep_fraction": fraction},
            unit="per_step",
        )
        for fraction in (0.2, 0.8)
    ]
    return [
        *moduli,
        *steps,
        Variant(
            "speed_5",
            "the workpiece five times as fast",
            {"fidelity.speed_factor": 5.0},
            unit="per_step",
        ),
        Variant(
            "fewer_particles",
            f"three quarters of the particles, {count}, and of the workpiece's depth",
            {"media.count": count, "motion.immersion_depth_m": depth},
            unit="per_step",
        ),
    ]


def _plain(study: Study) -> list[Variant]:
    fields = {
        "bowl.facet_size_m": 0.005,
        "fidelity.timestep_fraction": 0.2,
        "fidelity.skin_m": 0.001,
        "fidelity.ranks": 1,
    }
    what = "the plain deck: bowl as facets of 5 mm, 20 % of Rayleigh, 1 mm skin, one rank"
    found = [
        Variant("plain", what, fields),
        Variant("plain_columns", f"{what}, all contact columns", fields, ALL_COLUMNS),
    ]
    shape = study.workpiece.shape
    if isinstance(shape, CylinderShape):
        wide = shape.facet_size_m
        even = {"workpiece.shape.facet_length_m": wide}
        text = f"{what}, facets of the workpiece as short as they are wide, {1000 * wide:g} mm"
        found.append(Variant("plain_even_facets", text, {**fields, **even}))
    stiff = {"fidelity.youngs_modulus_scale": 1.0}
    longest = {**stiff, "fidelity.timestep_fraction": LONGEST_STEP}
    return [
        *found,
        Variant("plain_full", f"{what}, full stiffness", {**fields, **stiff}),
        Variant(
            "full", f"full stiffness at {100 * LONGEST_STEP:g} % of Rayleigh, nothing else", longest
        ),
    ]


def _drops() -> list[Variant]:
    contacts = (
        Edit(
            r"^(compute plate_force .*)$",
            r"\1\ncompute particle_contacts all pair/gran/local id force delta",
        ),
        Edit(
            r"^(fix write_impacts .*)$",
            r"\1\ndump write_contacts all local 1 contacts.${part}.dump "
            rf"{NEEDED_COLUMNS}\ndump_modify write_contacts append yes",
        ),
        Edit(r"^(unfix write_impacts)$", r"\1\nundump write_contacts"),
    )
    always = Edit(
        r"^run 0$((?:.*\n)*?)^(variable impacts_1 (?:.*\n)*?^fix write_impacts .*\n)"
        r"((?:.*\n)*?)^unfix write_impacts\n",
        r"\2run 0\1\3",
    )
    return [
        Variant(
            "drop_contacts",
            "contacts between particles, of which there are none, at every written step",
            edits=contacts,
            base="drop_test",
        ),
        Variant(
            "drop_every_step",
            "every step written, not only those near an impact",
            edits=(always,),
            base="drop_test",
        ),
    ]


def _packings(study: Study) -> list[Variant]:
    period = _filling_period(study)
    write = (
        r"\1\ncompute particle_contacts all pair/gran/local id force delta\n"
        rf"dump write_contacts all local {period} contacts.${{part}}.dump {NEEDED_COLUMNS}"
    )
    return [
        Variant(
            "filling_contacts",
            f"contacts between particles during the fill, {study.outputs.network_hz:g} Hz, "
            "with the bed at rest, which has the most of them",
            edits=(Edit(r"^(thermo_modify .*)$", write),),
            base="filling",
        )
    ]


def _filling_period(study: Study) -> int:
    """Steps of the fill between frames at the rate of the network."""
    dt = timestep(bed_rayleigh_time(study), study.chosen_fidelity().filling_timestep_fraction)
    return max(1, math.floor(1 / (study.outputs.network_hz * dt)))


def _whole_frames(steps: int, period: int) -> int:
    """About that many steps, to the end of a frame."""
    return period * max(1, math.ceil(steps / period - FRAME_FRACTION))


@dataclass(frozen=True)
class TimedDeck:
    """A deck to be timed, and the same deck cut short after its start.

    Attributes
    ----------
    whole, start : str
        Deck texts.
    meshes : mapping of str to Trimesh
    files : mapping of str to str
        Other input files.
    ranks : int
    timestep_s : float
    """

    whole: str
    start: str
    meshes: Mapping[str, Trimesh]
    files: Mapping[str, str]
    ranks: int
    timestep_s: float


def timed_deck(
    base: Case,
    variant: Variant,
    templates: jinja2.Environment,
    steps: int,
    bed: Bed | None = None,
    source: str = "",
) -> TimedDeck:
    """The decks of a variant.

    Parameters
    ----------
    base : Case
        The standard case.
    variant : Variant
    templates : jinja2.Environment
    steps : int
        How many to drag, about; a drag ends with a frame of the network.
    bed : Bed, optional
        The settled bed of a process.
    source : str
        The restart file that a process or a fill starts from, as seen from the run's folder.

    Raises
    ------
    InputError
        A field or an edit does not fit.
    """
    case = variant_case(base, variant)
    scene, whole, start = _TIMED[variant.scene](case, templates, steps, bed, source)
    for edit in variant.edits:
        whole, start = edit.apply(whole), edit.apply(start)
    ranks = case.ranks if variant.scene == "process" else 1
    files = scene.files if variant.scene == "drop_test" else {}
    return TimedDeck(whole, start, scene.meshes, files, ranks, scene.deck.timestep_s)


_Timed = tuple[AnyScene, str, str]


def _timed_process(
    case: Case, templates: jinja2.Environment, steps: int, bed: Bed | None, source: str
) -> _Timed:
    scene = process_scene(case, bed)
    whole = _whole_frames(steps, scene.deck.thermo_steps)
    text, start = (deck_text(drag_only(scene, source, end), templates) for end in (whole, 1))
    return scene, text, start


def _timed_drop(
    case: Case, templates: jinja2.Environment, steps: int, bed: Bed | None, source: str
) -> _Timed:
    scene = drop_scene(case)
    whole = deck_text(scene, templates)
    start = Edit(r"^next impact\njump SELF next_impact\n", "").apply(whole)
    start = Edit(r"^variable flight equal .*$", "variable flight equal 1").apply(start)
    return scene, whole, Edit(r"^run [1-9]\d*$", "run 1").apply(start)


def _timed_filling(
    case: Case, templates: jinja2.Environment, steps: int, bed: Bed | None, source: str
) -> _Timed:
    scene = filling_scene(case)
    deck = replace(scene.deck, source=source, checkpoint_steps=0)
    text = Edit(r"^if .* else \"read_restart \$\{from\}\"$", "read_restart ${from}").apply(
        deck_text(replace(scene, deck=deck), templates)
    )
    rest = r'^# Rest: (?:.*\n)*?(?=^print "DRAGDECK END")'
    whole = _whole_frames(steps, _filling_period(case.study))
    run, start = (Edit(rest, f"reset_timestep 0\nrun {end}\n").apply(text) for end in (whole, 1))
    return scene, run, start


_TIMED = {"process": _timed_process, "drop_test": _timed_drop, "filling": _timed_filling}


def drag_only(scene: AnyScene, source: str, steps: int) -> AnyScene:
    """A process that begins where its drag does, with a bed that has the workpiece in it.

    Parameters
    ----------
    scene : AnyScene
    source : str
        Restart file of that bed.
    steps : int
        0: the workpiece stands still and nothing is run.
    """
    deck = scene.deck
    assert isinstance(deck, ProcessDeck)
    x, y, z = deck.workpiece_start_m
    for leg in deck.legs[:-1]:
        u, v, w = leg.velocity_m_s
        x, y, z = (place + leg.duration_s * speed for place, speed in ((x, u), (y, v), (z, w)))
    drag = replace(deck.legs[-1], start_step=0, end_step=steps)
    begun = replace(deck, source=source, workpiece_start_m=(x, y, z), legs=(drag,))
    return replace(scene, deck=begun if steps else replace(begun, legs=(), outputs=()))


def plunge_only(scene: AnyScene) -> AnyScene:
    """A process that ends where its drag begins and writes nothing."""
    deck = scene.deck
    assert isinstance(deck, ProcessDeck)
    return replace(scene, deck=replace(deck, legs=deck.legs[:-1], outputs=()))


def workpiece_in_deck(case: Case, bed: Bed, source: str, templates: jinja2.Environment) -> str:
    """Deck that brings the workpiece into a settled bed and keeps the particles."""
    scene = plunge_only(process_scene(case, bed))
    deck = replace(scene.deck, source=source)
    return _keeping_particles(deck_text(replace(scene, deck=deck), templates), scene, "")


def at_rest_deck(case: Case, bed: Bed, source: str, templates: jinja2.Environment) -> str:
    """Deck that brings a bed with the workpiece in it to rest with a case's modulus and facets.

    The particles are damped first, so that none is thrown when contacts become
    stiffer or a wall comes to stand a little elsewhere.
    """
    scene = drag_only(process_scene(case, bed), source, 0)
    dt, study = scene.deck.timestep_s, case.study
    drag = particle_mass(particle_material(study), study.media.radius_mean_m) / DAMPING_TIME_S
    rest = (
        f"fix damping all viscous {number(drag)}\nrun {math.ceil(DAMPED_S / dt)}\n"
        f"unfix damping\nrun {math.ceil(FREE_S / dt)}\n"
    )
    return _keeping_particles(deck_text(scene, templates), scene, rest)


def _keeping_particles(text: str, scene: AnyScene, rest: str) -> str:
    """Add the end of a deck that keeps the particles alone.

    No workpiece, no mesh, no contact on them.
    """
    deck = scene.deck
    assert isinstance(deck, ProcessDeck)
    meshes = "unfix workpiece\nunfix bowl\n" if deck.bowl_facets else "unfix workpiece\n"
    tail = (
        f"{rest}uncompute workpiece_contacts\nuncompute particle_contacts\nunfix "
        f"workpiece_wall\n{meshes}"
        'write_restart bed.restart\nprint "DRAGDECK END"'
    )
    return Edit(r'^print "DRAGDECK END"$', tail).apply(text)


@dataclass(frozen=True)
class Ratio:
    """A ratio and its 95 % interval; None where one round says nothing of it."""

    ratio: float
    ci95_low: float | None
    ci95_high: float | None


def geometric(ratios: Sequence[float]) -> Ratio:
    """Geometric mean of ratios, with the 95 % interval of Student's t on their logarithms.

    Parameters
    ----------
    ratios : sequence of float
        One a round.
    """
    logs = np.log(np.asarray(ratios, dtype=float))
    mean = float(logs.mean())
    if len(logs) < 2:
        return Ratio(math.exp(mean), None, None)
    error = float(logs.std(ddof=1)) / math.sqrt(len(logs))
    half = float(stats.t.ppf(0.975, len(logs) - 1)) * error
    return Ratio(math.exp(mean), math.exp(mean - half), math.exp(mean + half))
