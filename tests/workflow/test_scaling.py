"""A small scaling through the workflow, on the real engine."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import SMALL_STUDY
from snakemake_calls import copy_of_project, jobs, snakemake, succeed

pytestmark = [pytest.mark.engine, pytest.mark.slow]

SCALING = ("scaling", "--config", "study=small")


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with a small study of four depths."""
    data: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    data["sweep"] = {"motion.immersion_depth_m": [0.008, 0.012, 0.016, 0.020]}
    data["scaling"] = {
        "field": "motion.immersion_depth_m",
        "expected_exponent": 0,
        "source": "nobody",
    }
    data["fidelity"] = {"youngs_modulus_scale": 1e-4, "timestep_fraction": 0.5, "ranks": 1}
    return copy_of_project(tmp_path_factory.mktemp("scaling"), data)


def test_the_drag_grows_with_the_depth(project: Path) -> None:
    succeed(project, *SCALING)
    found = json.loads((project / "results/small/scaling/scaling.json").read_text())
    assert found["commands"] == ["./run scaling --config study=small"]
    assert [level["x"] for level in found["levels"]] == [0.008, 0.012, 0.016, 0.020]
    assert 0.5 < found["fit"]["exponent"]["value"] < 3.5
    assert found["engine"] and found["expected"]["source"] == "nobody"
    assert jobs(project, *SCALING) - {"scaling"} == set()


def test_a_broken_file_of_settings_is_named_with_its_line(project: Path) -> None:
    (project / "config").unlink()
    (project / "config").mkdir()
    (project / "config/config.yaml").write_text("study: small\nplan: [a\n")
    done = snakemake(project, "--dry-run", "filling")
    assert done.returncode == 1
    assert "config/config.yaml: line 3: not YAML" in done.stdout + done.stderr
