"""The page of a layout: one HTML file with its own viewer, which needs no other file."""

import base64
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np

from dragdeck.preview.layout import COLOURS, Floats, Layout, MovingWorkpiece, views
from dragdeck.preview.swept import drawn

if TYPE_CHECKING:
    from trimesh import Trimesh

_FRAMES_PER_LEG = 120
"""Positions of the slider in a leg."""


@dataclass(frozen=True)
class Words:
    """What a page says beside its pictures: plain text, which is escaped.

    Attributes
    ----------
    title, study, case : str
    numbers : mapping
        Tables by their headings, each of rows of a name and a value.
    warnings : sequence of str
    refusal : str
        Why ``check`` refuses the study; empty if it does not.
    """

    title: str
    study: str
    case: str
    numbers: Mapping[str, Sequence[tuple[str, str]]]
    warnings: Sequence[str]
    refusal: str

    @property
    def heading(self) -> str:
        """Title of the picture, with a line each for the gaps and for the first reason against."""
        gaps = (f"{name}: {text}" for name, text in next(iter(self.numbers.values()))[:2])
        refused = textwrap.wrap("REFUSED: " + self.refusal.splitlines()[0]) if self.refusal else []
        return "\n".join([f"{self.study}, case {self.case}", *gaps, *refused])


def page(layout: Layout, swept: Sequence["Trimesh"], words: Words, png: bytes) -> str:
    """The page of a layout and the volumes that its workpieces sweep, as HTML."""
    loader = jinja2.PackageLoader("dragdeck", "preview")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("preview.html.j2").render(
        words=words, scene=_scene(layout, swept), png=base64.b64encode(png).decode("ascii")
    )


def _scene(layout: Layout, swept: Sequence["Trimesh"]) -> dict[str, Any]:
    """What the viewer draws, as plain data; lengths in mm."""
    fixed = [*(_surface(one, "swept", 0.35) for one in swept)]
    fixed += [_surface(layout.bed, "bed", 0.3), _surface(layout.bowl, "bowl", 0.35)]
    return {
        "height": 1e3 * layout.bowl_height_m,
        "radius": 1e3 * layout.bowl_radius_m,
        "fixed": fixed,
        "moving": [_moving(body) for body in layout.workpieces],
        "views": [
            {"title": one.title, "basis": np.round(one.basis, 6).tolist()}
            for one in views(layout.workpieces[0].direction_rad)
        ],
    }


def _moving(body: MovingWorkpiece) -> dict[str, Any]:
    """A workpiece with the frames of the slider, and the lines of its path."""
    frames, lines = [], []
    for stage in body.stages:
        last = len(stage.poses) - 1
        rows = np.unique(np.linspace(0, last, _FRAMES_PER_LEG).round().astype(int))
        seconds = stage.duration_s * rows / last
        for pose, time in zip(stage.poses[rows], seconds, strict=True):
            pose = pose * np.array([[1, 1, 1, 1e3]] * 3 + [[1, 1, 1, 1]])
            frames.append([np.round(pose.T, 4).ravel().tolist(), f"{stage.name}, {time:.2f} s"])
        points = _rounded(stage.poses[:, :3, 3])
        lines.append({"points": points, "colour": _rgb(stage.name, 1.0)})
    return {**_surface(drawn(body.mesh), "workpiece", 1.0), "frames": frames, "lines": lines}


def _surface(mesh: "Trimesh", name: str, opacity: float) -> dict[str, Any]:
    triangles = mesh.faces.ravel().tolist()
    return {
        "points": _rounded(mesh.vertices),
        "triangles": triangles,
        "colour": _rgb(name, opacity),
    }


def _rounded(points: Floats) -> list[float]:
    return (1e3 * points).round(3).ravel().tolist()


def _rgb(name: str, opacity: float) -> list[float]:
    channels = bytes.fromhex(COLOURS[name].removeprefix("#"))
    return [*(round(channel / 255, 3) for channel in channels), opacity]
