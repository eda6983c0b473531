"""Measures of dumps that were made by hand, against values counted by hand."""

import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from audit_decks import DECK, cases, edited, without, write

from dragdeck.audit.command import audit
from dragdeck.cli import main
from dragdeck.physics.contact_mechanics import damping_ratio

COLUMNS = "id type x y z vx vy vz fx fy fz omegax omegay omegaz radius"
R = 0.002
M = 2500 * 4 / 3 * math.pi * R**3
REST = [(1, 0.01, 0.01, 0, 0), (2, 0.03, 0.01, 0, 0)]


def rows(spheres: list[tuple[float, ...]]) -> list[str]:
    return [f"{n} 1 {x} 0.02 {z} {v} 0 0 0 0 {-M * 9.81} 0 0 {spin} {R}"
            for n, x, z, v, spin in spheres]  # fmt: skip


def dump(folder: Path, *frames: list[str], name: str = "spheres", columns: str = COLUMNS) -> None:
    (folder / "post").mkdir(exist_ok=True)
    kind = "ATOMS" if columns == COLUMNS else "ENTRIES"
    for number, lines in enumerate(frames):
        step = 1000 * number
        head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{len(lines)}\n"
        head += f"ITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: {kind} {columns}\n"
        text = head + "".join(f"{line}\n" for line in lines)
        (folder / "post" / f"{name}_{step}.dump").write_text(text)


def report(
    folder: Path, capsys: pytest.CaptureFixture[str], *more: str, text: str = DECK
) -> dict[str, Any]:
    file, pattern = str(write(folder, text)), str(folder / "post" / "spheres_*.dump")
    main(["audit", file, "--dump", pattern, "--format", "json", *more])
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def hits(document: dict[str, Any]) -> dict[str, dict[str, float]]:
    """The numbers of the findings on a run, by rule."""
    values: dict[str, dict[str, float]] = defaultdict(dict)
    for finding in document["findings"]:
        if finding["rule"] >= "DK2":
            values[finding["rule"]] |= finding["values"]
    return values


@pytest.mark.parametrize("case", cases("frames"), ids=lambda case: case["id"])
def test_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str], case: dict[str, Any]) -> None:
    dump(tmp_path, *map(rows, case["frames"]))
    text = edited(case.get("edits", ()), case.get("before", ""))
    document = report(tmp_path, capsys, text=text)
    found = hits(document)
    assert found.keys() == case["finds"].keys()
    for rule, numbers in case["finds"].items():
        assert {name: found[rule][name] for name in numbers} == pytest.approx(numbers, rel=1e-5)
    assert document["known"]["contacts of"] == case.get("scope", "particles and walls")
    skipped = [each["rule"] for each in document["not_applied"] if each["rule"] == "DK203"]
    assert skipped == ([case["unknown"]] if "unknown" in case else [])


def test_the_stability_number_is_that_of_the_formula(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    overlap = 0.05 * R
    scene = rows([(1, 0.01, 0.01, 0, 0), (2, 0.01 + 2 * R - overlap, 0.01, 0, 0)])
    dump(tmp_path, scene, scene)
    modulus, shear = 5e6 / (2 * 0.91), 5e6 / (2 * 1.3) / (2 * 1.7)
    size, ratio = math.sqrt(R / 2 * overlap), damping_ratio(0.3)
    stiffness = np.array([2 * modulus, 8 * shear]) * size
    damping = 2 * math.sqrt(5 / 6) * ratio * np.sqrt(stiffness * M / 2)
    weights = 2.5e-9 * stiffness + 1e-4 * damping
    largest = max(2 * weights[0], 7 * weights[1]) / M  # along the line; across, with rotation
    number = report(tmp_path, capsys)["known"]["stability number"]
    assert number == pytest.approx(math.sqrt(largest) / 2, rel=1e-3)
    slow = report(tmp_path, capsys, text=DECK.replace("timestep 5e-5", "timestep 5e-3"))
    assert hits(slow)["DK204"]["stability_number"] > 1
    first, later = (
        tmp_path / "in.first",
        without(DECK, "template|distribution|insert|^ |create_box"),
    )
    first.write_text(DECK)
    later = edited(["region box => read_restart a\nregion box", "dump spheres => #",
                    "run 1\n => reset_timestep 0\nrun 1\n"],
                   text=without(DECK, "template|distribution|insert|^ |create_box"))  # fmt: skip
    assert "stability number" not in report(tmp_path, capsys, text=later)["known"]
    after = report(tmp_path, capsys, "--after", str(first), text=later)
    assert after["known"]["stability number"] == number
    assert {finding["file"] for finding in after["findings"]} <= {str(tmp_path / "in.deck")}


@pytest.mark.parametrize(
    ("column", "word"),
    [("radius", "0"), ("radius", "1e300"), ("x", "-1e300"), ("id", "nan"), ("type", "inf"),
     ("omegax", "1e300"), ("fx", "nan"), ("vz", "-inf")],
)  # fmt: skip
def test_rows_that_have_diverged_are_counted_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], column: str, word: str
) -> None:
    scene = rows(REST)
    words = scene[1].split()
    words[COLUMNS.split().index(column)] = word
    dump(tmp_path, scene, [scene[0], " ".join(words)])
    values = hits(report(tmp_path, capsys))["DK203"]
    assert (values["rows"], values["missing"]) == (1, 1)


def test_a_second_dump_of_a_group_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dump(tmp_path, rows(REST), rows(REST), rows(REST))
    dump(tmp_path, rows(REST[:1]), rows(REST[:1]), name="upper")
    document = report(tmp_path, capsys, "--dump", str(tmp_path / "post" / "*.dump"))
    assert hits(document) == {} and document["known"]["frames left out"] == 2


def test_types_and_columns_that_the_script_does_not_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = rows([REST[0], (2, 0.01 + 1.99 * R, 0.01, 0, 0)])
    scene[1] = scene[1].replace("2 1 ", "2 7 ", 1)
    dump(tmp_path, scene, scene)
    names, pairs = "c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5]", tmp_path / "post/pairs_*.dump"
    for columns, row in ((f"{names} c_pairs[6]", "1 2 1 0 0"), (names, "1 2 1 0")):
        dump(tmp_path, [row], [row], name="pairs", columns=columns)
        document = report(tmp_path, capsys, "--contacts", str(pairs))
        assert "stability number" not in document["known"]
    assert "other columns" in document["not_applied"][-1]["why"]


@pytest.mark.parametrize(("tangential", "above"), [(0.5, None), (0.6, 1 / 6)])
def test_contacts_above_coulombs_limit_and_closure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], tangential: float, above: float | None
) -> None:
    scene = rows([REST[0], (2, 0.01 + 1.99 * R, 0.01, 0, 0)])
    dump(tmp_path, scene, scene)
    names = "c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5] c_pairs[6]"
    force = f"1 2 -1e-3 {1e-3 * tangential} 0"
    dump(tmp_path, [force], [force], name="pairs", columns=names)
    pairs = str(tmp_path / "post" / "pairs_*.dump")
    document = report(tmp_path, capsys, "--contacts", pairs)
    values = hits(document)["DK207"]
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
    outlet = edited(before="fix mass all massflow/mesh mesh p delete_atom yes")
    for text, missing, counted in ((DECK, 3, 0), (outlet, 1, 2)):
        main(["audit", str(write(tmp_path, text)), "--log", str(log), "--format", "json"])
        found = hits(json.loads(capsys.readouterr().out))
        balance = {"missing": missing, "there": 15, "counted": counted, "last": 12}
        assert found == {"DK208": {"lines": 1, "builds": 3}, "DK203": balance}
    log.write_text("ERROR: Lost atoms\n")
    assert main(["audit", str(write(tmp_path)), "--log", str(log)]) == 1
    assert "DK208 error: LIGGGHTS ended with ERROR: Lost atoms" in capsys.readouterr().out


def test_exit_status_and_choice_of_rules(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path)
    assert audit(file) == 0 and "no findings" in capsys.readouterr().out
    write(tmp_path, DECK.replace("model hertz tangential history\n", "model hertz\n", 1))
    assert audit(file) == 1 and f"{file}:15: DK101 error" in capsys.readouterr().out
    assert [audit(file, ignore="DK101"), audit(file, select="DK104,DK105")] == [0, 0]
    assert [audit(tmp_path / "none"), audit(None), audit(file, select="DK9")] == [2, 2, 2]
    assert audit(file, dump=["none_*.dump"]) == 2
    capsys.readouterr()
    assert audit(None, explain="DK104") == 0
    assert "408 rad/s" in capsys.readouterr().out


WITHOUT_RADIUS = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n0\nITEM: BOX BOUNDS ff ff ff\n" + (
    "0 1\n" * 3 + "ITEM: ATOMS id x y z\n"
)


@pytest.mark.parametrize(
    ("name", "text", "words", "says"),
    [
        ("study.yaml", "title: a\nseed: 1\n", [], "no command of LIGGGHTS"),
        ("part.stl", "solid a\nendsolid a\n", [], "no command of LIGGGHTS"),
        ("log", DECK, ["--log"], "no log of LIGGGHTS"),
        ("log", "", ["--log"], "no log of LIGGGHTS"),
        ("", "", ["--log"], "is a directory"),
        ("none", None, ["--log"], "no such file"),
        ("", "", ["--dump"], "no such file"),
        ("dump", WITHOUT_RADIUS, ["--dump"], "no radius"),
        ("dump", WITHOUT_RADIUS[:-24], ["--dump"], "no whole frame"),
        ("pairs", "", ["--contacts"], "with --dump"),
        ("a=1", None, ["--var"], "--var NAME VALUE"),
    ],
)
def test_what_is_not_what_it_is_given_as(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    name: str, text: str | None, words: list[str], says: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    write(tmp_path)
    if name and text is not None:
        Path(name).write_text(text)
    given = ["in.deck", *words, name or "."] if words else [name]
    assert main(["audit", *given]) == 2
    assert says.lower() in capsys.readouterr().err.lower()


def test_a_frame_that_a_killed_run_began_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dump(tmp_path, rows(REST), rows(REST))
    cut = tmp_path / "post/spheres_2000.dump"
    whole = (tmp_path / "post/spheres_1000.dump").read_text().replace("1000", "2000")
    for length in (0, 20, 100, len(whole) - 30):
        cut.write_text(whole[:length])
        known = report(tmp_path, capsys)["known"]
        assert (known["frames"], known["ends within a frame"]) == (2, str(cut))
