"""Make the meshes of this folder again: `python meshes/make_meshes.py`.

The same bytes come out every time, unless the caps' triangulation changes with
the version of VTK.
"""

from __future__ import annotations

from pathlib import Path

from dragdeck import mesh

HERE = Path(__file__).parent


def hex_bar() -> str:
    """Return the STL text, in millimetres, of a hexagonal bar: 10 mm over corners, 80 mm long."""
    bar = mesh.prism(
        sides=6, corner_radius_m=0.005, length_m=0.080, facet_size_m=0.005, facet_length_m=0.005
    )
    return mesh.stl_text(bar, factor=1e3)


if __name__ == "__main__":
    (HERE / "hex_bar.stl").write_text(hex_bar(), encoding="ascii", newline="\n")
