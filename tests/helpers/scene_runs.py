"""Made-up runs of scenes, whose drag follows the law of softness."""

import math

import numpy as np
from made_study import plain_study

from dragchain.quantities.document import RunCost
from dragdeck.physics.contact_mechanics import damping_ratio
from dragdeck.records.case import FidelityOfRun
from dragdeck.records.windows import softness
from dragdeck.study.model import Study
from evidence.windows.scene_runs import SceneRun

COST = RunCost(steps=1, wall_time_s=1, cpu_time_s=1, ranks=1, timestep_s=1e-6, axis_speed_m_s=0.1,
               steps_per_m=1e7)  # fmt: skip
LAW = {"stiffness": 80.0, "damping": 40.0, "spread": -1.5}


PER_SOFTNESS = 0.1


def made_run(
    scene: int, scale: float, seed: int, *, per_softness: float = PER_SOFTNESS,
    packing: float = 0.0, speed: float = 1.0,
) -> SceneRun:  # fmt: skip
    """A run whose drag is 2 N at the physical modulus, and by the law of softness otherwise."""
    rng = np.random.default_rng([scene, seed, round(1 / scale)])
    kappa = 1e4 * (1 + scene)
    softer = softness(kappa * scale ** (2 / 3)) - softness(kappa)
    mean = 2.0 * math.exp(packing * rng.normal() - per_softness * softer)
    mean *= 10.0 if speed != 1.0 else 1.0
    restitution, spread, fraction = 0.4 + 0.02 * scene, 0.02 * (scene % 3), 0.3 + 0.05 * (seed % 3)
    u = fraction * (kappa * scale ** (2 / 3)) ** -0.25
    squared = LAW["stiffness"] * u**2 + LAW["damping"] * damping_ratio(restitution) * u
    return SceneRun(
        study_name="made", run=f"{scene}-{scale}-{seed}", bed=None, complete=True, cost=COST,
        versions={"engine": "3.8.0"}, started=f"2026-01-{10 + scene}T00:00:00+00:00",
        study=Study.model_validate(plain_study({
            "seed": seed, "pairs.ceramic-ceramic.restitution": restitution,
            "media.radius_mean_m": 1.0, "media.radius_std_m": spread})),
        fidelity=FidelityOfRun(name="made", youngs_modulus_scale=scale, timestep_fraction=fraction,
                               speed_factor=speed, skin_m=1e-4, ranks=1),
        numbers={"stiffness_number": kappa, "particles": 300.0 + seed,
                 "workpiece_to_particle": 1.0 + scene, "depth_to_particle": 4.0},
        arc_m=1.0, block_m=0.1,
        blocks={"drag_mean": tuple(-mean * (1 + 0.05 * rng.normal(size=40))),
                "workpiece_contacts": (3.0, None)},
        stability_number=math.sqrt(squared) * math.exp(LAW["spread"] * spread),
    )  # fmt: skip
