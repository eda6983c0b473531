"""A view of an export for ParaView, which runs this script; dragchain only copies it.

    pvpython --force-offscreen-rendering view.py --picture view.png --frame 20
    paraview --script=view.py

What differs between exports is in ``view.json`` beside it, as numbers, flags and names of parts.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

from paraview import simple as pv

INK, STEEL, GLASS = [0.11, 0.15, 0.20], [0.60, 0.63, 0.67], [0.75, 0.78, 0.82]

COLOURS = {
    "speed": ("v", "Speed (m/s)", "Viridis (matplotlib)"),
    "force": ("max_normal_force_n", "Largest normal force (N)", "Viridis (matplotlib)"),
    "contacts": ("normal_force_n", "Normal force (N)", "Inferno (matplotlib)"),
    "workpiece": ("mean_pressure_pa", "Mean pressure (Pa)", "Plasma (matplotlib)"),
}
"""Array, title and colour map; the first two are choices for the particles."""

CHAINS = (
    ("peters_chain", "force chains", [0.34, 0.71, 0.91]),
    ("dominant", "dominant path", [0.00, 0.45, 0.70]),
)
"""Array, name and colour; only the dominant path is shown at first."""

DIRECTION = (0.35, -1.0, 0.5)
"""From the bowl towards the camera."""

DISTANCE = 4.5
"""Of the camera from the middle of the bowl, in radii of the bowl or halves of its height."""

PARTICLES_BEHIND, CONTACTS_BEFORE = 2.0, 3.0
"""What is shown ends at planes behind and before the workpiece: distances in particle diameters."""

FOLLOW = """
from paraview import simple
def start_cue(self): pass
def end_cue(self): pass
def tick(self):
    x0, x1, y0, y1, z0, z1 = simple.FindSource('workpiece').GetDataInformation().GetBounds()
    for name in ('cut particles', 'cut contacts'):
        cut = simple.FindSource(name)
        if cut and x0 <= x1:
            cut.ClipType.Origin = [(x0 + x1) / 2, (y0 + y1) / 2, 0.0]
"""
"""Keeps the planes at the workpiece while time goes on; ParaView takes it as text."""


class Export:
    """The files of the export beside this script, and what ``view.json`` says of them."""

    def __init__(self, folder: str) -> None:
        with open(os.path.join(folder, "view.json"), encoding="utf-8") as stream:
            found = json.load(stream)
        self.files = {
            name: os.path.join(folder, f"{name}.pvd")
            for name in ("particles", "contacts", "workpiece")
            if name in found["parts"]
        }
        self.chains, self.load_map = bool(found["chains"]), bool(found["load_map"])
        self.bowl_radius_m = float(found["bowl_radius_m"])
        self.bowl_height_m = float(found["bowl_height_m"])
        self.particle_radius_m = float(found["particle_radius_m"])
        self._upper = found["upper"]

    def upper(self, array: str) -> float:
        """Upper end of the colour scale of an array."""
        return float(self._upper.get(array, 0.0)) or 1.0


def main() -> None:
    """Build the view; without a window, save its picture."""
    wanted, export = arguments(), Export(script_folder())
    pv._DisableFirstRenderCameraReset()
    pv.LoadPalette("WhiteBackground")
    view = pv.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesLabelColor = INK
    if wanted.picture:
        view.ViewSize = wanted.size
    read = {
        name: pv.OpenDataFile(file, registrationName=name) for name, file in export.files.items()
    }
    go_to_frame(view, read["particles"].TimestepValues, wanted.frame)
    show_all(view, read, export, wanted.colour)
    look(view, export)
    if wanted.picture:
        pv.SaveScreenshot(wanted.picture, view, ImageResolution=wanted.size)


def arguments() -> argparse.Namespace:
    """What the command line asks for; ParaView's window passes nothing on."""
    parser = argparse.ArgumentParser(description="A view of an export of dragchain.")
    in_window = sys.argv == [""]
    parser.add_argument("--picture", metavar="FILE", required=not in_window, help="PNG to write")
    parser.add_argument(
        "--frame", type=int, default=-1, metavar="N", help="frame from 0; -1 is the last (default)"
    )
    parser.add_argument(
        "--colour", choices=("speed", "force"), default="speed", help="what colours the particles"
    )
    parser.add_argument(
        "--size", type=int, nargs=2, default=(1600, 1200), metavar=("WIDTH", "HEIGHT"),
        help="pixels of the picture",
    )  # fmt: skip
    return parser.parse_args([] if in_window else None)


def script_folder() -> str:
    """The folder of this script, whose name ParaView's window does not tell."""
    names = [globals().get("__file__", "")]
    if os.path.exists("/proc/self/cmdline"):
        with open("/proc/self/cmdline", encoding="utf-8", errors="surrogateescape") as stream:
            names += [word.split("--script=")[-1] for word in stream.read().split("\0")]
    found = [os.path.dirname(name) for name in names if os.path.basename(name) == "view.py"]
    return os.path.abspath(found[0] if found else ".")


def go_to_frame(view: Any, times_s: Any, number: int) -> None:
    """Show the frame of this number; negative numbers count from the last."""
    times_s = list(times_s) if hasattr(times_s, "__len__") else [times_s]
    if not -len(times_s) <= number < len(times_s):
        sys.exit(f"view.py: --frame {number}: the frames are 0 to {len(times_s) - 1}")
    scene = pv.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = view.ViewTime = times_s[number]


# --- what is shown -----------------------------------------------------------------------------


def show_all(view: Any, read: Any, export: Export, colour: str) -> None:
    """Show the parts of the export, the bowl and the time."""
    bars: list[Any] = []
    shown = dict(read)
    diameter_m = 2 * export.particle_radius_m
    if "workpiece" in read:
        show_workpiece(view, read["workpiece"], export, bars)
        offsets_m = {
            "particles": -PARTICLES_BEHIND * diameter_m,
            "contacts": CONTACTS_BEFORE * diameter_m,
        }
        shown |= {
            name: cut(read[name], name, offsets_m[name]) for name in offsets_m if name in read
        }
        follow(view, read["workpiece"])
    if "contacts" in read:
        show_contacts(view, shown["contacts"], export, bars)
    show_particles(view, shown["particles"], COLOURS[colour], export, bars)
    show_bowl(view, export)
    show_time(view, read["particles"])


def cut(source: Any, name: str, offset_m: float) -> Any:
    """What lies behind a vertical plane, that far in front of the workpiece's axis."""
    found = pv.Clip(source, registrationName=f"cut {name}", Invert=1, Crinkleclip=1)
    found.ClipType.Normal, found.ClipType.Offset = [DIRECTION[0], DIRECTION[1], 0.0], offset_m
    return found


def follow(view: Any, workpiece: Any) -> None:
    """Let the planes go with the workpiece."""
    cue = pv.PythonAnimationCue()
    cue.Script = FOLLOW
    pv.GetAnimationScene().Cues.append(cue)
    workpiece.UpdatePipeline(view.ViewTime)
    place: Any = {}
    exec(FOLLOW, place)
    place["tick"](cue)


def show_particles(
    view: Any, source: Any, colour: Sequence[str], export: Export, bars: Any
) -> None:
    """Particles as spheres."""
    shown = pv.Show(source, view)
    shown.SetRepresentationType("Point Gaussian")
    shown.ShaderPreset, shown.GaussianRadius = "Sphere", 1.0
    shown.ScaleByArray, shown.SetScaleArray = 1, ["POINTS", "radius"]
    shown.UseScaleFunction = 0
    coloured(view, shown, "POINTS", colour, export, bars)


def show_contacts(view: Any, contacts: Any, export: Export, bars: Any) -> None:
    """Contacts as cylinders whose radius grows with the normal force, and the chains."""
    ends = pv.CellDatatoPointData(contacts, registrationName="contact ends")
    shown = pv.Show(cylinders(ends, "contact cylinders", 1.0, export), view)
    coloured(view, shown, "POINTS", COLOURS["contacts"], export, bars)
    for name, title, colour in CHAINS if export.chains else ():
        part = pv.Threshold(ends, registrationName=title, Scalars=["POINTS", name])
        part.ThresholdMethod, part.UpperThreshold = "Above Upper Threshold", 1.0
        shown = pv.Show(cylinders(part, f"{title}: cylinders", 1.5, export), view)
        plain(shown, colour)
        shown.Visibility = int(name == "dominant")


def cylinders(lines: Any, name: str, size: float, export: Export) -> Any:
    """Lines as cylinders; their radius grows with the normal force and is `size` times as large."""
    thinnest, thickest = (part * size * export.particle_radius_m for part in (0.04, 0.4))
    width = pv.Calculator(
        pv.ExtractSurface(lines, registrationName=f"{name}: axes"),
        registrationName=f"{name}: radii",
        ResultArrayName="width_m",
        Function=f"{thinnest!r}+{thickest!r}*min(normal_force_n/{export.upper('normal_force_n')!r},1)",
    )
    tubes = pv.Tube(width, registrationName=name, NumberofSides=10, Capping=1)
    tubes.Scalars, tubes.VaryRadius = ["POINTS", "width_m"], "By Absolute Scalar"
    return tubes


def show_workpiece(view: Any, workpiece: Any, export: Export, bars: Any) -> None:
    """The workpiece, with its load map if the export has it."""
    shown = pv.Show(workpiece, view)
    if export.load_map:
        coloured(view, shown, "CELLS", COLOURS["workpiece"], export, bars)
    else:
        plain(shown, STEEL)


def show_bowl(view: Any, export: Export) -> None:
    """The far half of the wall of the bowl, and its floor."""
    radius_m, height_m = export.bowl_radius_m, export.bowl_height_m
    wall = pv.Cylinder(registrationName="bowl", Radius=radius_m, Height=height_m, Resolution=96)
    wall.Capping = 0
    floor = pv.Disk(registrationName="floor", InnerRadius=0.0, OuterRadius=radius_m)
    floor.CircumferentialResolution = 96
    shown = pv.Show(wall, view)
    shown.Orientation, shown.Position = [90.0, 0.0, 0.0], [0.0, 0.0, height_m / 2]
    shown.BackfaceRepresentation = "Cull Frontface"
    for part in (shown, pv.Show(floor, view)):
        plain(part, GLASS)
        part.Opacity = 0.2


def show_time(view: Any, particles: Any) -> None:
    """The time in s, in a corner."""
    text = pv.AnnotateTimeFilter(particles, registrationName="time")
    text.Format = "t = {time:.3f} s"
    shown = pv.Show(text, view)
    shown.Color, shown.WindowLocation = INK, "Upper Left Corner"


# --- how it is shown ---------------------------------------------------------------------------


def plain(shown: Any, colour: Sequence[float]) -> None:
    """Draw in one colour."""
    shown.ColorArrayName = [None, ""]
    shown.DiffuseColor = shown.AmbientColor = colour


def coloured(
    view: Any, shown: Any, kind: str, colour: Sequence[str], export: Export, bars: Any
) -> None:
    """Colour by an array, with one scale for all frames and a colour bar below those so far."""
    name, title, preset = colour
    pv.ColorBy(shown, (kind, name, "Magnitude") if name == "v" else (kind, name))
    colours = pv.GetColorTransferFunction(name)
    colours.ApplyPreset(preset, True)
    if kind == "POINTS" and name == "normal_force_n":  # weak contacts are pale
        colours.InvertTransferFunction()
    colours.RescaleTransferFunction(0.0, export.upper(name))
    colours.AutomaticRescaleRangeMode = "Never"
    bar = pv.GetScalarBar(colours, view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = INK
    bar.AutomaticLabelFormat, bar.LabelFormat, bar.RangeLabelFormat = 0, "%.3g", "%.3g"
    bar.ScalarBarLength, bar.WindowLocation = 0.2, "Any Location"
    bar.Position = [0.84, 0.05 + 0.28 * len(bars)]
    bars.append(bar)
    shown.SetScalarBarVisibility(view, True)


def look(view: Any, export: Export) -> None:
    """Put the camera where the whole bowl is seen."""
    size_m = max(export.bowl_radius_m, export.bowl_height_m / 2)
    distance_m = DISTANCE * size_m / sum(part**2 for part in DIRECTION) ** 0.5
    middle_m = 0.5 * export.bowl_height_m
    x, y, z = (distance_m * part for part in DIRECTION)
    view.CameraFocalPoint, view.CameraPosition = [0.0, 0.0, middle_m], [x, y, z + middle_m]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    pv.Render(view)


if __name__ == "__main__":
    main()
