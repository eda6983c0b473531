"""The contact network at a peak of the drag: beside a quiet moment, and as a short film."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from dragchain.arrays import Floats, Ints
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.figures import network_picture as scene
from dragchain.figures.network_overlay import force_bar, show_network
from dragchain.figures.network_picture import Look, Scene, View
from dragchain.figures.panels import new_figure
from dragchain.figures.rendering import check_rendering
from dragchain.figures.style import COLOURS, drawing, force_map, png
from dragchain.network.frame import read_frames
from dragchain.run.case import Case, load_case
from dragchain.run.kinematics import drag_start_s
from dragchain.tables.by_step import read_table
from dragchain.tables.workpiece_pose import workpiece_places

_QUIET_S = 0.2
"""The quiet moment is the middle of the stretch of this length with the least resistance."""

BEFORE_S, AFTER_S = 1.0, 1.0
"""What the film shows of the time before and after the peak."""

FILM = "peak_film.gif"
PICTURES = 34
"""Number of pictures of the film, at the most."""

PICTURE_MS = 150
"""How long each picture stands."""

_COLOURS = 80
_PIXELS_PER_MM = 8.0
_FILM_PIXELS_PER_MM = 5.0


@dataclass(frozen=True)
class PeakAndQuiet:
    """The counted drag of a run, its highest clear peak and its quietest moment.

    Attributes
    ----------
    run_dir : Path
    case : Case
    time_s, resistance_n : (N,) ndarray
        Process time and minus the drag.
    peak_s, quiet_s : float
        Process times.
    """

    run_dir: Path
    case: Case
    time_s: Floats
    resistance_n: Floats
    peak_s: float
    quiet_s: float

    def resistance_at(self, time_s: float) -> float:
        """The resistance at a process time."""
        return float(np.interp(time_s, self.time_s, self.resistance_n))


def _peak_and_quiet(run_dir: Path) -> PeakAndQuiet:
    """Find the peak with the largest resistance and the stretch with the smallest.

    Raises
    ------
    TableError
        If the drag has no peak.
    """
    case = load_case(run_dir)
    samples = read_counted(run_dir, ("time_s", "drag_n"))
    time_s = samples["time_s"].to_numpy(np.float64) - drag_start_s(case)
    drag = samples["drag_n"].to_numpy(np.float64)
    peaks = find_drag_peaks(time_s, drag, min_separation_s=peak_separation_s(case))
    if not len(peaks.index):
        raise TableError(f"{run_dir}: the drag has no peak to show; drag for longer")
    wide = max(1, round(_QUIET_S / float(np.median(np.diff(time_s)))))
    wide = min(wide, len(drag))
    level = np.convolve(-drag, np.full(wide, 1.0 / wide), mode="valid")
    quiet_s = float(time_s[int(level.argmin()) + wide // 2])
    peak_s = float(peaks.time_s[peaks.drag_n.argmin()])
    return PeakAndQuiet(run_dir, case, time_s, -drag, peak_s, quiet_s)


def peak_pictures(run_dir: Path, pictures: int = PICTURES) -> tuple[dict[str, bytes], bytes]:
    """Draw the network at the highest peak and at the quietest moment, and film the peak.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with its tables and chains made.
    pictures : int
        Number of pictures of the film, at the most.

    Returns
    -------
    dict of str to bytes
        PNG pictures ``peak_and_quiet_xy`` and ``peak_and_quiet_xz``.
    bytes
        The film, a GIF.

    Raises
    ------
    TableError
        If a table is missing or the drag has no peak.
    RenderError
        If pictures cannot be rendered here.
    """
    check_rendering()
    moments = _peak_and_quiet(run_dir)
    wanted = (moments.peak_s, moments.quiet_s)
    pair = [scene.load_scene(run_dir, moments.case, time_s) for time_s in wanted]
    views: tuple[View, ...] = ("xy", "xz")
    with drawing():
        drawn = {
            f"peak_and_quiet_{view}": png(_side_by_side(moments, pair, view)) for view in views
        }
        return drawn, _film(moments, pictures)


# --- side by side ----------------------------------------------------------------------------


def _side_by_side(moments: PeakAndQuiet, pair: Sequence[Scene], view: View) -> Figure:
    look = Look(_PIXELS_PER_MM, _largest_force(pair))
    figure = new_figure(5.5)
    grid = figure.add_gridspec(2, 2, height_ratios=(3.6, 1.3))
    axes = [figure.add_subplot(grid[0, column]) for column in (0, 1)]
    for name, place, shown in zip(("highest peak", "lowest drag"), axes, pair, strict=True):
        _network(place, moments, shown, view, look, f"{name}, ")
    force_bar(figure, axes, _largest_force(pair))
    _trace(figure.add_subplot(grid[1, :]), moments, [shown.process_time_s for shown in pair])
    return figure


def _largest_force(scenes: Sequence[Scene]) -> float:
    return max(float(shown.frame.normal_force.max(initial=0.0)) for shown in scenes)


def _network(
    axes: Axes, moments: PeakAndQuiet, shown: Scene, view: View, look: Look, name: str = ""
) -> None:
    image, extent = scene.render(moments.run_dir, moments.case, shown, view, look)
    show_network(axes, shown, view, image, extent, width=1.2, halo=2.0)
    words = f"{name}process time {shown.process_time_s:.2f} s\n{_chain_words(shown)}"
    axes.set_title(words)


def _chain_words(shown: Scene) -> str:
    if shown.dominant is None:
        return "no path of strong contacts to the bowl"
    weakest = shown.frame.normal_force[list(shown.dominant.contacts)].min()
    return f"outlined: {len(shown.dominant.particles)} particles, bottleneck {weakest:.2f} N"


def _trace(axes: Axes, moments: PeakAndQuiet, marked_s: Sequence[float]) -> None:
    axes.plot(moments.time_s, moments.resistance_n, color=COLOURS["drag"], linewidth=0.7)
    for name, at, lift in zip(("peak", "lowest"), marked_s, (4, -9), strict=True):
        level = moments.resistance_at(at)
        axes.axvline(at, color=COLOURS["peak"], linewidth=0.8, linestyle=":")
        axes.plot([at], [level], "o", color=COLOURS["peak"], markersize=5)
        axes.annotate(
            name,
            (at, level),
            (5, lift),
            textcoords="offset points",
            color=COLOURS["peak"],
            weight="bold",
        )
    axes.set(xlabel="process time (s)", ylabel="drag force\nmagnitude (N)")
    axes.margins(x=0.01, y=0.15)


# --- the film --------------------------------------------------------------------------------


def _film(moments: PeakAndQuiet, pictures: int) -> bytes:
    """The peak as an animated GIF, seen from above."""
    scenes = _scenes(moments, pictures)
    largest = _largest_force(scenes)
    return _animate([_picture(moments, shown, largest) for shown in scenes])


def film_steps(steps: Ints, process_s: Floats, peak_s: float, pictures: int = PICTURES) -> Ints:
    """Choose evenly spaced frames around the peak, that nearest to it among them."""
    inside = np.flatnonzero((process_s >= peak_s - BEFORE_S) & (process_s <= peak_s + AFTER_S))
    if not inside.size:
        return np.array([], dtype=np.int64)
    every = max(1, -(-len(inside) // pictures))
    nearest = int(np.abs(process_s[inside] - peak_s).argmin())
    return np.asarray(steps[inside[nearest % every :: every]])


def _scenes(moments: PeakAndQuiet, pictures: int) -> list[Scene]:
    run_dir, start_s = moments.run_dir, drag_start_s(moments.case)
    network = read_table(run_dir / "tables" / "network.parquet", ["step", "time_s"])
    process_s = network["time_s"].to_numpy(np.float64) - start_s
    steps = film_steps(network["step"].to_numpy(np.int64), process_s, moments.peak_s, pictures)
    if not steps.size:
        raise TableError(
            f"{run_dir}: no network frame is near the peak at {moments.peak_s:.2f} s of process "
            "time; write the outputs contacts and particles more often"
        )
    wanted, place = set(steps.tolist()), workpiece_places(run_dir, moments.case)
    frames = read_frames(run_dir, (int(steps[0]), int(steps[-1])))
    chosen = (frame for frame in frames if frame.step in wanted)
    return [scene.scene_of(frame, place, start_s) for frame in chosen]


def _picture(moments: PeakAndQuiet, shown: Scene, largest_n: float) -> Image.Image:
    path = shown.dominant
    kept = np.array([] if path is None else path.contacts, dtype=np.int64)
    figure = Figure(figsize=(4.6, 6.0), dpi=100)
    axes = figure.add_axes((0.13, 0.32, 0.845, 0.615))
    _network(axes, moments, shown, "xy", Look(_FILM_PIXELS_PER_MM, largest_n, kept))
    below = figure.add_axes((0.13, 0.075, 0.845, 0.155))
    near = np.abs(moments.time_s - moments.peak_s) <= 1.05 * max(BEFORE_S, AFTER_S)
    below.plot(
        moments.time_s[near], moments.resistance_n[near], color=COLOURS["drag"], linewidth=0.8
    )
    at = shown.process_time_s
    below.axvline(at, color=COLOURS["peak"], linewidth=0.8)
    below.plot([at], [moments.resistance_at(at)], "o", color=COLOURS["peak"], markersize=6)
    below.set(xlabel="process time (s)")
    below.set_ylabel("drag force\nmagnitude (N)", fontsize=8)
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=100)
    with Image.open(drawn) as picture:
        return picture.convert("RGB")


def _swatches() -> Image.Image:
    """The colours of forces, bright and dark, and of marks, so that none is lost."""
    bright = force_map()(np.linspace(0.0, 1.0, 16))[:, :3]
    own = [COLOURS[name] for name in ("drag", "peak", "dominant_path")]
    marks = np.array([to_rgb(colour) for colour in (*own, "white")])
    greys = np.linspace(0.0, 1.0, 16)[:, None].repeat(3, axis=1)
    rows = [bright, 0.7 * bright, np.repeat(marks, 4, axis=0), greys]
    return Image.fromarray(np.rint(255.0 * np.stack(rows)).astype(np.uint8))


def _animate(pictures: Sequence[Image.Image]) -> bytes:
    """The pictures, all of one size, as a GIF that repeats, with one palette for all."""
    some = pictures[:: max(1, len(pictures) // 6)]
    width, height = some[0].size
    sheet = Image.new("RGB", (width, height * (len(some) + 1)))
    for at, picture in enumerate(some):
        sheet.paste(picture, (0, at * height))
    swatches = _swatches().resize((width, height), Image.Resampling.NEAREST)
    sheet.paste(swatches, (0, height * len(some)))
    palette = sheet.quantize(_COLOURS)
    flat = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    file = BytesIO()
    flat[0].save(
        file, format="gif", save_all=True, append_images=flat[1:], duration=PICTURE_MS, loop=0,
        optimize=False,
    )  # fmt: skip
    return file.getvalue()
