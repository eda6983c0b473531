"""The contact network at a peak of the drag: beside a quiet moment, and as a short film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from dragchain.arrays import Floats, Ints
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.figures import network_picture as scene
from dragchain.figures.network_overlay import mark_chain, mark_motion
from dragchain.figures.network_picture import Look, Scene, View
from dragchain.figures.rendering import check_rendering
from dragchain.figures.style import BLUE, CHAIN, RED, STYLE, png
from dragchain.network.chains import dominant_path, widest_paths
from dragchain.network.frame import NetworkFrame, read_frames
from dragchain.run.case import Case, load_case
from dragchain.run.kinematics import drag_start_s
from dragchain.tables.by_step import read_table
from dragchain.tables.workpiece_pose import WorkpiecePlaces, workpiece_places

QUIET_S = 0.2
"""The quiet moment is the middle of the stretch of this length with the least resistance."""

BEFORE_S, AFTER_S = 1.0, 1.0
"""What the film shows of the time before and after the peak."""

PICTURES = 34
"""Number of pictures of the film, at the most."""

PICTURE_MS = 150
"""How long each picture stands."""

COLOURS = 80
_PIXELS_PER_MM = 8.0
_FILM_PIXELS_PER_MM = 5.0


@dataclass(frozen=True)
class Moments:
    """The counted drag of a run, its highest clear peak and its quietest moment.

    Attributes
    ----------
    time_s, resistance_n : (N,) ndarray
        Process time and minus the drag.
    peak_s, quiet_s : float
        Process times.
    """

    time_s: Floats
    resistance_n: Floats
    peak_s: float
    quiet_s: float


def choose_moments(run_dir: Path, case: Case) -> Moments:
    """Choose the peak with the largest resistance and the stretch with the smallest.

    Raises
    ------
    TableError
        If the drag has no peak.
    """
    samples = read_counted(run_dir, ("time_s", "drag_n"))
    time_s = samples["time_s"].to_numpy(np.float64) - drag_start_s(case)
    drag = samples["drag_n"].to_numpy(np.float64)
    peaks = find_drag_peaks(time_s, drag, min_separation_s=peak_separation_s(case))
    if not len(peaks.index):
        raise TableError(f"{run_dir}: the drag has no peak to show; drag for longer")
    wide = max(1, round(QUIET_S / float(np.median(np.diff(time_s)))))
    wide = min(wide, len(drag))
    level = np.convolve(-drag, np.full(wide, 1.0 / wide), mode="valid")
    quiet = int(level.argmin()) + wide // 2
    return Moments(time_s, -drag, float(peaks.time_s[peaks.drag_n.argmin()]), float(time_s[quiet]))


def write_peak_pictures(run_dir: Path, out_dir: Path) -> list[Path]:
    """Draw the network at the highest peak and at the quietest moment, and film the peak.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with its tables and chains made.
    out_dir : Path
        Gets ``peak_and_quiet_xy.png``, ``peak_and_quiet_xz.png`` and ``peak_film.gif``.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    TableError
        If a table is missing or the drag has no peak.
    RenderError
        If pictures cannot be rendered here.
    """
    check_rendering()
    case = load_case(run_dir)
    moments = choose_moments(run_dir, case)
    pair = [scene.load_scene(run_dir, case, wanted) for wanted in (moments.peak_s, moments.quiet_s)]
    out_dir.mkdir(parents=True, exist_ok=True)
    written = []
    views: tuple[View, ...] = ("xy", "xz")
    with matplotlib.rc_context(STYLE):
        for view in views:
            figure = _side_by_side(run_dir, case, moments, pair, view)
            written.append(_write(out_dir / f"peak_and_quiet_{view}.png", png(figure)))
        written.append(_write(out_dir / "peak_film.gif", film(run_dir, case, moments)))
    return written


def _write(file: Path, content: bytes) -> Path:
    draft = file.with_name(f".{file.name}.tmp")
    draft.write_bytes(content)
    draft.replace(file)
    return file


# --- side by side ----------------------------------------------------------------------------


def _side_by_side(
    run_dir: Path, case: Case, moments: Moments, pair: Sequence[Scene], view: View
) -> Figure:
    largest = max(float(shown.frame.normal_force.max(initial=0.0)) for shown in pair)
    look = Look(_PIXELS_PER_MM, largest)
    figure = Figure(figsize=(7.6, 5.5), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(3.6, 1.3))
    axes = [figure.add_subplot(grid[0, column]) for column in (0, 1)]
    for name, place, shown in zip(("at the peak", "at the quiet moment"), axes, pair, strict=True):
        image, extent = scene.render(run_dir, case, shown, view, look)
        _network(place, shown, view, image, extent)
        words = f"{name}, process time {shown.process_time_s:.2f} s\n{_chain_words(shown)}"
        place.set_title(words, fontsize=8.5)
    scale = ScalarMappable(Normalize(0.0, largest), scene.colour_map())
    bar = figure.colorbar(scale, ax=axes, shrink=0.75, pad=0.01, aspect=28)
    bar.set_label("normal force of a contact in N;\ncylinder radius in proportion", fontsize=8)
    _trace(figure.add_subplot(grid[1, :]), moments, [shown.process_time_s for shown in pair])
    return figure


def _network(
    axes: Axes, shown: Scene, view: View, image: NDArray[np.uint8], extent: Floats
) -> None:
    axes.imshow(image, extent=tuple(extent.tolist()), interpolation="antialiased")
    axes.grid(False)
    axes.set(xlabel="x in mm", ylabel=f"{view[1]} in mm", xlim=extent[:2], ylim=extent[2:])
    mark_chain(axes, shown, [0, 1] if view == "xy" else [0, 2], width=1.2, halo=2.0)
    mark_motion(axes, shown, view)


def _chain_words(shown: Scene) -> str:
    if shown.dominant is None:
        return "no path of strong contacts to the bowl"
    forces = shown.frame.normal_force[list(shown.dominant.contacts)]
    return (
        f"outlined: {len(shown.dominant.particles)} particles, weakest contact {forces.min():.2f} N"
    )


def _trace(axes: Axes, moments: Moments, marked_s: Sequence[float]) -> None:
    axes.plot(moments.time_s, moments.resistance_n, color=BLUE, linewidth=0.7)
    for name, at, lift in zip(("peak", "quiet"), marked_s, (4, -9), strict=True):
        level = float(np.interp(at, moments.time_s, moments.resistance_n))
        axes.axvline(at, color=RED, linewidth=0.8, linestyle=":")
        axes.plot([at], [level], "o", color=RED, markersize=5)
        axes.annotate(
            name, (at, level), (5, lift), textcoords="offset points", color=RED, weight="bold"
        )
    axes.set(xlabel="process time in s", ylabel="resistance (minus\nthe drag) in N")
    axes.margins(x=0.01, y=0.15)


# --- the film --------------------------------------------------------------------------------


def film(run_dir: Path, case: Case, moments: Moments) -> bytes:
    """The film of the peak as an animated GIF, seen from above."""
    scenes = _scenes(run_dir, case, moments)
    largest = max(float(shown.frame.normal_force.max(initial=0.0)) for shown in scenes)
    pictures = [_picture(run_dir, case, moments, shown, largest) for shown in scenes]
    return animate(pictures)


def film_steps(steps: Ints, process_s: Floats, peak_s: float) -> Ints:
    """Choose evenly spaced frames around the peak, that nearest to it among them."""
    inside = np.flatnonzero((process_s >= peak_s - BEFORE_S) & (process_s <= peak_s + AFTER_S))
    if not inside.size:
        return np.array([], dtype=np.int64)
    every = max(1, -(-len(inside) // PICTURES))
    nearest = int(np.abs(process_s[inside] - peak_s).argmin())
    return np.asarray(steps[inside[nearest % every :: every]])


def _scenes(run_dir: Path, case: Case, moments: Moments) -> list[Scene]:
    start_s = drag_start_s(case)
    tables = run_dir / "tables"
    network = read_table(tables / "network.parquet", ["step", "time_s"])
    steps = film_steps(
        network["step"].to_numpy(np.int64),
        network["time_s"].to_numpy(np.float64) - start_s,
        moments.peak_s,
    )
    if not steps.size:
        raise TableError(
            f"{run_dir}: no network frame is near the peak at {moments.peak_s:.2f} s of process "
            "time; write the outputs contacts and particles more often"
        )
    frames = read_frames(run_dir, (int(steps[0]), int(steps[-1])))
    place = workpiece_places(run_dir, case)
    return [_scene(frame, place, start_s) for frame in frames if frame.step in set(steps.tolist())]


def _scene(frame: NetworkFrame, place: WorkpiecePlaces, start_s: float) -> Scene:
    dominant = dominant_path(frame, widest_paths(frame))
    return Scene(frame, *place(frame.step), dominant, frame.time_s - start_s)


def _picture(
    run_dir: Path, case: Case, moments: Moments, shown: Scene, largest_n: float
) -> Image.Image:
    path = shown.dominant
    kept = np.array([] if path is None else path.contacts, dtype=np.int64)
    image, extent = scene.render(
        run_dir, case, shown, "xy", Look(_FILM_PIXELS_PER_MM, largest_n, kept)
    )
    figure = Figure(figsize=(4.6, 6.0), dpi=100)
    axes = figure.add_axes((0.13, 0.32, 0.845, 0.615))
    _network(axes, shown, "xy", image, extent)
    words = f"process time {shown.process_time_s:.2f} s\n{_chain_words(shown)}"
    axes.set_title(words, fontsize=8.5)
    below = figure.add_axes((0.13, 0.075, 0.845, 0.155))
    near = np.abs(moments.time_s - moments.peak_s) <= 1.05 * max(BEFORE_S, AFTER_S)
    below.plot(moments.time_s[near], moments.resistance_n[near], color=BLUE, linewidth=0.8)
    level = float(np.interp(shown.process_time_s, moments.time_s, moments.resistance_n))
    below.axvline(shown.process_time_s, color=RED, linewidth=0.8)
    below.plot([shown.process_time_s], [level], "o", color=RED, markersize=6)
    below.set(xlabel="process time in s")
    below.set_ylabel("resistance in N", fontsize=8)
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=100)
    with Image.open(drawn) as picture:
        return picture.convert("RGB")


def _swatches() -> Image.Image:
    """The colours of forces, bright and dark, and of marks, so that none is lost."""
    bright = scene.colour_map()(np.linspace(0.0, 1.0, 16))[:, :3]
    marks = np.array([to_rgb(colour) for colour in (BLUE, RED, CHAIN, "white")])
    greys = np.linspace(0.0, 1.0, 16)[:, None].repeat(3, axis=1)
    rows = [bright, 0.7 * bright, np.repeat(marks, 4, axis=0), greys]
    return Image.fromarray(np.rint(255.0 * np.stack(rows)).astype(np.uint8))


def animate(pictures: Sequence[Image.Image]) -> bytes:
    """The pictures, all of one size, as a GIF that repeats, with one palette for all."""
    some = pictures[:: max(1, len(pictures) // 6)]
    width, height = some[0].size
    sheet = Image.new("RGB", (width, height * (len(some) + 1)))
    for at, picture in enumerate(some):
        sheet.paste(picture, (0, at * height))
    swatches = _swatches().resize((width, height), Image.Resampling.NEAREST)
    sheet.paste(swatches, (0, height * len(some)))
    palette = sheet.quantize(COLOURS)
    flat = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    file = BytesIO()
    flat[0].save(
        file, format="gif", save_all=True, append_images=flat[1:], duration=PICTURE_MS, loop=0,
        optimize=False,
    )  # fmt: skip
    return file.getvalue()
