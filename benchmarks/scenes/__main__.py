"""Scenes to test the advisor and the extrapolation in: a space-filling design as a plan.

    python benchmarks/scenes --scenes 14 --seed 1 --out workflow/plans/scenes.yaml
    python benchmarks/scenes --scenes 11 --seed 2 --limit 2.5e8 --points promises \
        --out workflow/plans/fresh.yaml

A scrambled Sobol sequence over the dimensionless numbers of a drag. The physical Young's
modulus must be affordable: where a run with it and 64 % of the Rayleigh time would take more
particle-steps than allowed, the modulus is lowered, and a scene that is too expensive even
with the lowest one is left out. Slow drags may take longer, by the root of the inertial
number. The scenes are therefore softer and smaller than many real ones. Everything else is that
of the study `uhlmann2015`.
"""

import argparse
import math
from pathlib import Path
from typing import Any

import yaml
from scipy.stats import qmc

from dragdeck.cases.case import Case
from dragdeck.decks.deck import StudyScene
from dragdeck.errors import InputError
from dragdeck.physics.rounding import round_to
from dragdeck.project import Project
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.sweep.plan import Plan, plan_points

RANGES = {
    "diameter_m": (1e-3, 6e-3, "log"),
    "density_kg_m3": (1000.0, 8000.0, "log"),
    "youngs_modulus_pa": (5e9, 4e11, "log"),
    "friction": (0.05, 0.8, "even"),
    "workpiece_friction": (0.05, 0.6, "even"),
    "restitution": (0.3, 0.95, "even"),
    "radius_std": (0.0, 0.1, "even"),
    "workpiece_to_particle": (1.0, 3.0, "log"),
    "depth_to_particle": (3.0, 8.0, "log"),
    "bowl_to_particle": (10.0, 15.0, "log"),
    "inertial_number": (0.02, 0.3, "log"),
}
"""Lowest and highest value of what is drawn, and how values lie between them."""

BELOW_TIP, GAP = 3.0, 2.5
"""Particle diameters between tip and floor, and between workpiece and bowl."""

REDUCED = (1e-3, 1e-2)
"""Modulus scales that are compared with the physical Young's modulus."""

POINTS = {
    "moduli": [
        {
            "vary": {
                "fidelity.youngs_modulus_scale": list(REDUCED),
                "fidelity.timestep_fraction": [fraction],
                "fidelity.filling_timestep_fraction": [0.1],  # particles fall through long steps
            },
            "seeds": seeds,
        }
        for fraction, seeds in ((0.3, 2), (0.5, 1))  # some are unstable with 0.5: that is measured
    ],
    "promises": [
        {"vary": {"fidelity": [{"tolerance": 0.2}]}, "seeds": 8},
        {
            "vary": {"fidelity": [{"tolerance": 0.2, "quantity": "workpiece_contacts"}]},
            "seeds": 4,
        },
    ],
}
"""What is run in each scene beside the physical modulus: reduced moduli, or what is advised."""


def plan_of(points: str) -> dict[str, Any]:
    """A plan without scenes."""
    return {
        "base": {
            "fidelity.youngs_modulus_scale": 1,
            "fidelity.timestep_fraction": 0.64,
            "fidelity.ranks": 1,
        },
        "reference": {
            "vary": {"fidelity.youngs_modulus_scale": [1]},
            "seeds": 4 if points == "promises" else 1,
        },
        "cost_rounds": 0,
        "points": POINTS[points],
    }


def drawn(unit: float, low: float, high: float, spacing: str) -> float:
    """A value of a range from one between 0 and 1, to three digits."""
    if spacing == "even":
        return round_to(low + unit * (high - low), 3)
    return round_to(low * (high / low) ** unit, 3)


def scene_of(row: list[float]) -> dict[str, Any]:
    """The fields of a study for a row of the design."""
    own = {name: drawn(unit, *RANGES[name]) for unit, name in zip(row, RANGES, strict=True)}
    diameter = own["diameter_m"]
    bowl, depth = own["bowl_to_particle"], own["depth_to_particle"]
    workpiece = own["workpiece_to_particle"]
    speed = own["inertial_number"] * math.sqrt(9.81 * depth * diameter)
    rate = speed / diameter
    height = depth + BELOW_TIP
    return {
        "materials.ceramic.youngs_modulus_pa": own["youngs_modulus_pa"],
        "materials.ceramic.density_kg_m3": own["density_kg_m3"],
        "pairs.ceramic-ceramic.friction": own["friction"],
        "pairs.ceramic-steel.friction": own["workpiece_friction"],
        "pairs.ceramic-ceramic.restitution": own["restitution"],
        "pairs.ceramic-steel.restitution": own["restitution"],
        "media.count": round(0.885 * bowl**2 * height),
        "media.radius_mean_m": round_to(diameter / 2, 3),
        "media.radius_std_m": round_to(own["radius_std"] * diameter / 2, 2),
        "bowl.radius_m": round_to(bowl * diameter / 2, 3),
        "bowl.height_m": round_to((height + 4) * diameter, 3),
        "workpiece.shape.radius_m": round_to(workpiece * diameter / 2, 3),
        "workpiece.shape.facet_size_m": round_to(0.23 * diameter, 2),
        "workpiece.shape.facet_length_m": round_to(1.5 * diameter, 2),
        "motion.path.radius_m": round_to((bowl / 2 - workpiece / 2 - GAP) * diameter, 3),
        "motion.immersion_depth_m": round_to(depth * diameter, 3),
        "motion.speed_m_s": round_to(speed, 3),
        "motion.plunge_speed_m_s": round_to(max(0.05, speed), 3),
        "motion.transient_m": diameter,
        "outputs.workpiece_force_hz": round_to(650 * rate, 2),
        "outputs.workpiece_contacts_hz": round_to(60 * rate, 2),
        "outputs.network_hz": round_to(8 * rate, 2),
        "fidelity.filling_timestep_fraction": 0.15 if own["restitution"] < 0.5 else 0.45,
    }


def physical_case(scene: dict[str, Any], base: Case, file: Path) -> tuple[Case, float]:
    """The case of a scene at the physical modulus, and its particle-steps, filling included."""
    plan = Plan.model_validate(
        plan_of("moduli") | {"scenes": {"one": scene}, "points": [], "seeds": 1}
    )
    case = plan_points(plan, file, base).processes[0]
    steps = 0
    for kind in (FILLING, PROCESS):
        built: StudyScene = kind.build(case, None)
        steps += built.steps
    return case, float(steps * case.study.media.count)


def main() -> None:
    """Draw scenes until there are as many as were asked for, and write the plan."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=12, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the design (default: %(default)s)")
    parser.add_argument(
        "--limit",
        type=float,
        default=4e8,
        help="particle-steps at the physical modulus and an inertial number of 0.1, at most",
    )
    parser.add_argument(
        "--points",
        choices=POINTS,
        default="moduli",
        help="what is run in each scene: reduced moduli, or advised settings (default: moduli)",
    )
    parser.add_argument("--out", type=Path, required=True, help="plan to write")
    asked = parser.parse_args()
    project = Project(Path(__file__).parents[2])
    base = project.cases("uhlmann2015")[0]
    design = qmc.Sobol(len(RANGES), seed=asked.seed)
    scenes: dict[str, Any] = {}
    tried = 0
    while len(scenes) < asked.scenes:
        tried += 1
        scene = scene_of(design.random(1)[0].tolist())
        try:
            case, cost = physical_case(scene, base, asked.out)
        except InputError as error:
            print(f"{tried}: {error.problem}")
            continue
        limit = asked.limit * math.sqrt(0.1 / describe(case)["inertial_number"])
        if cost > limit:
            field = "materials.ceramic.youngs_modulus_pa"
            scene[field] = float(f"{scene[field] * (0.97 * limit / cost) ** 2:.2g}")
            if scene[field] < RANGES["youngs_modulus_pa"][0]:
                continue
            case, cost = physical_case(scene, base, asked.out)
        scenes[f"s{asked.seed}-{tried}"] = scene
        numbers = ", ".join(f"{name} {value:.3g}" for name, value in describe(case).items())
        print(f"s{asked.seed}-{tried}: {cost:.2g} particle-steps; {numbers}")
    head = (
        f"# Made by `python benchmarks/scenes --scenes {asked.scenes} --seed {asked.seed} "
        f"--limit {asked.limit:g} --points {asked.points}`:\n# a space-filling design over the "
        "dimensionless numbers of a drag.\n"
    )
    asked.out.write_text(
        head + yaml.safe_dump(plan_of(asked.points) | {"scenes": scenes}, sort_keys=False),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
