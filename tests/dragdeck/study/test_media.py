"""The media: sizes come out as asked, totals are met, and what cannot be is refused."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st
from made_scenes import rendered
from made_study import Made
from paths import ROOT
from pydantic import ValidationError

from dragchain import write_tables
from dragdeck.cases.bed import (
    bed_classes,
    bed_density,
    bed_radii,
    bed_rayleigh_time,
    expected_surface,
    farthest_point,
)
from dragdeck.cases.case import Case
from dragdeck.engine.run_folder import run
from dragdeck.errors import InputError
from dragdeck.physics.contact_mechanics import rayleigh_time
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.records.packing import Packing
from dragdeck.scenes.bed_space import expected_bed, first_particles
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.filling_cautions import filling_cautions
from dragdeck.scenes.process import process_scene
from dragdeck.study.media import Grains
from dragdeck.study.shapes import SOLID_FRACTION_STD, AnyShape, ParticleShape, solid_fraction
from dragdeck.sweep.cases import load_cases

Small = dict[str, Any]
Write = Callable[[Small], Path]

SIEVE = [[2e-3, 0.0], [4e-3, 0.3], [5e-3, 0.9], [8e-3, 1.0]]


@pytest.mark.parametrize("distribution", ["normal", "log_normal", "uniform"])
@given(count=st.integers(2, 5000), mean=st.floats(1e-4, 1e-1), spread=st.floats(0.0, 0.3))
@example(count=500, mean=3e-3, spread=0.0)
def test_mean_and_spread_come_out_as_asked(
    distribution: str, count: int, mean: float, spread: float
) -> None:
    sizes = {"radius_mean_m": mean, "radius_std_m": spread * mean, "distribution": distribution}
    radii = Grains.model_validate(sizes).radii(count)
    assert radii.mean() == pytest.approx(mean, rel=1e-12)
    assert radii.std() == pytest.approx(spread * mean, rel=1e-9, abs=1e-12 * mean)
    assert (np.diff(radii) >= 0).all() and radii[0] > 0


def test_a_log_normal_distribution_is_skewed_and_a_uniform_one_is_not() -> None:
    log_normal, uniform = (
        Grains.model_validate(
            {"radius_mean_m": 1.0, "radius_std_m": 0.3, "distribution": distribution}
        ).radii(1000)
        for distribution in ("log_normal", "uniform")
    )
    logs = np.log(log_normal)
    assert logs.mean() == pytest.approx(np.median(logs), abs=1e-9)
    assert np.diff(uniform) == pytest.approx(np.diff(uniform)[0])


def test_the_mass_of_sieved_particles_follows_the_sieve_analysis() -> None:
    diameters = 2 * Grains.model_validate({"sieve": SIEVE}).radii(20_000)
    mass = np.cumsum(diameters**3) / (diameters**3).sum()
    asked = np.interp(diameters, *np.transpose(SIEVE))
    assert np.abs(mass - asked).max() < 5e-3
    assert diameters[0] > 2e-3 and diameters[-1] < 8e-3


@pytest.mark.parametrize(
    ("sieve", "problem"),
    [
        ([[2e-3, 0.0], [2e-3, 1.0]], "do not increase"),
        ([[2e-3, 0.0], [3e-3, 0.5], [4e-3, 0.4], [5e-3, 1.0]], "mass passing decreases"),
        ([[2e-3, 0.1], [3e-3, 1.0]], "from 0.1 to 1"),
        ([[2e-3, 0.0], [3e-3, 0.9]], "from 0 to 0.9"),
        ([[-2e-3, 0.0], [3e-3, 1.0]], "greater than 0"),
    ],
)
def test_a_sieve_analysis_that_cannot_be_is_refused(sieve: Any, problem: str) -> None:
    with pytest.raises(ValidationError, match=problem):
        Grains.model_validate({"sieve": sieve})


MIXTURE = {
    "coarse": {"material": "ceramic", "fraction": 0.7, "radius_mean_m": 3e-3, "radius_std_m": 2e-4},
    "fine": {"material": "steel", "fraction": 0.3, "radius_mean_m": 2e-3},
}
GOLD = MIXTURE["fine"] | {"material": "gold"}
PAIR = {"restitution": 0.6, "friction": 0.2}


@pytest.fixture
def mixed(small: Small, write_study: Write) -> Made:
    """The case of the small study with two classes of media."""

    def mix(**changes: Any) -> Case:
        media = {"count": 300, "classes": MIXTURE} | changes
        media = {name: value for name, value in media.items() if value is not None}
        pairs = small["pairs"] | {"steel-steel": PAIR}
        (case,) = load_cases(write_study(small | {"media": media, "pairs": pairs}))
        return case

    return mix


@pytest.mark.parametrize("fractions_of", ["number", "mass", "volume"])
@pytest.mark.parametrize(
    "total",
    [{"count": 3000}, {"count": None, "mass_kg": 0.6}, {"count": None, "fill_height_m": 0.1}],
)
def test_asked_fractions_and_totals_are_obtained(
    fractions_of: str, total: Small, mixed: Made
) -> None:
    case = mixed(fractions_of=fractions_of, **total)
    study, classes = case.study, bed_classes(case.study)
    volume = np.array([(4 / 3 * math.pi * one.radii_m**3).sum() for one in classes])
    mass = volume * [study.materials[one.material].density_kg_m3 for one in classes]
    amounts = {"number": np.array([len(one.radii_m) for one in classes]), "mass": mass}
    amount = amounts.get(fractions_of, volume)
    assert amount / amount.sum() == pytest.approx([0.7, 0.3], abs=2e-3)
    height = expected_surface(study)
    got = {"count": study.particle_count, "mass_kg": mass.sum(), "fill_height_m": height}
    ((name, asked),) = ((name, value) for name, value in total.items() if value)
    assert got[name] == pytest.approx(asked, rel=2e-3)
    assert bed_density(study) == pytest.approx(mass.sum() / volume.sum())


def test_every_particle_has_the_density_and_the_type_of_its_class(mixed: Made) -> None:
    case = mixed()
    scene = filling_scene(case)
    lines = scene.texts()["particles.data"].splitlines()
    start = lines.index("Atoms") + 2
    atoms = np.array([line.split()[:4] for line in lines[start : start + 300]], dtype=float)
    coarse, fine = scene.case.classes
    assert (coarse.first_id, fine.first_id, coarse.count + fine.count) == (1, coarse.count + 1, 300)
    for one, kind, density in ((coarse, 1, coarse.density_kg_m3), (fine, 2, fine.density_kg_m3)):
        rows = atoms[one.first_id - 1 : one.first_id - 1 + one.count]
        assert set(rows[:, 1]) == {kind} and set(rows[:, 3]) == {density}
        assert rows[:, 2].mean() / 2 == pytest.approx(one.radius_mean_m)
    places = first_particles(case.study).positions_m
    assert abs(places[: coarse.count, 2].mean() / places[coarse.count :, 2].mean() - 1) < 0.2


def test_pairs_of_all_materials_are_in_the_script(mixed: Made, small: Small) -> None:
    case = mixed()
    law = process_scene(case, Bed(0.022, 0.026)).deck.materials.law
    restitution = next(table for table in law.tables if table.name == "restitution").values
    known = small["pairs"]
    both = [known["ceramic-ceramic"]["restitution"], known["ceramic-steel"]["restitution"]]
    assert restitution == [*both, both[1], 0.6]


def test_the_class_with_the_shortest_rayleigh_time_sets_the_time_step(mixed: Made) -> None:
    case = mixed()
    study = case.study
    scale = study.chosen_fidelity().youngs_modulus_scale
    steel, ceramic = (
        rayleigh_time(study.materials[name], radius, scale)
        for name, radius in (("steel", 2e-3), ("ceramic", float(bed_classes(study)[0].radii_m[0])))
    )
    assert bed_rayleigh_time(study) == steel < ceramic


def test_a_class_that_makes_runs_many_times_dearer_gets_a_warning(mixed: Made) -> None:
    powder = MIXTURE["fine"] | {"radius_mean_m": 1e-4, "fraction": 0.001}
    classes = {"coarse": MIXTURE["coarse"] | {"fraction": 0.999}, "powder": powder}
    changes = {"classes": classes, "fractions_of": "volume"}
    for changed, warned in ((changes, True), ({}, False)):
        case = mixed(**changed)
        texts = [str(one) for one in filling_cautions(case) if one.code == "class"]
        assert bool(texts) == warned
        assert all(text.startswith("class powder (0.09") for text in texts)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"count": None}, "one of count, mass_kg and fill_height_m"),
        ({"mass_kg": 1.0}, "one of count, mass_kg and fill_height_m"),
        ({"material": "ceramic"}, "stand in each of them"),
        ({"classes": {"a": MIXTURE["coarse"]}}, "sum to 0.7, not to 1"),
        ({"classes": MIXTURE | {"fine": {"material": "steel", "fraction": 0.3}}}, "is missing"),
        ({"count": 1}, "not one particle"),
        ({"classes": {"bowl": MIXTURE["coarse"] | {"fraction": 1}}}, "must not be called bowl"),
        ({"classes": MIXTURE | {"fine": GOLD}}, "no such material"),
    ],
)
def test_media_that_cannot_be_are_refused(changes: Small, problem: str, mixed: Made) -> None:
    with pytest.raises(InputError, match=problem):
        mixed(**changes)


@pytest.mark.parametrize("in_class", [False, True])
def test_a_sieve_analysis_is_read_from_a_file_beside_the_study(
    in_class: bool, small: Small, write_study: Write
) -> None:
    grains = {"material": "ceramic", "sieve": "sieve.csv"}
    media = {"count": 50, **({"classes": {"a": grains | {"fraction": 1}}} if in_class else grains)}
    file = write_study(small | {"media": media})
    table = file.with_name("sieve.csv")
    table.write_text("diameter_m,mass_passing\n0.004,0\n0.006,0.5\n0.007,1\n")
    (case,) = load_cases(file)
    assert case.study.media.main.sieve == [(0.004, 0), (0.006, 0.5), (0.007, 1)]
    table.write_text("diameter_m,mass_passing\n0.004,0\n0.006,x\n0.007,1\n")
    with pytest.raises(InputError, match=r"sieve\.csv") as caught:
        load_cases(file)
    assert caught.value.line == 3


@pytest.mark.engine
def test_a_mixture_of_materials_and_sizes_comes_to_rest_as_asked(
    mixed: Made, project: Project
) -> None:
    case = mixed(count=100)
    folder = rendered(case, project)
    assert run(folder, lambda line: None).state == "complete"
    write_tables(folder)
    packing = Packing.read(folder / "tables" / "packing.json")
    radii = bed_radii(case.study)
    found = packing.n_particles, packing.radius_mean_m, packing.radius_std_m
    assert found == pytest.approx((100, radii.mean(), radii.std()), rel=1e-6)
    limit = case.study.filling.energy_ratio
    assert packing.kinetic_energy_ratio < 1.5 * limit


def test_alternatives_in_a_study_replace_those_of_the_one_it_extends(
    small: Small, write_study: Write
) -> None:
    file = write_study(small)
    other = file.parent.with_name("other") / "study.yaml"
    other.parent.mkdir()
    for media in ({"mass_kg": 0.1}, {"classes": MIXTURE}, {"sieve": SIEVE, "fill_height_m": 0.02}):
        own = {"extends": file.parent.name, "media": media}
        pairs = {"pairs": {"steel-steel": PAIR}} if "classes" in media else {}
        other.write_text(yaml.safe_dump(own | pairs))
        (case,) = load_cases(other)
        assert set(media) <= set(case.study.media.plain())
        assert ("count" in case.study.media.plain()) == ("classes" in media)


def test_a_changed_study_counts_its_own_particles(made: Made) -> None:
    case = made()
    study = case.study
    assert study.particle_count == 300
    changed = study.model_copy(update={"media": study.media.model_copy(update={"count": 7})})
    assert changed.particle_count == 7


def _size_warnings(small: Small, write_study: Write, ratio: float, **frictions: float) -> list[str]:
    """Warnings about the ratio of two sizes of ceramic particles, with other frictions."""
    names = ("ceramic-ceramic", "ceramic-steel")
    asked = zip(names, (frictions["media"], frictions["wall"]), strict=True)
    pairs = {name: small["pairs"][name] | {"friction": friction} for name, friction in asked}
    both = {name: {"material": "ceramic", "fraction": 0.5, "radius_mean_m": radius}
            for name, radius in (("coarse", 3e-3), ("fine", 3e-3 / ratio))}  # fmt: skip
    study = small | {"media": {"mass_kg": 0.01, "classes": both}, "pairs": pairs}
    (case,) = load_cases(write_study(study))
    return [str(one) for one in filling_cautions(case) if one.code == "size_ratio"]


@pytest.mark.parametrize(
    ("ratio", "media", "wall", "said"),
    [
        (12.6, 0.34, 0.28, ""),  # 1 / 0.28^2 = 12.8
        (12.9, 0.34, 0.28, "the bowl"),
        (8.7, 0.34, 0.5, "the bowl"),  # the smaller friction counts: 1 / 0.34^2 = 8.65
        (8.5, 0.34, 0.5, ""),
        (17.7, 0.34, 0.0, ""),  # 1 / (sqrt(1 + 0.34^2) - 1) = 17.8
        (18.0, 0.34, 0.0, "another large one"),
        (2.5, 1.0, 0.0, "another large one"),
        (2.3, 1.0, 0.0, ""),
        (1.4, 1.0, 1.0, ""),  # stayed nowhere
        (1.6, 1.0, 1.0, "the bowl"),
        (20.5, 0.2, 0.2, "nothing was measured"),  # 1 / 0.2^2 = 25
    ],
)
def test_a_size_ratio_at_which_friction_holds_small_particles_is_named(
    ratio: float, media: float, wall: float, said: str, small: Small, write_study: Write
) -> None:
    found = _size_warnings(small, write_study, ratio, media=media, wall=wall)
    assert len(found) == bool(said) and all(said in text for text in found)


RECORD = ROOT / "docs/data/scenes/solid_fraction.csv"


def test_measured_beds_are_within_the_margin_of_what_is_expected() -> None:
    """The factors of the shapes and the margin are those of the record."""
    beds = pd.read_csv(RECORD)
    narrow = beds[beds.bowl_m < 0.03]
    ones = narrow.query("shape == 'sphere' and spread < 0.15 and friction == 0.34")
    spheres = ones.solid_fraction.mean()
    kinds = {get_args(kind.model_fields["kind"].annotation)[0]: kind
             for kind in get_args(get_args(AnyShape)[0])}  # fmt: skip
    bodies = beds[beds["shape"] != "sphere"]
    by_kind = bodies.solid_fraction.groupby(bodies["shape"].str.split(r"[ ,]").str[0]).mean()
    for name, solid in by_kind.items():
        kind = kinds["triangular_prism" if name == "prism" else str(name)]
        assert kind.denser == pytest.approx(solid / spheres, abs=0.006)
    assert ParticleShape.denser == pytest.approx((by_kind / spheres).mean(), abs=0.006)
    several = narrow.query("shape == 'sphere' and spread > 0 and friction == 0.34")
    wider = several.spread - 0.05
    growth = several.solid_fraction / spheres - 1 - 0.23 * wider - 0.55 * wider**2
    assert growth.abs().max() < 0.02
    ratio = beds.solid_fraction / beds.expected
    assert ratio.std() <= SOLID_FRACTION_STD
    assert (ratio - 1).abs().max() < 2 * SOLID_FRACTION_STD


def test_a_depth_that_fits_the_lowest_expected_bed_is_accepted_and_no_deeper_one(
    made: Made, small: Small
) -> None:
    case = made()
    bed, largest = expected_bed(case.study), 2 * farthest_point(case.study)
    assert bed.margin_m == pytest.approx(2 * SOLID_FRACTION_STD * bed.surface_m)
    for deeper_m in (-1e-5, 1e-5):
        small["motion"]["immersion_depth_m"] = bed.lowest_m - largest + deeper_m
        case = made()
        if deeper_m < 0:
            process_scene(case)
            continue
        with pytest.raises(InputError, match="crush particles"):
            process_scene(case)
        process_scene(case, Bed(bed.surface_m, bed.top_m))  # obtained as expected


@pytest.mark.parametrize("shape", [None, {"kind": "cylinder", "aspect": 1.2, "spheres": 4}])
def test_a_bed_that_may_reach_above_the_rim_is_refused(
    shape: Any, made: Made, small: Small
) -> None:
    """Even where the expected surface is below it; the number in the message is accepted."""
    small["media"] |= {"radius_std_m": 0.0, "shape": shape}
    case = made()
    bed = expected_bed(case.study)
    for rim in (bed.top_m + bed.margin_m + 1e-5, bed.top_m):
        small["bowl"]["height_m"] = rim
        case = made()
        if rim > bed.top_m:
            filling_scene(case)
    with pytest.raises(InputError, match="more particles than fit") as caught:
        filling_scene(case)
    assert caught.value.field == "media.count"
    most = re.match(r"(\d+) particles", caught.value.limit or "")
    assert most
    small["media"]["count"] = int(most[1])
    filling_scene(made())
    small["media"]["count"] = int(most[1]) + 1
    with pytest.raises(InputError, match="more particles than fit"):
        filling_scene(made())


def test_the_largest_class_stands_on_top_of_a_bed(made: Made, small: Small) -> None:
    """A bed whose fine first class alone would fit; the message names the total of the study."""
    classes = {
        name: {"material": "ceramic", "radius_mean_m": radius_m, "fraction": fraction}
        for name, radius_m, fraction in (("fine", 1e-3, 0.05), ("coarse", 3e-3, 0.95))
    }
    small["media"] = {"fill_height_m": 0.02, "classes": classes}
    bed = expected_bed(made().study)
    assert bed.top_m == pytest.approx(bed.surface_m + 6e-3)
    small["bowl"]["height_m"] = bed.top_m
    with pytest.raises(InputError, match="more particles than fit") as caught:
        filling_scene(made())
    assert caught.value.field == "media.fill_height_m"


@pytest.mark.parametrize(("height_m", "refused"), [(0.1, False), (0.1001, True), (9.0, True)])
def test_a_fill_height_above_the_rim_is_refused(
    height_m: float, refused: bool, small: Small, write_study: Write
) -> None:
    small["media"] = {"material": "ceramic", "radius_mean_m": 3e-3, "fill_height_m": height_m}
    file = write_study(small)
    if not refused:
        load_cases(file)
        return
    with pytest.raises(InputError, match=r"fill_height_m.*above the rim") as caught:
        load_cases(file)
    assert "at most 0.1 m" in str(caught.value)


@pytest.mark.parametrize("shape", [None, {"kind": "tetrahedron", "spheres": 4}])
@pytest.mark.parametrize("sizes", [{"radius_std_m": 6e-4}, {"distribution": "log_normal"}])
def test_a_bed_by_its_height_is_expected_to_have_it(
    shape: Any, sizes: Small, small: Small, write_study: Write
) -> None:
    media = {"material": "ceramic", "radius_mean_m": 2e-3, "fill_height_m": 0.06, **sizes}
    (case,) = load_cases(write_study(small | {"media": media | {"shape": shape}}))
    assert expected_surface(case.study) == pytest.approx(0.06, rel=2e-3)


def test_particles_of_different_sizes_pack_more_densely() -> None:
    radii, numbers = np.array([1.0, 2.0]), np.array([8.0, 1.0])
    spread = math.sqrt(8 / 81) / (10 / 9)
    growth = 0.23 * (spread - 0.05) + 0.55 * (spread - 0.05) ** 2
    assert solid_fraction(radii, numbers, 1.0) == pytest.approx(0.59 * (1 + growth))
    for alike in ([1.0, 1.0], [0.96, 1.04]):
        assert solid_fraction(np.array(alike), np.ones(2), 1.0) == 0.59
    for ratio in (5.0, 50.0):  # not measured: as the widest that was
        assert solid_fraction(np.array([1.0, ratio]), numbers, 1.0) == pytest.approx(
            0.59 * (1 + 0.23 * 0.42 + 0.55 * 0.42**2)
        )
