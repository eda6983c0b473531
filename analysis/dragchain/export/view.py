"""A view of an export for ParaView, which runs this script; dragchain only copies it.

    pvpython --force-offscreen-rendering view.py --picture view.png --frame 20
    paraview --script=view.py

What differs between runs is in ``view.json`` beside it, as numbers and flags.
"""

import argparse
import json
import os
import sys

from paraview import simple as pv

INK, STEEL, GLASS = [0.11, 0.15, 0.20], [0.60, 0.63, 0.67], [0.75, 0.78, 0.82]
SPEED = ("v", "Speed (m/s)", "Viridis (matplotlib)")
FORCE = ("max_normal_force_n", "Largest normal force (N)", "Viridis (matplotlib)")
CONTACT = ("normal_force_n", "Normal force (N)", "Inferno (matplotlib)")
LOAD = ("mean_pressure_pa", "Mean pressure (Pa)", "Plasma (matplotlib)")
CHAINS = (
    ("peters_chain", "force chains", [0.34, 0.71, 0.91]),
    ("dominant", "dominant path", [0.00, 0.45, 0.70]),
)
DIRECTION = (0.35, -1.0, 0.5)
"""From the bowl towards the camera."""

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
"""Keeps the cuts at the workpiece while time goes on; ParaView takes it as text."""


def main():
    """Build the view; without a window, save its picture."""
    wanted, folder = arguments(), script_folder()
    with open(os.path.join(folder, "view.json"), encoding="utf-8") as stream:
        about = json.load(stream)
    pv._DisableFirstRenderCameraReset()
    pv.LoadPalette("WhiteBackground")
    view = pv.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesLabelColor = INK
    if wanted.picture:
        view.ViewSize = wanted.size
    read = {
        name: pv.OpenDataFile(os.path.join(folder, f"{name}.pvd"), registrationName=name)
        for name in about["parts"]
    }
    go_to_frame(read["particles"].TimestepValues, wanted.frame, view)
    shown = dict(read)
    if "workpiece" in read:
        diameter_m = 2 * float(about["particle_radius_m"])
        shown["particles"] = cut_at_workpiece(read["particles"], "particles", -2 * diameter_m)
        shown["contacts"] = cut_at_workpiece(read["contacts"], "contacts", 3 * diameter_m)
        follow_workpiece(read["workpiece"], view)
        show_workpiece(view, read["workpiece"], about)
    if "contacts" in read:
        show_contacts(view, shown["contacts"], about)
    show_particles(view, shown["particles"], about, FORCE if wanted.colour == "force" else SPEED)
    show_bowl(view, float(about["bowl_radius_m"]), float(about["bowl_height_m"]))
    show_time(view, read["particles"])
    look(view, about)
    if wanted.picture:
        pv.SaveScreenshot(wanted.picture, view, ImageResolution=wanted.size)


def arguments():
    """What the command line asks for; ParaView's window passes nothing on."""
    parser = argparse.ArgumentParser(description="A view of an export of dragchain.")
    in_window = sys.argv == [""]
    parser.add_argument("--picture", metavar="FILE", required=not in_window, help="PNG to write")
    parser.add_argument("--frame", type=int, default=-1, metavar="N",
                        help="number of the frame from 0; -1 is the last (default)")
    parser.add_argument("--colour", choices=("speed", "force"), default="speed",
                        help="what colours the particles")
    parser.add_argument("--size", type=int, nargs=2, default=(1600, 1200), metavar="PIXELS",
                        help="width and height of the picture")
    return parser.parse_args([] if in_window else None)  # fmt: skip


def script_folder():
    """The folder of this script, whose name ParaView's window does not tell."""
    names = [globals().get("__file__", "")]
    if os.path.exists("/proc/self/cmdline"):
        with open("/proc/self/cmdline", encoding="utf-8", errors="surrogateescape") as stream:
            names += [word.split("--script=")[-1] for word in stream.read().split("\0")]
    found = [os.path.dirname(name) for name in names if os.path.basename(name) == "view.py"]
    return os.path.abspath(found[0] if found else ".")


def go_to_frame(times_s, number, view):
    """Show the frame of this number; negative numbers count from the last."""
    times_s = list(times_s) if hasattr(times_s, "__len__") else [times_s]
    if not -len(times_s) <= number < len(times_s):
        sys.exit(f"view.py: --frame {number}: the frames are 0 to {len(times_s) - 1}")
    scene = pv.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = view.ViewTime = times_s[number]


def coloured(view, shown, kind, array, about):
    """Colour by an array, with the scale of the whole export and a colour bar."""
    name, title, preset = array
    pv.ColorBy(shown, (kind, name, "Magnitude") if name == "v" else (kind, name))
    colours = pv.GetColorTransferFunction(name)
    colours.ApplyPreset(preset, True)
    if array is CONTACT:
        colours.InvertTransferFunction()
    colours.RescaleTransferFunction(0.0, float(about["upper"].get(name, 0.0)) or 1.0)
    colours.AutomaticRescaleRangeMode = "Never"
    bar = pv.GetScalarBar(colours, view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = INK
    bar.AutomaticLabelFormat, bar.LabelFormat, bar.RangeLabelFormat = 0, "%.3g", "%.3g"
    bar.ScalarBarLength = 0.2
    bar.WindowLocation = "Any Location"
    bar.Position = [0.84, 0.05 + 0.28 * about.setdefault("bars", 0)]
    about["bars"] += 1
    shown.SetScalarBarVisibility(view, True)


def plain(shown, colour):
    """Draw in one colour."""
    shown.ColorArrayName = [None, ""]
    shown.DiffuseColor = shown.AmbientColor = colour


def show_particles(view, source, about, array):
    """Particles as spheres."""
    shown = pv.Show(source, view)
    shown.SetRepresentationType("Point Gaussian")
    shown.ShaderPreset = "Sphere"
    shown.GaussianRadius = 1.0
    shown.ScaleByArray, shown.SetScaleArray = 1, ["POINTS", "radius"]
    shown.UseScaleFunction = 0
    coloured(view, shown, "POINTS", array, about)


def cut_at_workpiece(source, name, offset_m):
    """What lies behind a vertical plane, that far in front of the workpiece's axis."""
    cut = pv.Clip(source, registrationName=f"cut {name}", Invert=1, Crinkleclip=1)
    cut.ClipType.Normal, cut.ClipType.Offset = [DIRECTION[0], DIRECTION[1], 0.0], offset_m
    return cut


def follow_workpiece(workpiece, view):
    """Let the cuts go with the workpiece."""
    cue = pv.PythonAnimationCue()
    cue.Script = FOLLOW
    pv.GetAnimationScene().Cues.append(cue)
    workpiece.UpdatePipeline(view.ViewTime)
    place = {}
    exec(FOLLOW, place)
    place["tick"](cue)


def show_contacts(view, contacts, about):
    """Contacts as cylinders whose radius grows with the normal force, and the chains."""
    ends = pv.CellDatatoPointData(contacts, registrationName="contact ends")
    shown = pv.Show(cylinders(ends, "contact cylinders", 1.0, about), view)
    coloured(view, shown, "POINTS", CONTACT, about)
    for name, title, colour in CHAINS if about["chains"] else ():
        part = pv.Threshold(ends, registrationName=title, Scalars=["POINTS", name])
        part.ThresholdMethod, part.UpperThreshold = "Above Upper Threshold", 1.0
        shown = pv.Show(cylinders(part, f"{title}: cylinders", 1.5, about), view)
        plain(shown, colour)
        shown.Visibility = int(name == "dominant")


def cylinders(lines, name, size, about):
    """Lines as cylinders; their radius grows with the normal force and is `size` times as large."""
    thinnest, thickest = (part * size * float(about["particle_radius_m"]) for part in (0.04, 0.4))
    upper = float(about["upper"].get("normal_force_n", 0.0)) or 1.0
    width = pv.Calculator(
        pv.ExtractSurface(lines, registrationName=f"{name}: axes"),
        registrationName=f"{name}: radii",
        ResultArrayName="width_m",
        Function=f"{thinnest!r}+{thickest!r}*min(normal_force_n/{upper!r},1)",
    )
    tubes = pv.Tube(width, registrationName=name, NumberofSides=10, Capping=1)
    tubes.Scalars, tubes.VaryRadius = ["POINTS", "width_m"], "By Absolute Scalar"
    return tubes


def show_workpiece(view, workpiece, about):
    """The workpiece, with its load map if the export has it."""
    shown = pv.Show(workpiece, view)
    if about["load_map"]:
        coloured(view, shown, "CELLS", LOAD, about)
    else:
        plain(shown, STEEL)


def show_bowl(view, radius_m, height_m):
    """The far half of the wall of the bowl, and its floor."""
    bowl = pv.Cylinder(registrationName="bowl", Radius=radius_m, Height=height_m, Resolution=96)
    bowl.Capping = 0
    shown = pv.Show(bowl, view)
    shown.Orientation, shown.Position = [90.0, 0.0, 0.0], [0.0, 0.0, height_m / 2]
    floor = pv.Disk(registrationName="floor", InnerRadius=0.0, OuterRadius=radius_m)
    floor.CircumferentialResolution = 96
    for part in (shown, pv.Show(floor, view)):
        plain(part, GLASS)
        part.Opacity = 0.2
    shown.BackfaceRepresentation = "Cull Frontface"


def show_time(view, particles):
    """The time in s, in a corner."""
    text = pv.AnnotateTimeFilter(particles, registrationName="time")
    text.Format = "t = {time:.3f} s"
    shown = pv.Show(text, view)
    shown.Color, shown.WindowLocation = INK, "Upper Left Corner"


def look(view, about):
    """Put the camera where the whole bowl is seen."""
    radius_m, height_m = float(about["bowl_radius_m"]), float(about["bowl_height_m"])
    size_m = max(radius_m, height_m / 2)
    length = sum(part**2 for part in DIRECTION) ** 0.5
    focus = [0.0, 0.0, 0.5 * height_m]
    view.CameraFocalPoint = focus
    view.CameraPosition = [
        at + 5.0 * size_m * part / length for at, part in zip(focus, DIRECTION)
    ]
    view.CameraViewUp = [0.0, 0.0, 1.0]
    pv.Render(view)


main()
