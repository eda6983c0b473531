"""Studies of more than can be simulated are refused before the memory is taken."""

import contextlib
import io
import math
import multiprocessing
import os
import resource
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml
from made_study import put

from dragdeck.checking import check_study
from dragdeck.errors import DragdeckError, InputError
from dragdeck.mesh.shapes import cylinder
from dragdeck.project import Project
from dragdeck.sweep.cases import load_cases, settle_case
from dragdeck.sweep.plan import Plan, plan_points

Small = dict[str, Any]
Write = Callable[[Small], Path]

_MEMORY = 400_000_000
"""What a check may take beside what is loaded, bytes."""

_TINY = {"material": "ceramic", "radius_mean_m": 2e-5}
_LARGE = {"material": "ceramic", "radius_mean_m": 3e-3}
_SIEVE = [[2e-5, 0.0], [1e-4, 0.01], [5e-3, 0.2], [8e-3, 1.0]]
_BODY = {"kind": "cylinder", "aspect": 2, "spheres": 40}
_DRUM = {"angle_deg": 30, "angle_std_deg": 1, "radius_m": 4, "width_m": 4, "fill_fraction": 0.3,
         "rpm": 1}  # fmt: skip
_HEAP = {"angle_deg": 30, "angle_std_deg": 1, "cylinder_radius_m": 4, "count": 500}

_ROWS: Mapping[str, tuple[Mapping[str, Any], str, str]] = {
    "mass": ({"media": _LARGE | {"mass_kg": 1e5}}, "media", "all of one class"),
    "fill height": (
        {"media": _TINY | {"fill_height_m": 9.0}, "bowl": {"radius_m": 5, "height_m": 10}},
        "media", "all of one class",
    ),
    "dust in a sieve": (
        {"media": {"material": "ceramic", "mass_kg": 1.0, "sieve": _SIEVE}}, "media.sieve",
        "98.7 % of these between the sieves of 2e-05 and 0.0001 m (1 % of their mass)",
    ),
    "a class of dust": (
        {"media": {"mass_kg": 5.0, "classes": {"a": _LARGE | {"fraction": 0.9},
                                               "dust": _TINY | {"fraction": 0.1}}}},
        "media.classes.dust", "in class dust",
    ),
    "a class with dust in its sieve": (
        {"media": {"mass_kg": 5.0, "classes": {
            "a": _LARGE | {"fraction": 0.9},
            "b": {"material": "ceramic", "sieve": _SIEVE, "fraction": 0.1}}}},
        "media.classes.b.sieve", "between the sieves",
    ),
    "clumps of many spheres": (
        {"media": _LARGE | {"count": 900_000, "shape": _BODY}}, "media", "3.6e+07 spheres",
    ),
    "600 classes": (
        {"media": {"count": 5000, "classes": {f"c{n}": _LARGE | {"fraction": 1 / 600}
                                              for n in range(600)}}},
        "media.classes", "600 entries",
    ),
    "a bowl far too large for its particles": (
        {"media": {"radius_mean_m": 1e-4, "radius_std_m": 0, "count": 300},
         "bowl": {"radius_m": 9, "height_m": 9}}, "bowl.radius_m", "cells",
    ),
    "facets along the workpiece": (
        {"workpiece.shape.facet_length_m": 2e-6}, "facet_length_m", "facets",
    ),
    "facets of the bowl": ({"bowl.facet_size_m": 2e-6}, "facet_size_m", "facets"),
    "rates": (
        {"outputs": {"network_hz": 1e6, "workpiece_contacts_hz": 1e6, "workpiece_force_hz": 1e6},
         "motion.path.revolutions": 20_000}, "outputs.network_hz", "TB|GB",
    ),
    "force alone": (
        {"outputs.workpiece_force_hz": 1e6, "motion.path.revolutions": 90_000},
        "outputs.workpiece_force_hz", "workpiece_force",
    ),
    "a drum": ({"calibration": {"angles": {"drum": _DRUM}}}, "drum.fill_fraction", "the drum has"),
    "a heap": ({"calibration": {"angles": {"repose": _HEAP}}}, "cylinder_radius_m", "glued layer"),
    "cases": (
        {"sweep": {"seed": list(range(300)), "gravity_m_s2": [9 + n / 999 for n in range(300)]}},
        "sweep", "90000 cases",
    ),
}  # fmt: skip


def _said(folder: Path, answer: Connection) -> None:
    """What `check` says of the study ``huge``, with little memory to say it."""
    os.chdir(folder)
    most = psutil.Process().memory_info().vms + _MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    text = io.StringIO()
    with contextlib.redirect_stderr(text), contextlib.redirect_stdout(text):
        try:
            check_study("huge", None, False)
        except DragdeckError as error:
            text.write(f"REFUSED {error}")
        except BaseException as error:
            text.write(f"BROKEN {error!r}")
    answer.send(text.getvalue())


@pytest.mark.parametrize(("changes", "field", "said"), _ROWS.values(), ids=_ROWS)
def test_what_would_be_huge_is_refused_by_name(
    changes: Mapping[str, Any], field: str, said: str, small: Small, project: Project
) -> None:
    if changes.get("media", {}).keys() & {"classes", "sieve", "mass_kg", "fill_height_m"}:
        small.pop("media")
    put(small, changes)
    (project.root / "studies/huge").mkdir()
    (project.root / "studies/huge/study.yaml").write_text(yaml.safe_dump(small))
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    child = context.Process(target=_said, args=(project.root, there))
    child.start()
    there.close()
    text = here.recv()
    child.join()
    assert "REFUSED" in text and "BROKEN" not in text, text
    assert field in text, text
    assert any(one in text for one in said.split("|")), text


def test_as_many_as_count_may_have_are_accepted_by_mass_and_height(
    small: Small, write_study: Write
) -> None:
    """The limit is that of `count`, whatever gives the number."""
    volume = 4 / 3 * math.pi * 1e-9
    small["media"] = {"material": "ceramic", "radius_mean_m": 1e-3}
    small["bowl"] = {"material": "steel", "radius_m": 1.0, "height_m": 2.0}
    for number, accepted in ((3_990_000, True), (4_010_000, False)):
        small["media"]["mass_kg"] = number * volume * 2656
        file = write_study(small)
        if accepted:
            assert load_cases(file)[0].study.particle_count == number
        else:
            with pytest.raises(InputError, match="spheres in LIGGGHTS"):
                load_cases(file)


def test_a_cylinder_may_have_fine_strips_if_they_are_long() -> None:
    with pytest.raises(InputError, match="facets") as caught:
        cylinder(0.005, 0.08, 1e-3, 1e-7)
    assert caught.value.field == "workpiece.shape.facet_length_m"
    assert len(cylinder(0.005, 0.08, 1e-3, 0.01).faces) < 2000


def test_a_plan_of_too_many_points_is_not_listed(small: Small, write_study: Write) -> None:
    file = write_study(small)
    case = settle_case(file, small, {})
    many = {f"pairs.ceramic-steel.{name}": [n / 1e4 for n in range(1, 1000)]
            for name in ("friction", "restitution")}  # fmt: skip
    design = {"base": {}, "reference": {}, "points": [{"vary": many}]}
    with pytest.raises(InputError, match="points"):
        plan_points(Plan.model_validate(design), Path("plan.yaml"), case, {})
    seeds = {"base": {}, "reference": {}, "seeds": 10**9}
    with pytest.raises(InputError, match="points"):
        plan_points(Plan.model_validate(seeds), Path("plan.yaml"), case, {})
