"""What each thing that a deck leaves out would cost: the variants that are timed.

A variant is the standard deck of a study with one thing changed. It is timed
side by side with the deck it is compared with; `cost_timing` does the timing.
"""

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from dragdeck.cases.case import Case
from dragdeck.physics.engine_limits import ENGINE_SOFTEST_PA
from dragdeck.scenes.moved_workpiece import ProcessDeck
from dragdeck.scenes.process import process_scene
from dragdeck.study.model import Study
from dragdeck.study.paths.circle import CirclePath
from dragdeck.study.workpiece import CylinderShape
from dragdeck.sweep.cases import settle_case

SceneName = Literal["process", "drop_test", "filling"]
Unit = Literal["per_step", "per_second"]
Settings = Mapping[str, Any]
Change = Literal[
    "none",
    "early_outputs",
    "restart_points",
    "all_columns",
    "drop_contacts",
    "drop_every_step",
    "filling_contacts",
]
"""What no study field can say; `cost_decks` makes the change."""

_PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")

_LONGEST_STEP = 0.64
"""Fraction of the Rayleigh time at which full stiffness is timed against the plain
deck: the largest that docs/evidence/stability.md recommends for a slow drag."""


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
    change : str
        What no field can say.
    base : str
        Name of the base it is compared with, one of `BASES`.
    unit : str
        What a cost counts: time steps where the step differs, or simulated seconds.
    """

    name: str
    what: str
    fields: Settings = field(default_factory=dict)
    change: Change = "none"
    base: str = "standard"
    unit: Unit = "per_second"

    @property
    def scene(self) -> SceneName:
        """Scene of its deck."""
        return _SCENE_OF_BASE[self.base]

    @property
    def own_bed(self) -> bool:
        """Whether its bed has other particles, or a workpiece in another place or pose."""
        others = ("media.", "workpieces", "motion.tilt_deg", "motion.path")
        return any(name.startswith(others) for name in self.fields)

    @property
    def parameter(self) -> str | None:
        """The fidelity parameter that is all its change, if it is one."""
        changed = [name.removeprefix("fidelity.") for name in self.fields]
        alone = len(changed) == 1 and self.change == "none"
        return changed[0] if alone and changed[0] in _PARAMETERS else None

    @property
    def level(self) -> float | None:
        """The value of that parameter."""
        return float(self.fields[f"fidelity.{self.parameter}"]) if self.parameter else None


_SCENE_OF_BASE: Mapping[str, SceneName] = {
    "standard": "process",
    "before_drag": "process",
    "drop_test": "drop_test",
    "filling": "filling",
}

BASES: Mapping[str, Variant] = {
    base.name: base
    for base in (
        Variant("standard", "the drag as the standard deck has it, without restart points"),
        Variant(
            "before_drag",
            "the drag with the outputs of plunge and approach",
            change="early_outputs",
        ),
        Variant("drop_test", "the drop test to its first impact", base="drop_test"),
        Variant("filling", "the fill once its bed is at rest", base="filling"),
    )
}
"""What variants are compared with, by name."""


def standard_case(case: Case) -> Case:
    """The case whose decks are the standard: its modulus and step, one rank, speed as it is.

    It has no restart points, because a short arc would have one or none by
    chance, and one impact in its drop. It neither continues a softer run nor has windows.
    """
    data = copy.deepcopy(case.study.model_dump(mode="json", exclude_unset=True))
    data["fidelity"] = case.study.chosen_fidelity().model_dump(
        mode="json", exclude_unset=True, exclude={"soft_start", "windows"}
    )
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


def bed_case(base: Case, variant: Variant) -> Case:
    """The case whose bed, with its workpiece in it, a variant is dragged through."""
    return variant_case(base, variant) if variant.own_bed else base


def variants(base: Case) -> list[Variant]:
    """All variants that the study of a standard case allows."""
    families = (
        _geometry(base.study),
        _motions(base.study),
        _outputs(base),
        _neighbours(base.study),
        _steps(base.study),
        _plain(base.study),
        _other_scenes(base.study),
    )
    every = [variant for family in families for variant in family]
    return [variant for variant in every if not _is_standard(base, variant)]


def _is_standard(base: Case, variant: Variant) -> bool:
    """Whether the fields only repeat what the standard case has."""
    if variant.change != "none" or not variant.fields:
        return False
    return variant_case(base, variant).study == base.study


def _geometry(study: Study) -> Iterator[Variant]:
    bowl, shape = "bowl.facet_size_m", study.workpiece.shape
    yield Variant("bowl_facets", "the bowl as facets of 5 mm", {bowl: 0.005})
    yield Variant("bowl_fine", "the bowl as facets of 2.5 mm", {bowl: 0.0025})
    if not isinstance(shape, CylinderShape):
        return
    width, length = "workpiece.shape.facet_size_m", "workpiece.shape.facet_length_m"
    wide, facets = shape.facet_size_m, "facets of the workpiece"
    what = f"{facets} as short as they are wide, {1000 * wide:g} mm"
    yield Variant("workpiece_short_facets", what, {length: wide})
    for name, factor in (("narrow", 0.5), ("wide", 2.0)):
        what = f"{facets} {1000 * factor * wide:g} mm wide"
        yield Variant(f"workpiece_{name}_facets", what, {width: factor * wide})


def _motions(study: Study) -> Iterator[Variant]:
    path = study.motion.path
    if not isinstance(path, CirclePath) or study.motion.superposed() or study.workpieces:
        return
    yield Variant("spin", "the workpiece spins, 60 1/min", {"motion.spin": {"rpm": 60}})
    up_and_down = {"amplitude_m": 0.001, "frequency_hz": 5}
    yield Variant(
        "oscillation", "the workpiece oscillates, 1 mm at 5 Hz", {"motion.oscillation": up_and_down}
    )
    yield Variant("tilt", "the workpiece leans by 10 degrees", {"motion.tilt_deg": 10})
    yield Variant("workpieces", "three workpieces on the circle", {"workpieces": {"count": 3}})
    rest = {"kind": "rest", "radius_m": path.radius_m, "bowl_rpm": _rpm(study, path)}
    fields = {"motion.path": rest, "motion.speed_m_s": None}
    what = "the bowl rotates, as facets of a particle diameter, and the workpiece stands still"
    yield Variant("rotating_bowl", what, fields)


def _rpm(study: Study, path: CirclePath) -> float:
    """Of a bowl that passes the workpiece as fast as it is dragged, 1/min."""
    return 60 * study.motion.axis_speed_m_s / (2 * math.pi * path.radius_m)


def _outputs(base: Case) -> Iterator[Variant]:
    rates = base.study.outputs
    contacts, network = f"{rates.workpiece_contacts_hz:g} Hz", f"{rates.network_hz:g} Hz"
    what = "all contact columns: positions, velocities, torques, history, area"
    yield Variant("contact_columns", what, change="all_columns")
    what = f"network and particles at the rate of the workpiece's contacts, {contacts}"
    yield Variant("network_rate", what, {"outputs.network_hz": rates.workpiece_contacts_hz})
    what = f"contacts on the workpiece at the rate of its force, {rates.workpiece_force_hz:g} Hz"
    often = {"outputs.workpiece_contacts_hz": rates.workpiece_force_hz}
    yield Variant("workpiece_contacts_rate", what, often)
    what = (
        "network, particles and contacts on the workpiece from the plunge on, "
        f"{network} and {contacts}"
    )
    yield Variant("network_before_drag", what, base="before_drag")
    deck = process_scene(base).deck
    assert isinstance(deck, ProcessDeck)
    period, whole = deck.thermo_steps * deck.timestep_s, deck.legs[-1].end_step * deck.timestep_s
    what = (
        f"a restart point every {period:.2g} s; "
        f"50 over the run would be one every {whole / 51:.2g} s"
    )
    yield Variant("restart_points", what, change="restart_points")


def _neighbours(study: Study) -> Iterator[Variant]:
    for fraction in (0.02, 0.05, 0.2, 0.3):
        what = f"a neighbour skin of {fraction:g} of the mean radius"
        skin = float(f"{fraction * study.media.radius_mean_m:.3g}")
        yield Variant(f"skin_{fraction:g}", what, {"fidelity.skin_m": skin})
    yield Variant("skin_1mm", "a neighbour skin of 1 mm", {"fidelity.skin_m": 0.001})
    yield Variant("two_ranks", "two ranks instead of one", {"fidelity.ranks": 2})


def _steps(study: Study) -> Iterator[Variant]:
    """What changes the number of steps or of particles, by the cost of a step."""
    softest = min(material.youngs_modulus_pa for material in study.materials.values())
    for scale in (1.0, 0.1, 0.01, 1e-3, 1e-4):
        if scale * softest >= ENGINE_SOFTEST_PA:
            what = f"Young's moduli times {scale:g}, at the same fraction of Rayleigh"
            fields = {"fidelity.youngs_modulus_scale": scale}
            yield Variant(f"modulus_{scale:g}", what, fields, unit="per_step")
    for fraction in (0.2, 0.8):
        what = f"a time step of {100 * fraction:g} % of Rayleigh"
        fields = {"fidelity.timestep_fraction": fraction}
        yield Variant(f"step_{fraction:g}", what, fields, unit="per_step")
    fields = {"fidelity.speed_factor": 5.0}
    yield Variant("speed_5", "the workpiece five times as fast", fields, unit="per_step")
    count, depth = 3 * study.media.count // 4, 0.75 * study.motion.immersion_depth_m
    what = f"three quarters of the particles, {count}, and of the workpiece's depth"
    fields = {"media.count": count, "motion.immersion_depth_m": depth}
    yield Variant("fewer_particles", what, fields, unit="per_step")


def _plain(study: Study) -> Iterator[Variant]:
    fields = {
        "bowl.facet_size_m": 0.005,
        "fidelity.timestep_fraction": 0.2,
        "fidelity.skin_m": 0.001,
        "fidelity.ranks": 1,
    }
    what = "the plain deck: bowl as facets of 5 mm, 20 % of Rayleigh, 1 mm skin, one rank"
    yield Variant("plain", what, fields)
    yield Variant("plain_columns", f"{what}, all contact columns", fields, "all_columns")
    shape = study.workpiece.shape
    if isinstance(shape, CylinderShape):
        wide = shape.facet_size_m
        text = f"{what}, facets of the workpiece as short as they are wide, {1000 * wide:g} mm"
        even = {"workpiece.shape.facet_length_m": wide}
        yield Variant("plain_even_facets", text, {**fields, **even})
    stiff = {"fidelity.youngs_modulus_scale": 1.0}
    yield Variant("plain_full", f"{what}, full stiffness", {**fields, **stiff})
    what = f"full stiffness at {100 * _LONGEST_STEP:g} % of Rayleigh, nothing else"
    yield Variant("full", what, {**stiff, "fidelity.timestep_fraction": _LONGEST_STEP})


def _other_scenes(study: Study) -> Iterator[Variant]:
    what = "contacts between particles, of which there are none, at every written step"
    yield Variant("drop_contacts", what, change="drop_contacts", base="drop_test")
    what = "every step written, not only those near an impact"
    yield Variant("drop_every_step", what, change="drop_every_step", base="drop_test")
    what = (
        f"contacts between particles during the fill, {study.outputs.network_hz:g} Hz, "
        "with the bed at rest, which has the most of them"
    )
    yield Variant("filling_contacts", what, change="filling_contacts", base="filling")
