"""The process of a run folder in Yade: steps per second and mean drag, as JSON.

    python benchmarks/yade.py results/<study>/process/<run> [--steps 5000] [--threads 1]

The scene is that of the input script: bed, bowl, workpiece, contact law, time step and motion.
Plunge and approach are run before the counted steps, which are the first of the drag; with
``--skip-insertion`` Yade starts with the bed and the workpiece that LIGGGHTS had then. Yade
(Debian package ``yade``) has its own Python, so ``yade_scene.py`` runs there and gets its numbers
from a JSON file. ``docs/evidence/yade.md`` lists what differs between the two programs.
"""

import argparse
import json
import math
import os
import re
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import trimesh
from machine import machine

from dragchain.statistics.correlated import estimate_mean

LAW = "pair_style gran model hertz tangential history limitForce on\n"
BOWL_SIDES = 48
LEAST_SAMPLES = 8
# Yade's facet has twice the radius of the particle on it: their effective radius is 2 r / 3, not r.
FACET_STIFFNESS = math.sqrt(2 / 3)
NUMBER = r"(-?[\d.]+(?:e-?\d+)?)"


def scene(folder: Path, steps: int, verlet: float, skip_insertion: bool) -> dict[str, Any]:
    """What Yade needs, from the run's case, input script and meshes and from the settled bed."""
    case = json.loads((folder / "case.json").read_text())
    deck = (folder / "in.liggghts").read_text()
    assert LAW in deck, "the input script has another contact law"
    dt, legs = case["timestep_s"], _legs(deck, case)
    placed = rf"surface/stress file workpiece.stl type \d+ move {NUMBER} {NUMBER} {NUMBER} "
    drag, moved = legs[-1], _found(placed, deck)
    if skip_insertion:
        bed = pd.read_parquet(folder / "tables/particles.parquet")
        bed = bed[bed.step == drag["start_step"]]
        for leg in legs[:-1]:
            time = leg["steps"] * dt
            moved = [x + v * time for x, v in zip(moved, leg["velocity_m_s"], strict=True)]
        legs = [drag]
    else:
        filling = folder.parents[1] / "filling" / case["upstream"]["filling"]
        bed = pd.read_parquet(filling / "tables/particles.parquet")
        bed = bed[bed.step == bed.step.max()]
    assert len(bed) == case["media"]["count"], "the bed is not complete"
    drag["steps"] = min(steps, drag["steps"])
    workpiece = trimesh.load_mesh(folder / "workpiece.stl").triangles + moved
    columns = ["x_m", "y_m", "z_m", "radius_m", "vx_m_s", "vy_m_s", "vz_m_s"]
    return {
        "timestep_s": dt,
        "gravity_m_s2": case["gravity_m_s2"],
        "density_kg_m3": case["media"]["density_kg_m3"],
        "materials": _materials(case["contact_moduli"]),
        "contacts": [
            {"first": 0, "second": second, **_contact(case["contact_moduli"][name])}
            for second, name in enumerate(("particle", "bowl", "workpiece"))
        ],
        "bowl_radius_m": case["bowl"]["radius_m"],
        "bowl_height_m": case["inputs"]["bowl.height_m"],
        "bowl_sides": BOWL_SIDES,
        "particles": bed[[*columns, "wx_rad_s", "wy_rad_s", "wz_rad_s"]].to_numpy().tolist(),
        "workpiece": workpiece.tolist(),
        "legs": legs,
        "verlet_m": verlet * bed.radius_m.min(),
        "transient_steps": round(case["statistics"]["transient_s"] / dt),
        "sample_steps": int(*_found(rf"fix write_workpiece_force all print {NUMBER} ", deck)),
        "direction_rad": case["motion"]["start_direction_rad"],
    }


def _legs(deck: str, case: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The stretches of the motion: a velocity, or a rotation about the bowl's axis."""
    found = []
    for phase in case["phases"]:
        move = f"fix move_{phase['name']} all move/mesh mesh workpiece"
        leg = {**phase, "steps": phase["end_step"] - phase["start_step"]}
        if f"{move} linear " in deck:
            leg["velocity_m_s"] = _found(rf"{move} linear {NUMBER} {NUMBER} {NUMBER}\n", deck)
        else:
            turn = rf"{move} rotate origin 0. 0. 0. axis 0. 0. {NUMBER} period {NUMBER}\n"
            sense, period = _found(turn, deck)
            leg["angular_speed_rad_s"] = sense * 2 * math.pi / period
        found.append(leg)
    return found


def _found(pattern: str, deck: str) -> list[float]:
    match = re.search(pattern, deck)
    assert match, f"the input script has no line {pattern}"
    return [float(number) for number in match.groups()]


def _materials(moduli: Mapping[str, Mapping[str, float]]) -> list[tuple[float, float]]:
    """Young's modulus and Poisson's ratio of particles, bowl and workpiece in Yade.

    Those of the facets make their contacts as stiff as in LIGGGHTS, whose effective radius is
    that of the particle.
    """
    normal, shear = (2 * moduli["particle"][name] for name in ("modulus_pa", "shear_pa"))
    found = [_elastic(normal, shear)]
    for body in (moduli["bowl"], moduli["workpiece"]):
        rest = [
            1 / (FACET_STIFFNESS / body[name] - 1 / particle)
            for name, particle in (("modulus_pa", normal), ("shear_pa", shear))
        ]
        found.append(_elastic(*rest))
    return found


def _elastic(normal: float, shear: float) -> tuple[float, float]:
    """E and nu for E / (1 - nu^2) and E / (2 (1 + nu) (2 - nu))."""
    ratio = normal / shear
    poisson = (ratio - 4) / (ratio - 2)
    return normal * (1 - poisson**2), poisson


def _contact(moduli: Mapping[str, float]) -> dict[str, float]:
    """Friction angle, and the damping ratio of LIGGGHTS on Yade's scale.

    Both dashpots are proportional to the root of mass and tangent stiffness, and LIGGGHTS has a
    factor of the root of 5/6. ``en`` of Yade is the effective restitution, which LIGGGHTS'
    coefficient is not (docs/development/liggghts.md).
    """
    log = -math.log(moduli["restitution"])
    return {
        "friction_angle_rad": math.atan(moduli["friction"]),
        "damping_ratio": math.sqrt(5 / 6) * log / math.hypot(log, math.pi),
    }


def measure(folder: Path, wanted: dict[str, Any], threads: int) -> dict[str, Any]:
    """Run Yade and put what LIGGGHTS has for the same steps beside it."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    script = Path(__file__).resolve().with_name("yade_scene.py")
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "scene.json").write_text(json.dumps(wanted))
        words = ["yade", "-n", "-x", "-j", str(threads), str(script)]
        subprocess.run(
            [*words, "scene.json", "result.json"],
            cwd=place,
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        result = json.loads((Path(place) / "result.json").read_text())
    drag, particles = wanted["legs"][-1], len(wanted["particles"])
    phases = []
    for phase in result.pop("phases"):
        rate = phase["steps"] / phase["wall_s"]
        phases.append({**phase, "steps_per_s": rate, "particle_steps_per_s": rate * particles})
    first, last = drag["start_step"], drag["start_step"] + drag["steps"]
    after = first + wanted["transient_steps"]
    counted = after if after < last else first
    forces = pd.DataFrame(result.pop("drag"), columns=["step", "drag_n"])
    forces["step"] += first
    record = json.loads((folder / "run.json").read_text())
    theirs = pd.read_parquet(folder / "tables/workpiece_force.parquet", columns=["step", "drag_n"])
    return {
        "yade": result.pop("version"),
        "threads": threads,
        "particles": particles,
        "steps": drag["steps"],
        "steps_per_s": phases[-1]["steps_per_s"],
        "particle_steps_per_s": phases[-1]["particle_steps_per_s"],
        "steps_of_whole_run": drag["end_step"],
        "drag_n": _mean(forces, counted, last),
        "drag_over_steps": [counted, last],
        "phases": phases,
        **result,
        "liggghts": {
            "ranks": record["ranks"],
            "steps_per_s_of_whole_run": record["steps_per_s"],
            "drag_n": _mean(theirs, counted, last),
        },
        "machine": machine(),
    }


def _mean(forces: pd.DataFrame, first: int, last: int) -> dict[str, float | None]:
    """Mean drag over some steps, N, and its 95 % confidence interval if that can be known."""
    drag = forces[forces.step.between(first + 1, last)].drag_n
    if len(drag) < LEAST_SAMPLES:
        return {"value": None, "ci95_low": None, "ci95_high": None}
    known = estimate_mean(drag)
    low, high = (known.ci95_low, known.ci95_high) if known.reliable else (None, None)
    return {"value": known.mean, "ci95_low": low, "ci95_high": high}


def main() -> None:
    """Print the measurement of a run folder."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("run", type=Path, help="a finished process run with its tables")
    parser.add_argument("--steps", type=int, default=5000, help="steps of the drag (5000)")
    parser.add_argument("--threads", type=int, default=1, help="OpenMP threads of Yade (1)")
    parser.add_argument(
        "--verlet",
        type=float,
        default=0.1,
        help="enlargement of bounding boxes relative to the smallest radius (0.1)",
    )
    parser.add_argument("--skip-insertion", action="store_true", help="start with the drag")
    options = parser.parse_args()
    folder = options.run.resolve()
    wanted = scene(folder, options.steps, options.verlet, options.skip_insertion)
    print(json.dumps(measure(folder, wanted, options.threads), indent=2))


if __name__ == "__main__":
    main()
