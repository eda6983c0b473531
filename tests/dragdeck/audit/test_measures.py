"""Measures of dumps that were made by hand, against values counted by hand."""

import json
import math
from pathlib import Path

import audit_decks
import numpy as np
import pytest
from audit_decks import DECK, without

from dragdeck.audit.command import audit
from dragdeck.audit.run_log import RunLog
from dragdeck.cli import main
from dragdeck.physics.contact_mechanics import damping_ratio
from dragdeck.script.facts import Facts
from dragdeck.script.flow import read_script

COLUMNS = "id type x y z vx vy vz fx fy fz omegax omegay omegaz radius"
R = 0.002
M = 2500 * 4 / 3 * math.pi * R**3
RULES = "DK2"


def sphere(
    number: int, x: float, z: float = 0.01, v: float = 0.0, spin: float = 0.0, y: float = 0.02
) -> str:
    return f"{number} 1 {x} {y} {z} {v} 0 0 0 0 {-M * 9.81} 0 0 {spin} {R}"


def dump(folder: Path, *frames: list[str], name: str = "spheres", columns: str = COLUMNS) -> None:
    kind = "ATOMS" if columns == COLUMNS else "ENTRIES"
    for number, rows in enumerate(frames):
        step = 1000 * number
        head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{len(rows)}\n"
        head += f"ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: {kind} {columns}\n"
        text = head + "".join(f"{row}\n" for row in rows)
        (folder / "post" / f"{name}_{step}.dump").write_text(text)


def report(folder: Path, capsys: pytest.CaptureFixture[str], *more: str, text: str = DECK) -> dict:  # type: ignore[type-arg]
    file = audit_decks.write(folder, text)
    pattern = str(folder / "post" / "spheres_*.dump")
    main(["audit", str(file), "--dump", pattern, "--format", "json", *more])
    return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]


def hits(document: dict, rule: str = "DK2") -> dict:  # type: ignore[type-arg]
    return {f["rule"]: f["values"] for f in document["findings"] if f["rule"].startswith(rule)}


def settled(folder: Path, *rows: str) -> None:
    (folder / "post").mkdir(exist_ok=True)
    dump(folder, list(rows), list(rows))


def test_overlaps_of_two_spheres_and_with_a_wall(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settled(tmp_path, sphere(1, 0.01), sphere(2, 0.01 + 1.8 * R))
    assert hits(report(tmp_path, capsys)) == {"DK201": {"overlap": pytest.approx(0.2)}}
    settled(tmp_path, sphere(1, 0.4 * R), sphere(2, 0.02))
    assert hits(report(tmp_path, capsys)) == {"DK201": {"overlap": pytest.approx(0.6)}}
    settled(tmp_path, sphere(1, 0.01), sphere(2, 0.01 + 1.95 * R))
    document = report(tmp_path, capsys)
    assert hits(document) == {} and document["known"]["contacts of"] == "particles and walls"
    without_walls = (
        without(DECK, "wall/gran") + "fix w all wall/gran model hertz mesh n_meshes 1 meshes none\n"
    )
    settled(tmp_path, sphere(1, 0.4 * R))
    document = report(tmp_path, capsys, text=without_walls)
    assert hits(document) == {} and "lower bound" in document["known"]["contacts of"]


def test_the_stability_number_is_that_of_the_formula(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overlap = 0.05 * R
    settled(tmp_path, sphere(1, 0.01), sphere(2, 0.01 + 2 * R - overlap))
    modulus, shear = 5e6 / (2 * 0.91), 5e6 / (2 * 1.3) / (2 * 1.7)
    size, ratio = math.sqrt(R / 2 * overlap), damping_ratio(0.3)
    stiffness = np.array([2 * modulus, 8 * shear]) * size
    damping = 2 * math.sqrt(5 / 6) * ratio * np.sqrt(stiffness * M / 2)
    weights = 2.5e-9 * stiffness + 1e-4 * damping
    largest = max(2 * weights[0], 7 * weights[1]) / M  # along the line; across, with rotation
    number = report(tmp_path, capsys)["known"]["stability number"]
    assert number == pytest.approx(math.sqrt(largest) / 2, rel=1e-3)
    slow = DECK.replace("timestep 5e-5", "timestep 5e-3")
    assert hits(report(tmp_path, capsys, text=slow))["DK204"]["stability_number"] > 1


def test_a_speed_above_every_cause(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "post").mkdir()
    fall = math.sqrt(2 * 9.81 * 0.06)
    for speed, hit in ((0.99 * fall, False), (1.01 * fall, True)):
        dump(tmp_path, [sphere(1, 0.01)], [sphere(1, 0.01, v=speed)], [sphere(1, 0.01)])
        values = hits(report(tmp_path, capsys)).get("DK202")
        expected = {"speed_m_s": speed, "limit_m_s": fall}
        assert values == (pytest.approx(expected, rel=1e-5) if hit else None)


def test_missing_particles_and_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "post").mkdir()
    both = [sphere(1, 0.01), sphere(2, 0.03)]
    dump(tmp_path, both, both[:1])
    assert hits(report(tmp_path, capsys)) == {"DK203": {"missing": 1}}
    deleting = DECK.replace("run 8000", "delete_atoms group all\nrun 8000")
    assert hits(report(tmp_path, capsys, text=deleting)) == {}
    dump(tmp_path, both, [both[0], both[1].replace("0.03", "nan", 1)])
    messages = [f["values"] for f in report(tmp_path, capsys)["findings"]]
    assert messages == [{"rows": 1}, {"missing": 1}]


@pytest.mark.parametrize(
    ("column", "word"),
    [("radius", "0"), ("radius", "1e300"), ("x", "-1e300"), ("id", "nan"), ("type", "inf"),
     ("omegax", "1e300"), ("fx", "nan"), ("vz", "-inf")],
)  # fmt: skip
def test_rows_that_have_diverged_are_counted_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], column: str, word: str
) -> None:
    words = sphere(2, 0.03).split()
    words[COLUMNS.split().index(column)] = word
    (tmp_path / "post").mkdir()
    dump(tmp_path, [sphere(1, 0.01), sphere(2, 0.03)], [sphere(1, 0.01), " ".join(words)])
    values = [f["values"] for f in report(tmp_path, capsys)["findings"] if f["rule"] == "DK203"]
    assert values == [{"rows": 1}, {"missing": 1}]


def test_types_and_columns_that_the_script_does_not_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = sphere(2, 0.01 + 1.99 * R).replace("2 1 ", "2 7 ", 1)
    settled(tmp_path, sphere(1, 0.01), odd)
    names, pairs = "c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5]", tmp_path / "post/pairs_*.dump"
    for columns, row in ((f"{names} c_pairs[6]", "1 2 1 0 0"), (names, "1 2 1 0")):
        dump(tmp_path, [row], [row], name="pairs", columns=columns)
        document = report(tmp_path, capsys, "--contacts", str(pairs))
        assert "stability number" not in document["known"]
    assert "other columns" in document["not_applied"][-1]["why"]


def test_a_dump_that_leaves_particles_out_says_nothing_of_losses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "post").mkdir()
    dump(tmp_path, [sphere(1, 0.01), sphere(2, 0.03)], [sphere(1, 0.01)])
    text = DECK.replace("run 8000", "dump_modify spheres thresh x > 0\nrun 8000")
    document = report(tmp_path, capsys, text=text)
    assert hits(document) == {}
    assert [skip["rule"] for skip in document["not_applied"]] == ["DK203"]


def test_walls_of_a_group_and_sides_of_walls(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "post").mkdir()
    dump(tmp_path, [sphere(1, 0.01)], [sphere(1, -2 * R)], [sphere(1, -2 * R)])
    assert hits(report(tmp_path, capsys)) == {"DK203": {"through": 1}}
    assert hits(report(tmp_path, capsys, text=DECK.replace("boundary f f", "boundary p f"))) == {}
    document = report(tmp_path, capsys, text=DECK.replace("wall0 all", "wall0 some"))
    assert hits(document) == {} and document["known"]["contacts of"].startswith("without wall0")


def test_spin_and_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settled(tmp_path, sphere(1, 0.01, spin=408), sphere(2, 0.03), sphere(3, 0.02))
    assert hits(report(tmp_path, capsys))["DK205"] == {"spin_rad_s": 408, "count": 1}
    settled(tmp_path, sphere(1, 0.01, v=0.1))
    assert hits(report(tmp_path, capsys)) == {"DK206": {"energy_j_kg": pytest.approx(0.005)}}
    turn = "fix turn all move/mesh mesh p rotate origin 0 0 0 axis 0 0 1 period 1\n"
    driven = DECK.replace("run 8000", f"{turn}run 8000")
    dump(tmp_path, *([sphere(1, 0.01, v=v)] for v in (0.1, 0.1, 0.1, 0.1, 0.1, 0.1)))
    assert hits(report(tmp_path, capsys, text=driven)) == {}
    dump(tmp_path, *([sphere(1, 0.01, v=v)] for v in (0.1, 0.1, 0.1, 0.1, 0.2, 0.2)))
    assert hits(report(tmp_path, capsys, text=driven)) == {"DK206": {"ratio": pytest.approx(4)}}


@pytest.mark.parametrize(("tangential", "above"), [(0.5, None), (0.6, 1 / 6)])
def test_contacts_above_coulombs_limit_and_closure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tangential: float, above: float | None
) -> None:
    settled(tmp_path, sphere(1, 0.01), sphere(2, 0.01 + 1.99 * R))
    names = "c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5] c_pairs[6]"
    force = f"1 2 -1e-3 {1e-3 * tangential} 0"
    dump(tmp_path, [force], [force], name="pairs", columns=names)
    pairs = str(tmp_path / "post" / "pairs_*.dump")
    document = report(tmp_path, capsys, "--contacts", pairs)
    messages = [f for f in document["findings"] if f["rule"] == "DK207"]
    values = {key: value for f in messages for key, value in f["values"].items()}
    assert values.get("above") == (None if above is None else pytest.approx(above))
    assert values["error"] == pytest.approx(1)  # the dump says that only weight acts
    assert document["known"]["contacts above Coulomb's limit"] == f"{2 if above else 0} of 2"


LOG = """INFO: Particle insertion ins: inserted 10 particle templates (mass 1.0) at step 1
Step Atoms KinEng mass[2]
       0       10  1.0  0
INFO: Particle insertion ins: inserted 5 particle templates (mass 1.0) at step 50
     100       15  1.0  0
     200       12  1.0  2
Loop time of 1.0 on 1 procs for 200 steps with 12 atoms
"""


def test_the_balance_of_a_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log"
    log.write_text(LOG + "WARNING: Less insertions than requested\nDangerous builds = 3\n")
    file = str(audit_decks.write(tmp_path))
    outlet = "fix mass all massflow/mesh mesh p delete_atom yes\n"
    meters = Facts(read_script(Path(file), text=outlet))
    balance = RunLog(log, meters)
    assert (balance.expected, balance.counted, balance.last) == (15, 2, 12)
    assert main(["audit", file, "--log", str(log), "--format", "json"]) == 1
    findings = json.loads(capsys.readouterr().out)["findings"]
    assert [(f["rule"], f["values"]) for f in findings] == [
        ("DK208", {"lines": 1}), ("DK208", {"builds": 3}), ("DK203", {"missing": 3}),
    ]  # fmt: skip
    log.write_text("ERROR: Lost atoms\n")
    assert main(["audit", file, "--log", str(log)]) == 1
    assert "DK208 error: LIGGGHTS ended with ERROR: Lost atoms" in capsys.readouterr().out


def test_exit_status_and_choice_of_rules(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = audit_decks.write(tmp_path)
    assert audit(file) == 0 and "no findings" in capsys.readouterr().out
    file.write_text(DECK.replace("model hertz tangential history\n", "model hertz\n", 1))
    assert audit(file) == 1 and f"{file}:15: DK101 error" in capsys.readouterr().out
    assert audit(file, ignore="DK101") == 0
    assert audit(file, select="DK104,DK105") == 0
    assert audit(tmp_path / "none") == 2 and audit(None) == 2 and audit(file, select="DK9") == 2
    assert audit(file, dump=["none_*.dump"]) == 2
    capsys.readouterr()
    assert audit(None, explain="DK104") == 0
    assert "408 rad/s" in capsys.readouterr().out


def test_constants_from_the_script_of_a_restart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settled(tmp_path, sphere(1, 0.01), sphere(2, 0.01 + 1.95 * R))
    first = tmp_path / "in.first"
    first.write_text(DECK)
    second = without(DECK, "template|distribution|insert|^ |create_box").replace(
        "region box", "read_restart a.restart\nregion box"
    )
    second = second.replace("dump spheres", "#").replace("run 1\n", "reset_timestep 0\nrun 1\n")
    assert "stability number" not in report(tmp_path, capsys, text=second)["known"]
    after = report(tmp_path, capsys, "--after", str(first), text=second)
    assert after["known"]["stability number"] > 0
    assert {f["file"] for f in after["findings"]} <= {str(tmp_path / "in.deck")}
