"""Findings that are physical, on runs of own small scripts."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from audit_decks import DECK, LAW, SPINNING, SQUEEZED, edited, run, without, write

from dragdeck.audit.command import audit
from dragdeck.audit.zero_steps import engine_findings
from dragdeck.cli import main
from dragdeck.script.flow import read_script

pytestmark = pytest.mark.engine

FULL = edited(["region 100 => region 2000", "run 8000 => run 400"])
TORSION = edited(["epsd2\npair => epsd2 torsionTorque on\npair", "0.0\n => 0.0 torsionTorque on\n"],
                 text=SPINNING)  # fmt: skip
SLIDING = edited(["vector 0 0 -1 => vector 1 0 -1", "region 100 => region 1", "run 8000 => run 400",
                  "block 0 0.04 0 0.04 0 0.04 => block 0 0.01 0 0.01 0 0.0041"],
                 text=without(DECK, "wall[0123] "))  # fmt: skip


def document(folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, Any]:
    file, dump = str(folder / "in.deck"), str(folder / "post" / "*.dump")
    words = ["--dump", dump, "--log", str(folder / "log"), "--format", "json"]
    main(["audit", file, *words, *more])
    read: dict[str, Any] = json.loads(capsys.readouterr().out)
    return read


def test_a_sound_run_has_no_finding(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(tmp_path)
    result = document(tmp_path, capsys)
    assert result["findings"] == [] and result["not_applied"] == []
    assert result["known"]["contacts of"] == "particles and walls"
    pairs = str(tmp_path / "post" / "pairs_*.dump")
    more = document(tmp_path, capsys, "--contacts", pairs)  # a large step: a large dashpot
    assert {finding["rule"] for finding in more["findings"]} == {"DK207"}


@pytest.mark.parametrize(
    ("text", "there", "absent"),
    [
        (SQUEEZED, {"DK201"}, set()),
        (without(DECK, "wall1 "), {"DK203"}, set()),
        (edited(["timestep 5e-5 => timestep 4e-4"]), {"DK204"}, set()),
        (SPINNING, {"DK104", "DK205"}, set()),
        (TORSION, set(), {"DK104", "DK205"}),
        (edited(["run 8000 => run 1400"]), {"DK206"}, set()),
        (FULL, {"DK106", "DK208"}, set()),
    ],
)
def test_a_spoilt_run_has_its_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, there: set[str], absent: set[str]
) -> None:
    run(tmp_path, text)
    rules = {finding["rule"] for finding in document(tmp_path, capsys)["findings"]}
    assert there <= rules and not absent & rules


def test_without_a_tangential_model_nothing_rolls(tmp_path: Path) -> None:
    spins = []
    for name, law in (("with", LAW), ("without", "hertz")):
        run(tmp_path / name, SLIDING.replace(LAW, law))
        files = (tmp_path / name / "post").glob("spheres_*")
        rows = [row for file in files for row in file.read_text().splitlines()[9:]]
        spins.append(max(abs(float(row.split()[12])) for row in rows))
    assert spins[0] > 1 and spins[1] == 0


@pytest.mark.parametrize(
    ("edit", "error"),
    [
        ("5e6 5e6 => 1e6 5e6", "youngsModulus >= 5e6"),
        ("15485863 => 4", "prime number"),
        ("plate.stl => none.stl", "cannot open mesh file"),
        ("run 1\n => fix z all nonsense\nrun 1\n", "fix style"),
    ],
)
def test_the_error_of_liggghts_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], edit: str, error: str
) -> None:
    file = write(tmp_path, edited([edit], text=SQUEEZED))
    assert audit(file, engine=True, select="DK3", format="json") == 1
    (finding,) = json.loads(capsys.readouterr().out)["findings"]
    assert error.lower() in finding["message"].lower() and finding["line"]
    assert not list(tmp_path.glob("log*"))


def test_a_script_that_reaches_outside_is_not_run(tmp_path: Path) -> None:
    file = write(tmp_path, edited(["run 1\n => print x append ../x\nrun 1\n"]))
    assert audit(file, engine=True, select="DK3") == 0
    (skipped,) = engine_findings(read_script(file))
    assert "outside" in skipped.name


def test_a_script_alone_is_read_without_numpy(tmp_path: Path) -> None:
    code = "import sys; from dragdeck.audit.command import audit; from pathlib import Path;"
    code += f"audit(Path({str(write(tmp_path))!r})); print('numpy' in sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.endswith("False\n")
