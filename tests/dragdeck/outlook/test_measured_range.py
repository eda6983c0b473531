"""Whether a scene lies within the measured range, and where that is said."""

import re
from dataclasses import replace

import pytest

from dragdeck import commands
from dragdeck.cases.case import Case
from dragdeck.outlook.measured_range import closeness, outside_of_laws
from dragdeck.project import Project
from dragdeck.study.model import Fidelity

SCENES = [{"depth": 2.0, "tilt": 0.0}, {"depth": 4.0}]


@pytest.mark.parametrize(
    ("here", "expected"),
    [
        ({"depth": 3.0}, 1.0), ({"depth": 4.0}, 1.0), ({"depth": 4.2}, 0.5), ({"depth": 1.9}, 0.5),
        ({"depth": 4.5}, 0.0), ({"depth": 1.0}, 0.0), ({"depth": 3.0, "tilt": 1.0}, 0.0),
    ],
)  # fmt: skip
def test_closeness_falls_without_a_jump(here: dict[str, float], expected: float) -> None:
    assert closeness(here, SCENES, ("depth", "tilt")) == pytest.approx(expected)


def with_modulus(case: Case, scale: float) -> Case:
    study = case.study.model_copy(update={"fidelity": Fidelity(youngs_modulus_scale=scale)})
    return replace(case, study=study)


def test_only_a_reduced_modulus_is_outside(case: Case) -> None:
    assert "bowl to particle" in outside_of_laws(with_modulus(case, 0.01))
    assert outside_of_laws(with_modulus(case, 1.0)) == ""


def test_check_and_explain_name_what_is_outside(
    case: Case,
    project: Project,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(project.root)
    commands.check("small", None, verbose=False)
    said = " ".join(capsys.readouterr().out.split())
    assert re.search(r"note: \S+: the scene is outside the measured range of reduced moduli", said)
    for verbose in (False, True):
        commands.explain("small", None, "process", verbose=verbose)
        said = " ".join(capsys.readouterr().out.split())
        assert "the scene is outside" in said.replace("│", " ").replace("  ", " ")
