"""Pictures of particles and pages, from the results of `STUDY`; PNG files of few colours."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from records import ROOT

from dragdeck.errors import DragdeckError

STUDY = "quickstart"
"""Its results are needed: ``./run all --config study=quickstart``."""


def _network_page(run: Path) -> bytes:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "page.png"
        subprocess.run(
            [_program("chromium"), "--headless", "--no-sandbox", "--hide-scrollbars",
             "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--virtual-time-budget=8000", "--window-size=1366,820", f"--screenshot={file}",
             f"--user-data-dir={folder}/profile", (run / "network.html").as_uri()],
            check=True, capture_output=True,
        )  # fmt: skip
        return file.read_bytes()


def _carousel(run: Path) -> bytes:
    words = [Path(sys.executable).with_name("dragdeck"), "preview", "carousel"]
    subprocess.run(words, check=True, capture_output=True, cwd=ROOT)
    return (ROOT / "results/carousel/preview.png").read_bytes()


def _program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        raise DragdeckError(f"{name} is not installed")
    return path


PICTURES: Mapping[str, Callable[[Path], bytes]] = {
    "carousel": _carousel,
    "network_page": _network_page,
}
"""What draws a picture from the folder of a process run, by the name of its file."""


def drawn_picture(name: str, run: Path) -> bytes:
    """A picture as PNG of few colours."""
    return few_colours(BytesIO(PICTURES[name](run)))


def few_colours(picture: Path | BytesIO) -> bytes:
    """The same picture as PNG of few colours."""
    content = BytesIO()
    with Image.open(picture) as drawn:
        drawn.convert("RGB").quantize(dither=Image.Dither.NONE).save(content, "png", optimize=True)
    return content.getvalue()


def run_of_study() -> Path:
    """The process run of the study.

    Raises
    ------
    DragdeckError
        If it has not been run.
    """
    for file in sorted((ROOT / "results" / STUDY / "process").glob("*/run.json")):
        if json.loads(file.read_text())["state"] == "complete":
            return file.parent
    raise DragdeckError(f"{STUDY} has no results: ./run all --config study={STUDY}")
