"""Findings that are physical, on runs of own small scripts."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from audit_decks import DECK, LAW, SPINNING, SQUEEZED, run, without, write

from dragdeck.audit.command import audit
from dragdeck.audit.zero_steps import engine_findings
from dragdeck.cli import main
from dragdeck.script.flow import read_script

pytestmark = pytest.mark.engine

FULL = DECK.replace("region 100", "region 2000").replace("run 8000", "run 400")
SLIDING = DECK.replace("vector 0 0 -1", "vector 1 0 -1").replace("region 100", "region 1")
SLIDING = SLIDING.replace("block 0 0.04 0 0.04 0 0.04", "block 0 0.01 0 0.01 0 0.0041")
SLIDING = without(SLIDING, "wall[0123] ").replace("run 8000", "run 400")


def document(folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict:  # type: ignore[type-arg]
    file, dump = str(folder / "in.deck"), str(folder / "post" / "spheres_*.dump")
    words = ["--dump", dump, "--log", str(folder / "log"), "--format", "json"]
    main(["audit", file, *words, *more])
    return json.loads(capsys.readouterr().out)  # type: ignore[no-any-return]


def test_a_sound_run_has_no_finding(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(tmp_path)
    result = document(tmp_path, capsys)
    assert result["findings"] == [] and result["not_applied"] == []
    assert result["known"]["contacts of"] == "particles and walls"
    pairs = str(tmp_path / "post" / "pairs_*.dump")
    more = document(tmp_path, capsys, "--contacts", pairs)  # a large step: a large dashpot
    assert {finding["rule"] for finding in more["findings"]} == {"DK207"}


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (SQUEEZED, "DK201"),
        (without(DECK, "wall1 "), "DK203"),
        (DECK.replace("timestep 5e-5", "timestep 4e-4"), "DK204"),
        (SPINNING.replace("SETTINGS", ""), "DK205"),
        (DECK.replace("run 8000", "run 1400"), "DK206"),
        (FULL, "DK208"),
    ],
)
def test_a_spoilt_run_has_its_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, rule: str
) -> None:
    run(tmp_path, text)
    assert rule in {finding["rule"] for finding in document(tmp_path, capsys)["findings"]}


def test_rules_on_the_script_forecast_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(tmp_path / "spin", SPINNING.replace("SETTINGS", "torsionTorque on"))
    rules = {finding["rule"] for finding in document(tmp_path / "spin", capsys)["findings"]}
    assert not rules & {"DK104", "DK205"}
    run(tmp_path / "full", FULL)
    rules = {finding["rule"] for finding in document(tmp_path / "full", capsys)["findings"]}
    assert {"DK106", "DK208"} <= rules


def test_without_a_tangential_model_nothing_rolls(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spins = []
    for name, law in (("with", LAW), ("without", "hertz")):
        run(tmp_path / name, SLIDING.replace(LAW, law))
        files = sorted((tmp_path / name / "post").glob("spheres_*"), key=lambda f: len(f.name))
        rows = [file.read_text().splitlines()[9:] for file in files]
        spins.append(max(abs(float(row.split()[12])) for frame in rows for row in frame))
        capsys.readouterr()
    assert spins[0] > 1 and spins[1] == 0


@pytest.mark.parametrize(
    ("old", "new", "line", "error"),
    [
        ("5e6 5e6", "1e6 5e6", "pair_coeff", "youngsModulus >= 5e6"),
        ("15485863", "4", "fix sphere", "prime number"),
        ("plate.stl", "none.stl", "mesh/surface", "Cannot open mesh file"),
        ("run 1\n", "fix z all nonsense\nrun 1\n", "nonsense", "fix style"),
    ],
)
def test_the_error_of_liggghts_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, line: str, error: str
) -> None:
    text = SQUEEZED.replace(old, new)
    assert audit(write(tmp_path, text), engine=True, select="DK3", format="json") == 1
    (finding,) = json.loads(capsys.readouterr().out)["findings"]
    assert error.lower() in finding["message"].lower()
    assert finding["line"]
    assert not list(tmp_path.glob("log*"))


def test_a_script_that_reaches_outside_is_not_run(tmp_path: Path) -> None:
    file = write(tmp_path, DECK.replace("run 1\n", "print x append ../x\nrun 1\n"))
    assert audit(file, engine=True, select="DK3") == 0
    (skipped,) = engine_findings(read_script(file))
    assert "outside" in skipped.name


def test_a_script_alone_is_read_without_numpy(tmp_path: Path) -> None:
    code = (
        "import sys; from dragdeck.script import flow, rules; from pathlib import Path;"
        f"flow.read_script(Path({str(write(tmp_path))!r})); print('numpy' in sys.modules)"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                           cwd=Path(__file__).parents[3] / "workflow")  # fmt: skip
    assert shown.stdout == "False\n"
