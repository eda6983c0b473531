"""The settings of a call: config/config.yaml and --config."""

from pathlib import Path

import pytest
from snakemake_calls import copy_of_project, snakemake

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("text", "line"),
    [("study: small\nplan: [a\n", 3), ("study: a\nstudy: b\n", 2), ("a: b: c\n", 1)],
)
def test_a_broken_file_of_settings_is_named_with_its_line(
    tmp_path: Path, text: str, line: int
) -> None:
    project = copy_of_project(tmp_path)
    (project / "config").unlink()
    (project / "config").mkdir()
    (project / "config/config.yaml").write_text(text)
    done = snakemake(project, "--dry-run", "filling")
    assert done.returncode == 1
    assert f"config/config.yaml: line {line}: not YAML" in done.stdout + done.stderr
