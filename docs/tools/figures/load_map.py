"""Where the particles load the workpiece: its lateral surface, unrolled."""

import numpy as np
from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import force_map

BINS = 21
"""Around the workpiece: one per column of its facets."""
ROWS_M = 0.01
"""Height of a row of facets."""


def draw() -> Figure:
    """Draw the load-distance integral per area and path length over azimuth and depth."""
    facets, study = table("validation/run_facets"), table("study/uhlmann2015").iloc[0]
    side = facets[facets["centre_z_m"] > 1e-6]
    depth_m = study["motion_immersion_depth_m"]
    turn = np.degrees(np.arctan2(side["centre_y_m"], side["centre_x_m"]))
    edges = (np.linspace(-180, 180, BINS + 1), np.arange(-0.02, depth_m + 1e-9, ROWS_M))
    depth = depth_m - side["centre_z_m"]
    load, area = (
        np.histogram2d(turn, depth, edges, weights=weights)[0]
        for weights in (side["force_slide_pa"] * side["area_m2"], side["area_m2"])
    )
    figure = Figure(figsize=(7.6, 3.4), layout="constrained")
    axes = figure.subplots()
    values = np.divide(load, area, out=np.zeros_like(load), where=area > 0)
    shown = axes.pcolormesh(edges[0], 1e3 * edges[1], values.T, cmap=force_map())
    axes.axhline(0, color="black", lw=0.8, ls="--")
    axes.text(-176, -1, "bed surface", fontsize=8, va="bottom")
    axes.set(
        xlabel="azimuth from the direction of motion, counter-clockwise (degrees)",
        ylabel="depth (mm)",
        xticks=range(-180, 181, 45),
    )
    axes.invert_yaxis()
    axes.grid(visible=False)
    figure.colorbar(shown, label="load-distance integral per area\nand path length (N/m²)")
    return figure
