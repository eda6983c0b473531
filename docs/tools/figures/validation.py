"""Mean drag of the paper's study: measured, published, and simulated in several ways."""

from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import COLOURS, GREY, ORANGE
from dragchain.statistics.estimate import student_quantile


def draw() -> Figure:
    """Draw it: one row per packing, setting and changed input, with 95 % confidence intervals."""
    packings, effects = table("validation/packings"), table("validation/effects")
    compared = table("validation/comparison").set_index("label")
    rows: list[tuple[str, float, float, float, str]] = []
    mean, error = packings["drag_n_mean"].mean(), packings["drag_n_mean"].sem()
    half = student_quantile(len(packings) - 1) * error
    rows.append(("all packings, physical E", mean, mean - half, mean + half, COLOURS["drag"]))
    for row in packings.itertuples():
        low, high = row.drag_n_ci95_low, row.drag_n_ci95_high
        rows.append((f"packing {row.seed}", row.drag_n_mean, low, high, COLOURS["drag"]))
    for row in effects[effects["quantity"] == "drag_mean"].itertuples():
        settings = f"E x {row.youngs_modulus_scale:g}, {row.timestep_fraction:.0%}"
        name = settings if row.field != row.field else f"{_short(row.field)} {1e3 * row.value:g} mm"
        values = [mean * (1 + x) for x in (row.change, row.ci95_high, row.ci95_low)]
        rows.append((name, *values, GREY if row.field == row.field else ORANGE))
    figure = Figure(figsize=(7.6, 0.26 * len(rows) + 1.1), layout="constrained")
    axes = figure.subplots()
    measured, published = compared["mean_n"].iloc[0], compared["mean_n"].iloc[1]
    source = "Uhlmann et al. (2015)"
    axes.axvline(measured, color=COLOURS["experiment"], ls="--", label=f"{source}, experiment")
    axes.axvline(published, color=COLOURS["simulation"], ls=":", label=f"{source}, simulation")
    for place, (_, value, low, high, colour) in enumerate(rows):
        axes.errorbar(
            value, -place, xerr=[[value - low], [high - value]], fmt="o", color=colour, capsize=2
        )
    axes.set_yticks([-place for place in range(len(rows))], [row[0] for row in rows])
    axes.set_xlabel("mean drag force (N), 95 % CI")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    axes.grid(axis="y", visible=False)
    return figure


def _short(field: str) -> str:
    names = {
        "workpiece.shape.radius_m": "workpiece radius",
        "motion.path.radius_m": "path radius",
        "bowl.radius_m": "bowl radius",
    }
    return names.get(field, field)
