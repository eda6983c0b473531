"""Templates of a study through the whole workflow: a changed script runs at the first call."""

from pathlib import Path

import pytest
from doc_pages import template_examples
from snakemake_calls import copy_of_project, succeed, tiny_study

pytestmark = [pytest.mark.engine, pytest.mark.slow]


def test_edited_templates_run_at_the_first_call(tmp_path: Path) -> None:
    """The contact law, damping and output of the how-to, after a filling without them."""
    project = copy_of_project(tmp_path, tiny_study())
    succeed(project, "filling", "--config", "study=small")
    folder = project / "studies/small/templates"
    folder.mkdir()
    for name, text in template_examples().items():
        (folder / name).write_text(text)
    succeed(project, "process", "--config", "study=small", "--show-failed-logs")
    (filling,) = (project / "results/small/filling").iterdir()
    (process,) = (project / "results/small/process").iterdir()
    assert (
        "model hooke"
        not in (next((filling / "archive").iterdir()) / "as_run/in.liggghts").read_text()
    )
    for run in (filling, process):
        assert (run / "benchmarks/run.tsv").is_file()
        script = (run / "as_run/in.liggghts").read_text()
        assert script.count("model hooke tangential history") > 2
        assert "model hertz" not in script
    assert "fix damping all viscous" in (filling / "as_run/in.liggghts").read_text()
    header, *rows = (process / "fastest.1.txt").read_text().splitlines()
    assert header == "time_s fastest_m_s" and rows
    assert "vx vy vz" in (process / "motion.1.dump").read_text()
