"""What laws of removal read of a run, on contacts made by hand."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from loading_files import (
    DT,
    FRAMES,
    HIT,
    LAST,
    PERIOD,
    SIZE,
    START,
    case_json,
    contact,
    made_contacts,
    write_run,
    write_without_picture,
)
from made_run import output

from dragchain.loading.edges import edge_distance, sharp_edges, strewn
from dragchain.loading.wear import WEAR_FILE, Wear
from dragchain.run.workpiece import Surface

RADIUS_M, DENSITY = 3e-3, 2500.0
MASS_KG = DENSITY * 4 / 3 * math.pi * RADIUS_M**3
SPEED, ANGLE = 0.25, math.radians(40)
TIME_S = FRAMES * DT


def worn(
    folder: Path, law: dict[str, Any], contacts: list[dict[str, Any]], touches: Any = None
) -> Wear:
    """The wear of a run with these contacts, and with these rows of ``touches``."""
    write_run(folder, contacts)
    case = case_json({"removal": law})
    (folder / "case.json").write_text(json.dumps(case))
    if touches is not None:
        columns = json.loads((folder / "columns.json").read_text())
        columns["outputs"]["touch_contacts"] = output("local", ["x_m"], PERIOD, START, LAST)
        (folder / "columns.json").write_text(json.dumps(columns))
        rows = pd.DataFrame(touches).sort_values(["step", "particle_id"])
        rows.to_parquet(folder / "tables/touches.parquet")
        particles = pd.DataFrame({"step": 0, "particle_id": range(1, 9), "radius_m": RADIUS_M})
        particles.to_parquet(folder / "tables/particles.parquet")
    write_without_picture(folder)
    return Wear.read(folder / WEAR_FILE)


def hit(frame: int, particle: int = HIT, **changes: Any) -> dict[str, Any]:
    """First touch of an impact at `ANGLE` from the plate."""
    slip = (0.0, SPEED * math.cos(ANGLE))
    return contact(frame, particle, (0.0, 0.005), (-3.0, 0.0, 0.0), slip,
                   SPEED * math.sin(ANGLE)) | changes  # fmt: skip


def test_a_sliding_particle_has_the_action_of_force_times_distance(tmp_path: Path) -> None:
    """One particle slides under 1 N at 40 mm/s for 200 samples of a plate of 400 mm2."""
    rows = [one for one in made_contacts() if one["particle_id"] == 1]
    found = worn(tmp_path, {"coefficient_m2_n": 1e-15}, rows)
    assert found.action_w.value * TIME_S == pytest.approx(1.0 * 0.04 * 200 * DT, rel=1e-6)
    density, area = np.array(found.patch_w_m2), np.array(found.area_m2)
    assert density @ area == pytest.approx(found.action_w.value, rel=1e-9)
    assert found.touches is None


FINNIE = MASS_KG * SPEED**2 * math.cos(ANGLE) ** 2 / 3
HITS = [hit(50), hit(51, normal_velocity_m_s=0.1), hit(200, slip_z_m_s=0.0, slip_y_m_s=0.1)]
"""One particle for two samples, and again for one, then at another angle."""
STEEP = math.hypot(0.1, SPEED * math.sin(ANGLE))
SECOND = MASS_KG * STEEP**2 * math.cos(math.asin(SPEED * math.sin(ANGLE) / STEEP)) ** 2 / 3


def test_an_impact_has_the_action_at_its_first_touch(tmp_path: Path) -> None:
    law = {"law": "finnie", "coefficient_m2_n": 1e-12}
    touches = [hit(0, 4), *HITS]  # the first sample has begun before: its first touch is not seen
    found = worn(tmp_path, law, made_contacts(), touches)
    assert found.action_w.value * TIME_S == pytest.approx(FINNIE + SECOND, rel=1e-6)
    assert found.touches is not None
    assert found.touches.events == 2
    assert found.touches.per_s.value == pytest.approx(2 / TIME_S)
    events = pd.read_parquet(tmp_path / "tables/touch_events.parquet")
    assert events["touch_normal_m_s"].tolist() == pytest.approx([SPEED * math.sin(ANGLE)] * 2)
    assert events["impact_angle_rad"].iloc[0] == pytest.approx(ANGLE)
    assert events["duration_s"].tolist() == pytest.approx([2 * DT, DT])
    facets = pd.read_parquet(tmp_path / "tables/facets.parquet")
    assert facets["touches_per_m2_s"].tolist() == pytest.approx([2 / (SIZE**2 / 2 * TIME_S), 0])
    hertz = (6 * 3.0 * (2e11 / (2 * (1 - 0.3**2))) ** 2 / math.pi**3 / RADIUS_M**2) ** (1 / 3)
    assert facets["peak_pressure_pa"].tolist() == pytest.approx([hertz, 0.0])


def test_a_sum_adds_sliding_and_weighted_impacts(tmp_path: Path) -> None:
    law = {"law": "archard+finnie", "coefficient_m2_n": 1e-15, "impact_ratio": 50.0}
    found = worn(tmp_path, law, made_contacts(), HITS)
    sliding, impact = 1.0 * 0.04 * 200 * DT, 50 * (FINNIE + SECOND)
    assert found.action_w.value * TIME_S == pytest.approx(sliding + impact, rel=1e-6)
    assert found.impact_share.value == pytest.approx(impact / (sliding + impact), rel=1e-6)
    density, area = np.array(found.patch_w_m2), np.array(found.area_m2)
    assert density @ area == pytest.approx(found.action_w.value, rel=1e-9)


def test_without_an_impact_all_is_from_sliding(tmp_path: Path) -> None:
    law = {"law": "archard+finnie", "coefficient_m2_n": 1e-15, "impact_ratio": 50.0}
    parting = [hit(frame, normal_velocity_m_s=-0.1) for frame in (50, 200)]
    found = worn(tmp_path, law, made_contacts(), parting)
    assert found.impact_share.value == 0.0
    assert found.action_w.value * TIME_S == pytest.approx(1.0 * 0.04 * 200 * DT, rel=1e-6)


def test_an_ordinary_run_has_no_wear(tmp_path: Path) -> None:
    write_run(tmp_path, made_contacts())
    write_without_picture(tmp_path)
    assert not (tmp_path / WEAR_FILE).exists()
    assert "touch_normal_m_s" not in pd.read_parquet(tmp_path / "tables/facets.parquet")


def box(groove: bool = False) -> Surface:
    """A cube of 20 mm on the origin's plane, turned inside out if it is a groove."""
    import pyvista as pv

    mesh = pv.Box((-0.01, 0.01, -0.01, 0.01, 0.0, 0.02)).triangulate()
    corners = mesh.points[mesh.regular_faces].astype(np.float64)
    surface = Surface(corners)
    outward = np.einsum("ij,ij->i", surface.normals, surface.centres - [0, 0, 0.01]) > 0
    wrong = outward if groove else ~outward
    corners[wrong] = corners[wrong][:, ::-1]
    return Surface(corners)


def test_sharp_edges_are_convex_and_below_the_surface_of_the_bed() -> None:
    ends, angles = sharp_edges(box(), 0.015)
    assert len(ends) == 4  # those of the lower face; the others reach up to 20 mm
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(0.08)
    np.testing.assert_allclose(angles, math.pi / 2)
    assert len(sharp_edges(box(), 0.03)[0]) == 12
    assert not len(sharp_edges(box(groove=True), 0.03)[0])
    points = np.array([[0.01, 0.0, 0.0], [0.007, 0.0, 0.0], [0.01, 0.0, 0.004]])
    np.testing.assert_allclose(edge_distance(ends, points, 1e-5), [0.0, 0.003, 0.004], atol=1e-5)


def test_the_area_along_edges_is_that_of_strips() -> None:
    """Within 1 mm of the 12 edges of a cube of 20 mm lies all but six squares of 18 mm."""
    near = edge_distance(sharp_edges(box(), 0.03)[0], strewn(box()), 5e-5) <= 1e-3
    assert near.mean() * 6 * 4e-4 == pytest.approx(6 * (4e-4 - 0.018**2), rel=0.01)


def test_the_area_along_the_rim_of_a_long_rod_is_that_of_its_strips() -> None:
    """The strip from 0.4 to 0.8 mm is a hundredth of the surface of the rod."""
    import pyvista as pv

    mesh = pv.Cylinder(
        center=(0, 0, 0.038), direction=(0, 0, 1), radius=0.005, height=0.076, resolution=48
    ).triangulate()
    rod = Surface(mesh.points[mesh.regular_faces].astype(np.float64))
    away = edge_distance(sharp_edges(rod, 0.01)[0], strewn(rod), 4e-5)
    near = ((away >= 4e-4) & (away < 8e-4)).mean() * rod.areas.sum()
    strips = np.pi * (0.01 * 4e-4 + 4.6e-3**2 - 4.2e-3**2)
    assert near == pytest.approx(strips, rel=0.015)
