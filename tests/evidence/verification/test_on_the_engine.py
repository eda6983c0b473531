"""A few runs of the verification suite on the real engine, judged; and a wrong law, caught."""

import json
from pathlib import Path

import pandas as pd
import pytest
from pages import stands_alone

from dragdeck.cases.case import Case
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.run_folder import run
from dragdeck.errors import RejectedRunError
from dragdeck.project import Project
from evidence.verification.report import verdict, write_verification
from evidence.verification.suite import suite_of

pytestmark = pytest.mark.engine

CHOSEN = (
    "elastic_pair-media",
    "restitution-media-workpiece-limited",
    "oblique_study-media-workpiece-limited",
    "spin_unequal-nylon",
    "momentum",
)


@pytest.fixture
def folders(case: Case, project: Project) -> list[Path]:
    """Finished runs."""
    made = []
    for name, experiment in suite_of(case.study).items():
        if name.startswith(CHOSEN):
            folder = project.results(experiment.case.study_name) / "collide" / name
            write_run(experiment, folder, environment(project.templates))
            run(folder, lambda line: None)
            made.append(folder)
    assert len(made) == len(CHOSEN)
    return made


def test_the_engine_meets_the_law_and_a_wrong_law_is_caught(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "report"
    assert " 0 fail" in verdict(write_verification(out, folders), out)

    table = pd.read_parquet(out / "checks.parquet")
    limited = table[(table["test"] == "restitution") & (table["against"] == "exact formula")]
    assert limited.loc[limited["x"] == 0.7, "engine"].item() == pytest.approx(0.7182, abs=2e-4)
    damped = table[(table["test"] == "oblique_study") & table["against"].str.startswith("Coulomb")]
    assert (damped["verdict"] == "differs").any()
    stands_alone((out / "verification.html").read_text())

    for folder in folders:  # as if the engine had been given other constants than it was
        file = folder / "case.json"
        case = json.loads(file.read_text())
        for pair in case["pairs"]:
            pair["friction"] *= 1.02
        for kind in case["types"]:
            kind["youngs_modulus_pa"] *= 1.01
        file.write_text(json.dumps(case))
    with pytest.raises(RejectedRunError) as caught:
        verdict(write_verification(out, folders), out)
    said = str(caught.value)
    assert "elastic_pair" in said
    assert "oblique_study" in said
    assert "spin_unequal" in said
    assert "momentum" not in said
