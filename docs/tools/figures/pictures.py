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
from tables import ROOT

from dragchain.export.frames import Selection
from dragchain.export.write import write_export
from dragchain.figures.rendering import Camera, new_plotter, photograph
from dragchain.figures.style import COLOURS, drawing, few_colours, force_map, png
from dragchain.report.findings import FILE, ProcessFindings
from dragchain.report.run_data import RunData
from dragchain.report.run_figures import network_xz
from dragchain.run.kinematics import needed
from dragdeck.errors import DragdeckError
from dragdeck.records.case import load_case

STUDY = "half_minute"
"""Its results are needed: ``./run all --config study=half_minute``."""

_PIXELS = (1000, 760)
_THICKEST_M = 2e-3


def _network(run: Path) -> bytes:
    with drawing():
        return png(network_xz(RunData(run, load_case(run)), ProcessFindings.read(run / FILE)))


def _export(run: Path) -> bytes:
    """The first frame as exported: half of the particles, and the contacts of the other half."""
    import pyvista as pv

    case = load_case(run)
    with TemporaryDirectory() as folder:
        write_export(run, "paraview", Path(folder) / "out", Selection(every=1_000_000))
        (file,) = (Path(folder) / "out/frames").glob("*.vtm")
        parts = pv.read(file)
        particles, contacts, workpiece = parts[0], parts[1], parts[2]
    plotter = new_plotter(*_PIXELS)
    radius, surface = case.bowl.radius_m, needed(case.surface_m, "surface_m")
    behind = particles.extract_points(particles.points[:, 1] > 0, include_cells=False)
    ball = pv.Sphere(radius=1.0, theta_resolution=24, phi_resolution=24)
    spheres = behind.glyph(scale="radius", orient=False, geom=ball)
    plotter.add_mesh(spheres, color=COLOURS["bowl"], smooth_shading=True, ambient=0.3)
    shown = (contacts.cell_centers().points[:, 1] <= 0) & (contacts["normal_force_n"] > 0)
    lines = contacts.extract_cells(shown).extract_surface(algorithm="dataset_surface")
    lines = lines.cell_data_to_point_data()
    largest = float(contacts["normal_force_n"].max())
    lines["thickness"] = lines["normal_force_n"] / largest * _THICKEST_M
    tubes = lines.tube(scalars="thickness", absolute=True, n_sides=18)
    bar = {"title": "normal force (N)", "vertical": True, "color": COLOURS["ink"]}
    colours = {"scalars": "normal_force_n", "cmap": force_map(), "clim": (0.0, largest)}
    plotter.add_mesh(tubes, **colours, scalar_bar_args={**bar, "position_x": 0.84})
    plotter.add_mesh(workpiece, color=COLOURS["workpiece"], ambient=0.3)
    plotter.add_mesh(pv.Disc(inner=radius, outer=1.01 * radius, c_res=120), color=COLOURS["ink"])
    camera = Camera((0.15 * radius, -3.0 * radius, 1.6 * surface), (0.0, 0.0, 0.6 * surface))
    return _encoded(Image.fromarray(photograph(plotter, camera, 1.9 * surface)))


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


def _paraview(run: Path) -> bytes:
    with TemporaryDirectory() as folder:
        write_export(run, "paraview", Path(folder) / "out", Selection(every=50))
        file = Path(folder) / "view.png"
        words = [_program("pvpython"), "--force-offscreen-rendering", Path(folder) / "out/view.py"]
        subprocess.run([*words, "--picture", file, "--frame", "1"], check=True)
        return file.read_bytes()


def _program(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        raise DragdeckError(f"{name} is not installed")
    return path


PICTURES: Mapping[str, Callable[[Path], bytes]] = {
    "carousel": _carousel,
    "export": _export,
    "network_page": _network_page,
    "network_xz": _network,
    "paraview": _paraview,
}
"""What draws a picture from the folder of a process run, by the name of its file."""


def picture(name: str, run: Path) -> bytes:
    """A picture as PNG of few colours."""
    with Image.open(BytesIO(PICTURES[name](run))) as drawn:
        return _encoded(drawn)


def _encoded(drawn: Image.Image) -> bytes:
    content = BytesIO()
    few_colours(drawn.convert("RGB")).save(content, format="png", optimize=True)
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
