"""A case: one combination of a study's sweep at one fidelity, and how its runs are named."""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from dragdeck.cases.ranks import auto_ranks, cores_here, ranks_within
from dragdeck.records.advised import AdvisedSettings
from dragdeck.study.base import Json
from dragdeck.study.fidelity import Tolerance
from dragdeck.study.model import Study

SAID_BY_NAME = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
"""The settings that the name of a fidelity without a name says."""


@dataclass(frozen=True)
class Stretch:
    """What a run covers of the drag, in fractions of the drag.

    Attributes
    ----------
    begin : float
        0: the run begins with plunge and approach; otherwise it goes on from where its lead, a
        softer run, was there.
    end : float
    marks : tuple of float
        Where the state is written, for runs that go on from there.
    """

    begin: float = 0.0
    end: float = 1.0
    marks: tuple[float, ...] = ()


@dataclass(frozen=True)
class Case:
    """One combination of a study's sweep.

    Attributes
    ----------
    file : Path
        The study file.
    settings : mapping
        The sweep fields and their values in this case.
    study : Study
        With those values in place; its sweep is empty.
    requested : Tolerance or None
        What the settings in `study` were found for, if they were.
    advised : AdvisedSettings or None
        What is expected of them then.
    beside : int
        Cases that can run beside each other, this one among them.
    whole : Case or None
        Of one of several workpieces: the case of all.
    number : int
        The workpiece's number from 1; 0 for the case of all.
    stretch : Stretch
        What its process covers of the drag.
    lead : Case or None
        The softer run from which its process goes on; None if it begins by itself.
    part : str
        What tells its process from others of the same settings.
    rank_of_window : int
        Of a window: when it is run, from 1; otherwise 0.
    machine : Study or None
        What `study` is a cut-out of.
    left : mapping
        Of runs that the study's sweep called otherwise before: digest to run id.
    """

    file: Path
    settings: Mapping[str, Any]
    study: Study
    requested: Tolerance | None = None
    advised: AdvisedSettings | None = None
    beside: int = 1
    whole: "Case | None" = None
    number: int = 0
    stretch: Stretch = Stretch()
    lead: "Case | None" = None
    part: str = ""
    rank_of_window: int = 0
    machine: Study | None = None
    left: Mapping[str, str] = field(default_factory=dict)

    @property
    def written(self) -> Study:
        """The study as its file has it, of the whole machine."""
        return self.machine or self.study

    @property
    def all_workpieces(self) -> "Case":
        """The case that is run: of all workpieces."""
        return self.whole or self

    @property
    def of_filling(self) -> "Case":
        """The case of the filling that it, or its lead, starts from."""
        first = self.lead or self
        return replace(first, study=first.study.at_filling())

    @property
    def ranks(self) -> int:
        """MPI ranks of a run of the filling or the process.

        What ``ranks: auto`` comes to on this machine is no part of a run's name.
        """
        asked = self.study.chosen_fidelity().ranks
        if asked == "auto":
            column = self.study.bowl.container.hollow
            return auto_ranks(self.study.sphere_count, self.beside, cores_here(), column=column)
        return ranks_within(asked)

    @property
    def axis_speed_m_s(self) -> float:
        """Speed at which the workpiece's axis is driven relative to the bowl, m/s."""
        return self.study.motion.speed_in_bowl_m_s * self.study.chosen_fidelity().speed_factor

    @property
    def study_name(self) -> str:
        """Name of the study: its folder's."""
        return self.file.parent.name

    @property
    def name(self) -> str:
        """Readable name: the fidelity and the sweep values."""
        parts = [f"{field.rsplit('.', 1)[-1]}-{value}" for field, value in self.settings.items()]
        workpiece = [f"workpiece-{self.number}"] if self.number else []
        part = [self.part] if self.part else []
        return slug("_".join([self.fidelity_name, *parts, *part, *workpiece]))

    @property
    def fidelity_name(self) -> str:
        """Name of the fidelity; settings without a name are called by their values."""
        if self.requested is not None:
            name = f"tolerance-{self.requested.tolerance:g}"
            default = self.requested.quantity == Tolerance.model_fields["quantity"].default
            first, *others = self.requested.quantities
            more = [f"and-{len(others)}-more"] if others else []
            return name if default else "-".join([name, first, *more])
        fidelity = self.study.fidelity
        if isinstance(fidelity, str):
            return fidelity
        chosen = self.study.chosen_fidelity()
        name = f"E{chosen.youngs_modulus_scale:g}_dt{chosen.timestep_fraction:g}"
        return name if chosen.speed_factor == 1 else f"{name}_v{chosen.speed_factor:g}"


def of_each_workpiece(case: Case) -> list[Case]:
    """The case of each workpiece alone; the case itself if there is one, or it is one of these."""
    studies = case.study.of_each_workpiece()
    if studies[0] is case.study:
        return [case]
    return [
        replace(case, study=study, whole=case, number=number if studies[1:] else 0)
        for number, study in enumerate(studies, 1)
    ]


def digest(content: Json) -> str:
    """8 hex digits of plain data."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def slug(text: str) -> str:
    """A text as a part of a folder's name."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip("-.")
