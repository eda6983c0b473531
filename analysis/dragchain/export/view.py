"""A view of an export for ParaView, which runs this script; dragchain only copies it.

    pvpython --force-offscreen-rendering view.py --picture view.png --frame 20
    paraview --script=view.py

What differs between exports is in ``view.json`` beside it: numbers and a flag.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

from paraview import simple as pv

INK, STEEL, GLASS = [0.11, 0.15, 0.20], [0.60, 0.63, 0.67], [0.75, 0.78, 0.82]

SPEEDS, LOADS = "Viridis (matplotlib)", "Magma (matplotlib)"

COLOURS = {
    "speed": ("v", "Speed (m/s)", SPEEDS),
    "force": ("max_normal_force_n", "Largest normal force (N)", LOADS),
    "contacts": ("normal_force_n", "Normal force (N)", LOADS),
    "workpiece": ("mean_pressure_pa", "Mean pressure (Pa)", LOADS),
}
"""Array, title and colour map; the first two are choices for the particles.

Loads have the map of all figures, `dragchain.figures.style`, but down to black.
"""

CHAINS = {"peters_chain": [0.34, 0.71, 0.91], "dominant": [0.00, 0.45, 0.70]}
"""Array and colour; only the dominant path is shown at first."""

DIRECTION = (0.35, -1.0, 0.5)
"""From the bowl towards the camera."""

DISTANCE = 5.6
"""Of the camera from the middle of the bowl, in radii of the bowl or halves of its height."""

CUTS = {"particles": -2.0, "contacts": 3.0}
"""What is shown ends at a plane this far before the workpiece's axis, in particle diameters."""

FOLLOW = """
from paraview import simple
def start_cue(self): pass
def end_cue(self): pass
def tick(self): move(self.GetClockTime())
def move(time_s):
    workpiece = simple.FindSource('workpiece')
    workpiece.UpdatePipeline(time_s)
    x0, x1, y0, y1, z0, z1 = workpiece.GetDataInformation().GetBounds()
    for cut in filter(None, map(simple.FindSource, ('cut particles', 'cut contacts'))):
        cut.ClipType.Origin = [(x0 + x1) / 2, (y0 + y1) / 2, 0.0]
"""
"""Keeps these planes at the workpiece while time goes on; ParaView takes it as text."""


def main() -> None:
    """Build the view; without a window, save its picture."""
    wanted, folder = arguments(), script_folder()
    pv._DisableFirstRenderCameraReset()
    pv.LoadPalette("WhiteBackground")
    picture = Picture(folder)
    if wanted.picture:
        picture.view.ViewSize = wanted.size
    picture.go_to_frame(wanted.frame)
    picture.show_all(COLOURS[wanted.colour])
    picture.look()
    if wanted.picture:
        pv.SaveScreenshot(wanted.picture, picture.view, ImageResolution=wanted.size)


def arguments() -> argparse.Namespace:
    """What the command line asks for; ParaView's window passes nothing on."""
    parser = argparse.ArgumentParser(description="A view of an export of dragchain.")
    in_window = sys.argv == [""]
    add = parser.add_argument
    add("--picture", metavar="FILE", required=not in_window, help="PNG to write")
    add("--frame", type=int, default=-1, metavar="N", help="from 0; -1 is the last (default)")
    add("--colour", choices=("speed", "force"), default="speed", help="of the particles")
    add("--size", type=int, nargs=2, default=(1600, 1200), metavar="PIXELS", help="of the picture")
    return parser.parse_args([] if in_window else None)


def script_folder() -> str:
    """The folder of this script, whose name ParaView's window does not tell."""
    names = [globals().get("__file__", "")]
    if os.path.exists("/proc/self/cmdline"):
        with open("/proc/self/cmdline", encoding="utf-8", errors="surrogateescape") as stream:
            names += [word.split("--script=")[-1] for word in stream.read().split("\0")]
    found = [os.path.dirname(name) for name in names if os.path.basename(name) == "view.py"]
    return os.path.abspath(found[0] if found else ".")


class Picture:
    """The view of the export in a folder."""

    def __init__(self, folder: str) -> None:
        with open(os.path.join(folder, "view.json"), encoding="utf-8") as stream:
            about = json.load(stream)
        self.chains = bool(about["chains"])
        self.radius_m, self.height_m, self.particle_m = (
            float(about[name]) for name in ("bowl_radius_m", "bowl_height_m", "particle_radius_m")
        )
        self.upper = {name: float(value) or 1.0 for name, value in about["upper"].items()}
        self.bars = 0
        self.view = pv.GetActiveViewOrCreate("RenderView")
        self.view.OrientationAxesLabelColor = INK
        files = {name: os.path.join(folder, f"{name}.pvd") for name in (*CUTS, "workpiece")}
        self.read = {
            name: pv.OpenDataFile(file, registrationName=name)
            for name, file in files.items()
            if os.path.exists(file)
        }

    def go_to_frame(self, number: int) -> None:
        """Show the frame of this number; negative numbers count from the last."""
        times_s = self.read["particles"].TimestepValues
        times_s = list(times_s) if hasattr(times_s, "__len__") else [times_s]
        if not -len(times_s) <= number < len(times_s):
            sys.exit(f"view.py: --frame {number}: the frames are 0 to {len(times_s) - 1}")
        scene = pv.GetAnimationScene()
        scene.UpdateAnimationUsingDataTimeSteps()
        scene.AnimationTime = self.view.ViewTime = times_s[number]

    def show_all(self, colour: Sequence[str]) -> None:
        """Show the parts of the export, the bowl and the time."""
        shown = dict(self.read)
        if "workpiece" in shown:
            self.show_workpiece(shown["workpiece"])
            shown |= {name: self.cut(name) for name in CUTS if name in shown}
            self.follow_workpiece()
        if "contacts" in shown:
            self.show_contacts(shown["contacts"])
        self.show_particles(shown["particles"], colour)
        self.show_bowl()
        self.show_time()

    def cut(self, name: str) -> Any:
        """A part of the export behind its plane."""
        cut = pv.Clip(self.read[name], registrationName=f"cut {name}", Invert=1, Crinkleclip=1)
        cut.ClipType.Normal = [DIRECTION[0], DIRECTION[1], 0.0]
        cut.ClipType.Offset = CUTS[name] * 2 * self.particle_m
        return cut

    def follow_workpiece(self) -> None:
        """Let the planes go with the workpiece."""
        cue = pv.PythonAnimationCue()
        cue.Script = FOLLOW
        pv.GetAnimationScene().Cues.append(cue)
        place: Any = {}
        exec(FOLLOW, place)
        place["move"](self.view.ViewTime)

    def show_particles(self, source: Any, colour: Sequence[str]) -> None:
        """Particles as spheres."""
        shown = pv.Show(source, self.view)
        shown.SetRepresentationType("Point Gaussian")
        shown.ShaderPreset, shown.GaussianRadius, shown.UseScaleFunction = "Sphere", 1.0, 0
        shown.ScaleByArray, shown.SetScaleArray = 1, ["POINTS", "radius"]
        self.coloured(shown, "POINTS", colour)

    def show_contacts(self, contacts: Any) -> None:
        """Contacts as cylinders whose radius grows with the normal force, and the chains."""
        ends = pv.CellDatatoPointData(contacts, registrationName="contact ends")
        shown = pv.Show(self.cylinders(ends, "contact cylinders", 1.0), self.view)
        self.coloured(shown, "POINTS", COLOURS["contacts"])
        for name, colour in CHAINS.items() if self.chains else ():
            part = pv.Threshold(ends, registrationName=name, Scalars=["POINTS", name])
            part.ThresholdMethod, part.UpperThreshold = "Above Upper Threshold", 1.0
            shown = pv.Show(self.cylinders(part, f"{name}: cylinders", 1.5), self.view)
            plain(shown, colour)
            shown.Visibility = int(name == "dominant")

    def cylinders(self, lines: Any, name: str, size: float) -> Any:
        """Lines as cylinders; their radius grows with the normal force, to `size` times as much."""
        thinnest, thickest = (part * size * self.particle_m for part in (0.04, 0.4))
        fraction = f"min(normal_force_n/{self.upper.get('normal_force_n', 1.0)!r},1)"
        surface = pv.ExtractSurface(lines, registrationName=f"{name}: axes")
        width = pv.Calculator(surface, registrationName=f"{name}: radii", ResultArrayName="width_m")
        width.Function = f"{thinnest!r}+{thickest!r}*{fraction}"
        tubes = pv.Tube(width, registrationName=name, NumberofSides=10, Capping=1)
        tubes.Scalars, tubes.VaryRadius = ["POINTS", "width_m"], "By Absolute Scalar"
        return tubes

    def show_workpiece(self, workpiece: Any) -> None:
        """The workpiece, with its load map if the export has it."""
        shown = pv.Show(workpiece, self.view)
        if COLOURS["workpiece"][0] in self.upper:
            self.coloured(shown, "CELLS", COLOURS["workpiece"])
        else:
            plain(shown, STEEL)

    def show_bowl(self) -> None:
        """The far half of the wall of the bowl, and its floor."""
        wall = pv.Cylinder(registrationName="bowl", Radius=self.radius_m, Height=self.height_m)
        wall.Resolution, wall.Capping = 96, 0
        floor = pv.Disk(registrationName="floor", InnerRadius=0.0, OuterRadius=self.radius_m)
        floor.CircumferentialResolution = 96
        shown = pv.Show(wall, self.view)
        shown.Orientation, shown.Position = [90.0, 0.0, 0.0], [0.0, 0.0, self.height_m / 2]
        shown.BackfaceRepresentation = "Cull Frontface"
        for part in (shown, pv.Show(floor, self.view)):
            plain(part, GLASS)
            part.Opacity = 0.2

    def show_time(self) -> None:
        """The time in s, in a corner."""
        text = pv.AnnotateTimeFilter(self.read["particles"], registrationName="time")
        text.Format = "t = {time:.3f} s"
        shown = pv.Show(text, self.view)
        shown.Color, shown.WindowLocation = INK, "Upper Left Corner"

    def coloured(self, shown: Any, kind: str, colour: Sequence[str]) -> None:
        """Colour by an array, with one scale for all frames and a colour bar."""
        name, title, preset = colour
        pv.ColorBy(shown, (kind, name, "Magnitude") if name == "v" else (kind, name))
        colours = pv.GetColorTransferFunction(name)
        colours.ApplyPreset(preset, True)
        if preset == LOADS:
            colours.InvertTransferFunction()
        colours.RescaleTransferFunction(0.0, self.upper.get(name, 1.0))
        colours.AutomaticRescaleRangeMode = "Never"
        bar = pv.GetScalarBar(colours, self.view)
        bar.Title, bar.ComponentTitle, bar.TitleColor, bar.LabelColor = title, "", INK, INK
        bar.AutomaticLabelFormat, bar.LabelFormat, bar.RangeLabelFormat = 0, "%.3g", "%.3g"
        bar.ScalarBarLength, bar.WindowLocation = 0.2, "Any Location"
        bar.Position = [0.84, 0.05 + 0.28 * self.bars]
        self.bars += 1
        shown.SetScalarBarVisibility(self.view, True)

    def look(self) -> None:
        """Put the camera where the whole bowl is seen."""
        size_m = max(self.radius_m, self.height_m / 2)
        distance_m = DISTANCE * size_m / sum(part**2 for part in DIRECTION) ** 0.5
        x, y, z = (distance_m * part for part in DIRECTION)
        self.view.CameraFocalPoint = [0.0, 0.0, self.height_m / 2]
        self.view.CameraPosition = [x, y, z + self.height_m / 2]
        self.view.CameraViewUp = [0.0, 0.0, 1.0]
        pv.Render(self.view)


def plain(shown: Any, colour: Sequence[float]) -> None:
    """Draw in one colour."""
    shown.ColorArrayName = [None, ""]
    shown.DiffuseColor = shown.AmbientColor = colour


if __name__ == "__main__":
    main()
