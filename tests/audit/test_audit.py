"""Tables of a finished run against a second, plain implementation, to rounding."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from paths import DATA
from plain_run import (
    PlainRun,
    bottlenecks,
    coordination,
    first_touches,
    loads,
    mean_contacts,
    rim_excess,
)
from snakemake_calls import copy_of_project, succeed

pytestmark = [pytest.mark.audit, pytest.mark.engine]

ROUNDING = {"rtol": 1e-9, "atol": 1e-12}


REMOVAL = {"coefficient_m2_n": 1e-15}
RODS = {"count": 260, "radius_std_m": 0, "shape": {"kind": "cylinder", "aspect": 1.4, "spheres": 3}}


def made(project: Path, **media: object) -> Path:
    """The process run of the small study with a law of removal, and these media."""
    study = yaml.safe_load((DATA / "small_study.yaml").read_text())
    study["outputs"] = {"first_touch_fraction": 0.3}
    study |= {"removal": REMOVAL, "media": study["media"] | media}
    succeed(copy_of_project(project, study), "all", "--config", "study=small")
    (run,) = (project / "results/small/process").iterdir()
    return run


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("audit"))


@pytest.fixture(scope="module")
def clumps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("clumps"), **RODS)


@pytest.fixture(scope="module")
def plain(folder: Path) -> PlainRun:
    return PlainRun(folder)


def table(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(folder / "tables" / f"{name}.parquet")


def same(found: object, wanted: object, what: str) -> None:
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    assert found.shape == wanted.shape, what
    np.testing.assert_allclose(found, wanted, err_msg=what, **ROUNDING)


def quantity(folder: Path, name: str) -> float:
    """The value of a quantity of a run."""
    document = json.loads((folder / "tables/quantities.json").read_text())
    value: float = document["values_of_run"][name]["value"]
    return value


def test_forces(folder: Path, plain: PlainRun) -> None:
    rows, forces = pd.DataFrame(plain.forces()), table(folder, "workpiece_force")
    for name in rows.columns.drop("fastest_particle_m_s"):  # for the acceptance check alone
        same(forces[name], rows[name], name)
    counted = [plain.counted(step) for step in rows["step"]]
    assert forces["in_statistics"].tolist() == counted
    for name in ("drag", "lateral", "vertical"):
        values = rows[f"{name}_n"][counted].tolist()
        mean = math.fsum(values) / len(values)
        spread = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (len(values) - 1))
        same([quantity(folder, f"{name}_{of}") for of in ("mean", "std")], [mean, spread], name)


def test_contacts_on_the_workpiece(folder: Path, plain: PlainRun) -> None:
    contacts = table(folder, "workpiece_contacts")
    loud = contacts[(contacts[["force_x_n", "force_y_n", "force_z_n"]] != 0.0).any(axis=1)]
    wanted = [(step, one) for step, of_step in plain.on_workpiece() for one in of_step]
    assert loud["step"].tolist() == [step for step, _ in wanted]
    assert loud["particle_id"].tolist() == [one.particle for _, one in wanted]
    assert loud["facet_id"].tolist() == [one.facet for _, one in wanted]
    for axis, name in enumerate("xyz"):
        same(loud[f"point_{name}_m"], [one.point[axis] for _, one in wanted], f"point {name}")
        same(loud[f"force_{name}_n"], [-one.force[axis] for _, one in wanted], f"force {name}")
    dragged = [(step, one) for step, one in wanted if plain.start < step <= plain.end]
    moved = loud[(loud["step"] > plain.start) & (loud["step"] <= plain.end)]
    slips = [plain.slip(one) for _, one in dragged]
    for axis, name in enumerate("xyz"):
        same(moved[f"slip_{name}_m_s"], [slip[axis] for slip, _ in slips], f"slip {name}")
    same(moved["normal_velocity_m_s"], [speed for _, speed in slips], "normal velocity")


def test_the_network(folder: Path, plain: PlainRun) -> None:
    frames = list(plain.networks())
    contacts = table(folder, "contacts").groupby("step")
    for step, _, wanted in frames:
        found = contacts.get_group(step)
        assert len(found) == len(wanted)
        by_pair = {(row.a_id, row.b_id): row.normal_force_n for row in found.itertuples()}
        for _, a, b, force in wanted:
            if b != 0:  # a particle can have two contacts with the workpiece
                same(by_pair[a, b], force, f"{step}: {a}-{b}")
    network = table(folder, "network").set_index("step")
    rows = {step: coordination(particles, found) for step, particles, found in frames}
    assert set(network.index) == {step for step in rows if plain.counted(step)}
    for step, row in network.iterrows():
        for name, value in rows[step].items():
            same(row[name], value, f"{step}: {name}")


def test_paths_from_the_workpiece_to_the_bowl(folder: Path, plain: PlainRun) -> None:
    chains = table(folder, "chains")
    paths = chains[(chains["definition"] == "widest_path") & chains["reaches_bowl"]]
    for step, _, contacts in plain.networks():
        if plain.counted(step):
            wanted = [force for force in bottlenecks(contacts) if force > 0.0]
            found = paths.loc[paths["step"] == step, "bottleneck_n"].sort_values()
            same(found, wanted, f"{step}: bottleneck forces")


def check_loads(folder: Path, plain: PlainRun) -> None:
    totals, by_facet, wanted = loads(plain)
    loading = json.loads((folder / "tables/loading.json").read_text())
    facets = table(folder, "facets").set_index("facet_id")
    events = table(folder, "contact_events").sort_values(["start_s", "particle_id"])
    assert events["particle_id"].tolist() == wanted["particle"].tolist()
    by_facet = by_facet.reindex(facets.index, fill_value=0.0)
    for name, total in totals.items():
        same(loading["totals"][name], total, f"total {name}")
        same(events[name], wanted[name], f"events' {name}")
        same(facets[name], by_facet[name], f"facets' {name}")
    same(events["peak_normal_force_n"], wanted["peak_normal_force_n"], "peaks")
    wear = json.loads((folder / "tables/wear.json").read_text())
    patch, area = np.array(wear["patch"]), np.array(wear["area_m2"])
    action = np.bincount(patch, by_facet["force_slide_n_m"])
    density = action / (np.bincount(patch, area) * loading["time_s"])
    same(wear["patch_w_m2"], density[patch], "depth of patches")


def test_loads_and_events(folder: Path, plain: PlainRun) -> None:
    check_loads(folder, plain)
    same(
        quantity(folder, "workpiece_contacts"),
        np.mean([len(of) for step, of in plain.on_workpiece() if plain.counted(step)]),
        "contacts",
    )


def test_loads_of_bodies_with_several_contacts(clumps: Path) -> None:
    """Amounts are those of the contacts of their spheres, the number of contacts that of bodies."""
    plain = PlainRun(clumps)
    check_loads(clumps, plain)
    same(quantity(clumps, "workpiece_contacts"), mean_contacts(plain), "contacts")
    merged, spheres = table(clumps, "workpiece_contacts"), table(clumps, "sphere_contacts")
    loud = spheres[(spheres[["force_x_n", "force_y_n", "force_z_n"]] != 0.0).any(axis=1)]
    assert len(loud) > len(loud.drop_duplicates(["step", "particle_id"]))
    assert len(merged) == len(spheres.drop_duplicates(["step", "particle_id"]))


def test_the_excess_along_the_rim(folder: Path, plain: PlainRun) -> None:
    """Areas are known to 0.5 % and distances to a tenth of the narrowest band."""
    edges = json.loads((folder / "tables/wear.json").read_text())["edges"]
    widths = edges["distance_m"][1:]
    for found, (within, excess) in zip(
        edges["excess_w"]["value"], rim_excess(plain, widths), strict=True
    ):
        assert found == pytest.approx(excess, abs=0.1 * within)


def test_first_touches(folder: Path, plain: PlainRun) -> None:
    wanted, time_s = first_touches(plain)
    found = table(folder, "touch_events").sort_values(["start_s", "particle_id"])
    assert len(wanted) > 20
    for name in wanted.columns.drop("frame"):
        same(found[name], wanted[name], name)
    case = plain.case
    modulus = case["contact_moduli"]["workpiece"]["modulus_pa"]
    modulus /= case["fidelity"]["youngs_modulus_scale"]
    force, radius = wanted["peak_normal_force_n"], wanted["radius_m"]
    same(found["peak_pressure_pa"], np.cbrt(6 * force * modulus**2 / np.pi**3 / radius**2), "Hertz")
    touches = json.loads((folder / "tables/wear.json").read_text())["touches"]
    same([touches["events"], touches["time_s"]], [len(wanted), time_s], "number and time")
    same(touches["per_s"]["value"], len(wanted) / time_s, "rate")
