"""The examples of docs/examples: their studies, pictures and numbers.

``run_example`` runs a study to its report, then keeps its summary in ``docs/data/examples`` and
the pictures of its page in ``docs/examples/images``. Runs that are complete are not repeated.
"""

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import run_records
from figures.pictures import few_colours
from records import DATA, ROOT

EXAMPLES: dict[str, dict[str, str]] = {
    "uhlmann2015": {},
    "planetary_cutter": {
        "preview": "preview.png",
        "load": "process/*/figures/workpiece.png",
        "forces": "process/*/figures/forces.png",
    },
    "carousel": {
        "network": "process/*count-3-????????/figures/network_xy.png",
        "forces": "process/*count-3-????????/figures/forces.png",
    },
    "tilted_stream": {
        "preview": "preview.png",
        "upright": "process/*tilt_deg-0-*/figures/workpiece.png",
        "tilted": "process/*tilt_deg-10-*/figures/workpiece.png",
    },
    "mixture": {
        "preview": "preview.png",
        "network": "process/*/figures/network_xz.png",
        "depth": "process/*/figures/force_depth.png",
    },
    "removal": {"load": "process/*/figures/workpiece.png"},
}
"""Pictures of each example: name, and place in the folder of results."""


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
        out.write_bytes(few_colours(file))
    if study == "uhlmann2015":
        run_records.main()
