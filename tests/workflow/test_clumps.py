"""Clumps of spheres on LIGGGHTS: one sphere, free rotation, rest, resumption, a whole study."""

import math
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_study import Made
from scipy.spatial.transform import Rotation

from dragchain.run.run_parts import iter_frames
from dragchain.tables.bodies import Bodies
from dragchain.tables.columns import CENTRE, ORIENTATION, SPIN, VELOCITY
from dragdeck.decks.deck import Body, data_file
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.dumps.frame import Frame
from dragdeck.engine.process import find_engine
from dragdeck.physics.contact_mechanics import pull_off_force
from dragdeck.project import Project
from dragdeck.records.case import FillingCase
from dragdeck.scenes.filling import filling_scene

pytestmark = [pytest.mark.engine, pytest.mark.slow]

ROD = {"kind": "cylinder", "aspect": 1.4, "cut_deg": 20, "spheres": 3}
BALL = {"material": "ceramic", "radius_mean_m": 3e-3, "fraction": 0.5}
FAST = {
    "youngs_modulus_scale": 1e-3,
    "timestep_fraction": 0.3,
    "filling_timestep_fraction": 0.3,
    "ranks": 1,
}


class Filled:
    """The filling of a study in a folder, and its frames of bodies."""

    def __init__(
        self, made: Made, folder: Path, templates: Path, media: dict[str, Any], **more: Any
    ) -> None:
        case = made({"media": media, "fidelity": FAST, "bowl": {"radius_m": 0.02}} | more)
        self.scene = filling_scene(case)
        assert isinstance(self.scene.case, FillingCase)
        self.case, self.folder = self.scene.case, folder
        self.columns: tuple[str, ...] = ()
        self.text = deck_text(self.scene, environment(templates))
        for name, text in self.scene.texts().items():
            (folder / name).write_text(text)

    def run(self, text: str, *words: str) -> str:
        """Run a script and return what it prints."""
        (self.folder / "in.liggghts").write_text(text)
        command = [find_engine().path, "-in", "in.liggghts", "-log", "none", *words]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0 and "DRAGDECK END" in done.stdout, done.stdout[-2000:]
        return done.stdout

    def frames(self) -> list[Frame]:
        """Frames of spheres of ``particles``."""
        (particles,) = (one for one in self.scene.deck.outputs if one.name == "particles")
        part = particles.as_part()
        part = part.model_copy(update={"columns": (*part.columns, *self.columns)})
        return list(iter_frames(self.folder, part))


Fill = Callable[..., Filled]


@pytest.fixture
def fill(made: Made, project: Project, tmp_path: Path) -> Fill:
    """The filling of the small study with these media."""
    return lambda media, **more: Filled(made, tmp_path, project.templates, media, **more)


def _one_class(count: int) -> dict[str, Any]:
    return {"count": count, "radius_mean_m": 3e-3, "radius_std_m": 0.0, "shape": ROD}


def _free(text: str, motion: str, steps: int, every: int) -> str:
    """A filling whose particles start with this motion, written every so many steps."""
    text = text.replace("vel constant 0.0 0.0 0.0", motion)
    dump = re.search(r"dump write_particles all custom \d+ (.*)", text)
    assert dump is not None
    run = f"dump write_particles all custom {every} {dump[1]}\nrun {steps}\n"
    return re.sub(r"variable ratio equal.*(?=# This line marks)", run, text, flags=re.DOTALL)


def test_a_free_clump_keeps_energy_and_momentum(fill: Fill) -> None:
    """Gravity moves its centre of mass alone; a quarter of a second, about 25 turns."""
    filled = fill(_one_class(1))
    text = filled.text.replace("fix gravity all gravity 9.81", "fix gravity all gravity 0.0")
    filled.run(_free(text, "vel constant 0.01 -0.02 0.03 omega constant 100.0 300.0 500.0",
                     20000, 1000))  # fmt: skip
    frames = [Bodies(filled.case).frame(one) for one in filled.frames() if one.rows]
    assert len(frames) > 15
    (of_run,) = filled.case.bodies
    inertia = np.array(of_run.inertia_kg_m2)
    energy, momentum, speed = [], [], []
    for frame in frames:
        turned = Rotation.from_quat(frame.vectors(*ORIENTATION)[0], scalar_first=True).as_matrix()
        tensor, spin = turned @ np.diag(inertia) @ turned.T, frame.vectors(*SPIN)[0]
        energy.append(spin @ tensor @ spin / 2)
        momentum.append(tensor @ spin)
        speed.append(frame.vectors(*VELOCITY)[0])
    assert np.ptp(np.array(frames[0].vectors(*ORIENTATION) - frames[5].vectors(*ORIENTATION))) > 0.1
    # the spin is that of half a step before the orientation
    np.testing.assert_allclose(energy, energy[0], rtol=2e-3)
    np.testing.assert_allclose(
        momentum, np.tile(momentum[0], (len(frames), 1)), atol=2e-3 * np.linalg.norm(momentum[0])
    )
    np.testing.assert_allclose(speed, np.tile([0.01, -0.02, 0.03], (len(frames), 1)), atol=1e-9)
    moved = frames[-1].vectors(*CENTRE)[0] - frames[0].vectors(*CENTRE)[0]
    took = (frames[-1].step - frames[0].step) * filled.case.timestep_s
    np.testing.assert_allclose(moved, took * np.array([0.01, -0.02, 0.03]), atol=1e-9)


def test_a_clump_of_one_sphere_is_the_sphere(fill: Fill) -> None:
    """It falls, spins and rebounds as the sphere that starts where it does."""
    rod = {"material": "ceramic", "radius_mean_m": 3e-3, "fraction": 0.5, "shape": ROD}
    filled = fill({"count": 2, "fractions_of": "number", "classes": {"ball": BALL, "rod": rod},
                   "material": None, "radius_mean_m": None, "radius_std_m": 0})  # fmt: skip
    text = re.sub(r"(fix clumps?_2 |if .*fix insert_2 ).*\n", "", filled.text)
    text = _free(text, "vel constant 0.05 0.02 -0.5 omega constant 20.0 40.0 10.0", 30000, 100)
    filled.run(text)
    clump = [one.take(one.ids("particle_id") == 1) for one in filled.frames() if one.rows]
    start = clump[0]
    side = filled.scene.deck.bowl.reach_m * 2  # type: ignore[attr-defined]
    vectors = [tuple(start.vectors(*names)[0].tolist()) for names in (CENTRE, VELOCITY, SPIN)]
    types = len(filled.scene.deck.materials.names)
    sphere = Body(1, 3e-3, 2656.0, *vectors)
    box = ((-side, side), (-side, side), (-3e-3, 1.0))
    (filled.folder / "particles.data").write_text(data_file("one", types, box, [sphere]))
    for file in filled.folder.glob("particles.1.*"):
        file.unlink()
    text = re.sub(r"(fix clumps?_1 |if .*fix insert_1 |region space).*\n", "", text)
    text = text.replace("fix integrate all multisphere", "fix integrate all nve/sphere")
    text = text.replace("ke/multisphere", "ke").replace("erotate/multisphere", "erotate/sphere")
    filled.run(text.replace(" id_multisphere", " id"))
    plain = [one for one in filled.frames() if one.rows]
    shift = start.step - plain[0].step
    vertical = [float(one.columns["vz_m_s"][0]) for one in plain]
    lowest = int(np.argmin(vertical))
    assert vertical[lowest] < -0.3 and max(vertical[lowest:]) > 0.2  # it rebounds
    pairs = zip(plain, clump, strict=False)
    for one, other in pairs:
        assert one.step + shift == other.step
        for names in (CENTRE, VELOCITY, SPIN):
            np.testing.assert_allclose(one.vectors(*names), other.vectors(*names), rtol=1e-4,
                                       atol=1e-7 if names is CENTRE else 1e-4)  # fmt: skip


WATER = {"compound": {"density_kg_m3": 1000.0}}
SUBMERGED = 1 - 1000 / 2656


def test_a_submerged_clump_sinks_by_its_reduced_weight(fill: Fill) -> None:
    filled = fill(_one_class(1), **WATER)
    filled.run(_free(filled.text, "vel constant 0.0 0.0 0.3 omega constant 90.0 50.0 70.0",
                     3500, 500))  # fmt: skip
    frames = [Bodies(filled.case).frame(one) for one in filled.frames() if one.rows]
    took = (frames[-1].step - frames[0].step) * filled.case.timestep_s
    speed = frames[-1].vectors(*VELOCITY)[0] - frames[0].vectors(*VELOCITY)[0]
    np.testing.assert_allclose(speed, [0, 0, -SUBMERGED * 9.81 * took], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(("more", "weight"), [({}, 1.0), (WATER, SUBMERGED)], ids=["dry", "wet"])
def test_a_bed_at_rest_weighs_what_it_should(
    more: dict[str, Any], weight: float, fill: Fill
) -> None:
    filled = fill(_one_class(45), **more)
    filled.columns = ("floor_n", "side_n")
    script = filled.text.replace(
        " id_multisphere", " id_multisphere f_force_floor[3] f_force_side[3]"
    )
    # the bed sways on its soft contacts: forces are means over a time after it has settled
    script = script.replace("particles all custom 1 ", "particles all custom 20 ")
    filled.run(script.replace("\nrun 0\n", "\nrun 8000\n"))
    frames, (of_run,) = filled.frames(), filled.case.bodies
    assert len(frames) > 300
    assert {one.rows for one in frames} == {45 * len(of_run.radii_m)}
    carried = np.mean([one.vectors("floor_n", "side_n").sum() for one in frames])
    assert carried == pytest.approx(weight * 45 * of_run.mass_kg * 9.81, rel=1e-3)
    assert np.abs(Bodies(filled.case).frame(frames[-1]).vectors(*VELOCITY)).max() < 1e-3


def test_a_resumed_run_goes_on_with_the_same_bodies(fill: Fill) -> None:
    """Those in flight to the last bit; contacts are evaluated anew, and then differ slightly."""
    filled = fill(_one_class(45))
    motion = "vel constant 0.0 0.0 -0.1 omega constant 50.0 60.0 70.0"
    script = re.sub(r"restart \d+", "restart 3000", _free(filled.text, motion, 4000, 500))
    filled.run(script)
    whole = [one for one in filled.frames() if one.step > 3000]
    (filled.folder / "particles.1.bin").unlink()
    script = script.replace("run 4000", "run 4000 upto")
    filled.run(script, "-var", "resume", "1", "-var", "from", "checkpoint.3000.restart")
    resumed = [one for one in filled.frames() if one.step > 3000]
    assert [one.step for one in resumed] == [one.step for one in whole] == [3500, 4000]
    for one, other in zip(whole, resumed, strict=True):
        bodies, again = (Bodies(filled.case).frame(each) for each in (one, other))
        apart = np.linalg.norm(bodies.vectors(*CENTRE) - again.vectors(*CENTRE), axis=1)
        turned = np.abs(bodies.vectors(*ORIENTATION) - again.vectors(*ORIENTATION)).max(axis=1)
        assert apart.max() < 1e-5 and turned.max() < 0.01
        assert np.count_nonzero(apart == 0) > 20


LIFT = """
variable start equal step
variable settled string ${start}
variable pull equal 9.81*(1-20*(step-${settled})/160000)
variable block loop 200
label lift
run ${next_check} upto
variable moving string ${ratio}
variable now string ${pull}
if "${moving} > 1" then "jump SELF away"
next block
jump SELF lift
label away
print "LIFTED AT ${now}"
"""
"""Gravity falls by 0.11 g per check; a body rolls until it leaves the floor, and then flies."""


def test_a_cohesive_clump_opens_at_the_sum_of_its_tensions(fill: Fill) -> None:
    """A body touches the floor with two spheres and is pulled off slowly."""
    media = _one_class(1) | {"shape": {"kind": "cylinder", "aspect": 1.4, "spheres": 2}}
    filled = fill(media, **{"pairs.ceramic-steel.cohesion_j_m3": 7e7})
    deck, (of_run,) = filled.scene.deck, filled.case.bodies
    law = deck.materials  # type: ignore[attr-defined]
    (cohesion,) = (one.values for one in law.law.tables if one.engine == "cohesionEnergyDensity")
    modulus = 1 / sum(
        (1 - nu**2) / modulus
        for nu, modulus in zip(law.poissons_ratios, law.youngs_moduli_pa, strict=True)
    )
    tension = sum(
        pull_off_force(2 * math.pi * cohesion[1] * radius, modulus, radius)
        for radius in of_run.radii_m
    )
    text = filled.text.replace("gravity all gravity 9.81 ", "gravity all gravity v_pull ")
    text = text.replace("fix gravity", "variable pull equal 9.81\nfix gravity")
    marker = 'print "DRAGDECK SETTLED'
    printed = filled.run(text.replace(marker, LIFT + marker))
    pull = -float(re.findall(r"LIFTED AT (\S+)", printed)[-1]) * of_run.mass_kg
    assert pull == pytest.approx(tension, rel=0.03)
