"""The examples of docs/examples, and `quickstart`: their studies, pictures and numbers.

``run_example`` runs a study to its report, then keeps its summary in ``docs/data/examples`` and
the pictures of pages in ``docs/examples/images``. Runs that are complete are not repeated.
"""

import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import yaml
from PIL import Image
from records import DATA, ROOT

import dragchain

EXAMPLES: dict[str, dict[str, str]] = yaml.safe_load((ROOT / "docs/examples.yaml").read_text())
"""Pictures of each example by name, and their place in the folder of its results."""

BLOCK_S = 0.02
"""Of which the mean force is kept."""


def study_text(name: str) -> str:
    """A study file as a page shows it: without its first comment and its assumptions."""
    text = (ROOT / "studies" / name / "study.yaml").read_text(encoding="utf-8")
    text = re.sub(r"\A(#.*\n)+|^assumptions:\n( .*\n)+\n*", "", text, flags=re.M)
    return f"```yaml\n{text.strip()}\n```"


def run_example(study: str) -> None:
    """Run a study and renew what its page shows; Snakemake's error if a run fails."""
    results = ROOT / "results" / study
    words = ["-m", "snakemake", "all", "--config", f"study={study}"]
    subprocess.run([sys.executable, *words], cwd=ROOT, check=True)
    program = Path(sys.executable).with_name("dragdeck")
    subprocess.run([program, "preview", study], cwd=ROOT, check=True)
    summary = pd.read_csv(results / "report/summary.csv").drop(columns=["headline", "settings"])
    summary.to_csv(DATA / "examples" / f"{study}.csv", index=False, float_format="%.6g")
    for name, place in EXAMPLES[study].items():
        (file,) = results.glob(place)
        out = ROOT / "docs/examples/images" / f"{study}_{name}.png"
        out.write_bytes(few_colours(file if file.suffix == ".png" else photographed(file)))
    if study == "uhlmann2015":
        keep_run(DATA / "validation")


def photographed(page: Path) -> BytesIO:
    """A page as Chromium shows it."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "page.png"
        subprocess.run(
            ["chromium", "--headless", "--no-sandbox", "--hide-scrollbars",
             "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--virtual-time-budget=8000", "--window-size=1366,820", f"--screenshot={file}",
             f"--user-data-dir={folder}/profile", page.as_uri()],
            check=True, capture_output=True,
        )  # fmt: skip
        return BytesIO(file.read_bytes())


def few_colours(picture: Path | BytesIO) -> bytes:
    """The same picture as PNG of few colours."""
    content = BytesIO()
    with Image.open(picture) as drawn:
        drawn.convert("RGB").quantize(dither=Image.Dither.NONE).save(content, "png", optimize=True)
    return content.getvalue()


def keep_run(out: Path) -> None:
    """Write summary, force over time and facets of the workpiece of uhlmann2015 into a folder."""
    study = dragchain.load(str(ROOT / "results/uhlmann2015"))
    (run,) = study.runs
    study.summary.to_csv(out / "run.csv", index=False, float_format="%.6g")
    force = run.force[run.force["phase"] == "drag"]
    block = np.floor(force["time_s"] / BLOCK_S).astype(int)
    means = force.groupby(block)[["time_s", "drag_n", "lateral_n"]].mean()
    means["time_s"] -= force["time_s"].iloc[0]
    means.to_csv(out / "run_force.csv", index=False, float_format="%.5g")
    names = [*(f"centre_{axis}_m" for axis in "xyz"), "area_m2", "force_slide_n_m"]
    facets = run.table("facets", [*names, "force_slide_pa"])
    facets.to_csv(out / "run_facets.csv", index=False, float_format="%.5g")
