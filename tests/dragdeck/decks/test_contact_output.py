"""What LIGGGHTS writes of a mesh wall: the reason for the order of the outputs in a deck."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
from plate import PLATE

from dragdeck.engine.process import find_engine

pytestmark = pytest.mark.engine

PARTICLE = """one particle on the plate

1 atoms

1 atom types

-0.03 0.03 xlo xhi
-0.03 0.03 ylo yhi
-0.01 0.03 zlo zhi

Atoms

1 1 0.006 2500 0.001 0.004 0.00299
"""
DECK = """units si
soft_particles yes
atom_style granular
boundary f f f
newton off
communicate single vel yes
read_data particle.data
neighbor 0.001 bin
fix youngs all property/global youngsModulus peratomtype 1e7
fix poisson all property/global poissonsRatio peratomtype 0.3
fix restitution all property/global coefficientRestitution peratomtypepair 1 0.5
fix friction all property/global coefficientFriction peratomtypepair 1 0.3
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-6
fix plate all mesh/surface file plate.stl type 1
fix wall all wall/gran model hertz tangential history mesh n_meshes 1 meshes plate store_force yes
compute touch all wall/gran/local id force
fix integrate all nve/sphere
{dumps}
run 2
"""
APPLIED = "dump applied all custom 1 applied.dump f_force_wall[3]"
CONTACTS = "dump contacts all local 1 contacts.dump c_touch[6]"


def applied_force(folder: Path, dumps: Sequence[str]) -> float:
    """The force of the wall on the particle, as the last frame has it."""
    (folder / "plate.stl").write_text(PLATE)
    (folder / "particle.data").write_text(PARTICLE)
    (folder / "deck").write_text(DECK.format(dumps="\n".join(dumps)))
    words = [find_engine().path, "-in", "deck"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert float((folder / "contacts.dump").read_text().split()[-1]) > 0.0
    return float((folder / "applied.dump").read_text().split()[-1])


def test_the_stored_force_is_written_if_the_contacts_come_after_it(tmp_path: Path) -> None:
    assert applied_force(tmp_path, [APPLIED, CONTACTS]) > 0.0


def test_the_stored_force_reads_zero_after_the_contacts(tmp_path: Path) -> None:
    """If a later LIGGGHTS writes it, `in_writing_order` is no longer needed."""
    assert applied_force(tmp_path, [CONTACTS, APPLIED]) == 0.0
