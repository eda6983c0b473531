"""A few spheres of one material on LIGGGHTS, from where they are placed, and a plane z = 0."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from paths import ROOT

from dragchain.run.run_parts import iter_frames
from dragdeck.decks.deck import Liquid
from dragdeck.decks.outputs import load_outputs
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.dumps.frame import Frame
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run
from dragdeck.study.contact_law import Pair
from dragdeck.study.workpiece import Material
from evidence.placed import ExactPlane
from evidence.verification.experiment import PlacedSphere, experiment


def frames_of(
    folder: Path, material: Material, pairs: Mapping[tuple[int, int], Pair],
    bodies: Sequence[PlacedSphere], *, liquid: Liquid | None = None, **settings: Any,
) -> list[Frame]:  # fmt: skip
    """Frames of the spheres; pairs are of types, 1 of the spheres and 2 of the plane."""
    scene = experiment(
        "placed", 1, "Placed spheres", [], types=[("particle", material), ("plane", material)],
        pairs=pairs, bodies=bodies, walls=[ExactPlane("floor", 2, "zplane 0.0")], series="",
        vary="", contacts=[], steps_per_contact=1, **settings,
    )  # fmt: skip
    wet = replace(scene, deck=replace(scene.deck, liquid=liquid)) if liquid else scene
    write_run(wet, folder, environment(ROOT / "templates"))
    assert run(folder, silent).state == "complete"
    return list(iter_frames(folder, load_outputs(folder)["bodies"]))
