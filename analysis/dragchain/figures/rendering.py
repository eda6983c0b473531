"""Pictures that VTK renders off screen.

On a machine without a display that needs EGL with a software driver: on Debian and Ubuntu the
packages ``libegl1`` and ``libgl1-mesa-dri``.
"""

import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import DragdeckError

Image = NDArray[np.uint8]
"""A picture, (H, W, 3)."""

_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"


class RenderError(DragdeckError):
    """Off-screen rendering does not work on this machine."""


@dataclass(frozen=True)
class Camera:
    """A camera of a parallel projection: where it is and looks, m, and what is up for it."""

    position: Sequence[float]
    focal_point: Sequence[float]
    up: Sequence[float] = (0.0, 0.0, 1.0)


_EMPTY_PICTURE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(vtkRenderer())
window.Render()
"""
"""As little of VTK as renders at all: its import takes a tenth of pyvista's."""


def check_rendering() -> None:
    """Render one empty picture in a process of its own, for VTK ends the process where it cannot.

    Raises
    ------
    RenderError
        If that process fails.
    """
    _prefer_egl()
    words = [sys.executable, "-c", _EMPTY_PICTURE]
    done = subprocess.run(
        words, capture_output=True, encoding="utf-8", errors="replace", check=False
    )
    if done.returncode != 0:
        said = re.sub(r"\x1b\[[0-9;]*m", "", done.stderr).strip().splitlines()
        raise RenderError(
            f"off-screen rendering ended with status {done.returncode}: "
            f"{said[-1] if said else 'no message'}\n  remedy: install EGL with a software driver "
            "(Debian, Ubuntu: libegl1 and libgl1-mesa-dri)"
        )


def _prefer_egl() -> None:
    """Spare VTK the search for an X server where there is none; a user's own window is not used."""
    os.environ.pop(_WINDOW, None)
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ[_WINDOW] = "vtkEGLRenderWindow"


def new_plotter(width: int, height: int) -> Any:
    """A plotter of so many pixels with a white background."""
    _prefer_egl()
    import pyvista as pv

    plotter: Any = pv.Plotter(off_screen=True, window_size=[width, height])
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def photograph(plotter: Any, camera: Camera, height_m: float) -> Image:
    """What a camera sees of a plotter's meshes, `height_m` from edge to edge; ends the plotter."""
    view = plotter.camera
    view.focal_point = tuple(camera.focal_point)
    view.position = tuple(camera.position)
    view.up = tuple(camera.up)
    view.parallel_projection = True
    view.parallel_scale = height_m / 2
    plotter.renderer.reset_camera_clipping_range()
    image: Image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image
