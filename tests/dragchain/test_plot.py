from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from figure_files import DRAG_START, STEP_S, write_process_run
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain import FinishedRun, UnknownNameError, load, plot
from dragchain.report import run_figures

PLOTS = (
    *(plot.drag, plot.bottleneck, plot.force_around, plot.force_over_depth),
    *(plot.chain_lengths, plot.contact_forces),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """A run with one peak; each frame has one whole path of two particles."""
    return load(write_process_run(tmp_path_factory.mktemp("made"))).run()


@pytest.fixture(autouse=True)
def off_screen() -> Iterator[None]:
    pyplot.switch_backend("agg")
    yield
    pyplot.close("all")


def new_axes(draw: Callable[..., Any]) -> Axes:
    polar = {"projection": "polar"} if draw is plot.force_around else {}
    return Figure().add_subplot(**polar)


def lines(axes: Axes) -> list[Any]:
    return [np.asarray(line.get_xydata()).tolist() for line in axes.get_lines()]


def bars(axes: Axes) -> list[Any]:
    """Corners of all patches; those of bins without contacts are 0."""
    corners = [one.get_patch_transform().transform(one.get_path().vertices) for one in axes.patches]
    return [np.nan_to_num(one).tolist() for one in corners]


@pytest.mark.parametrize("draw", PLOTS, ids=lambda draw: draw.__name__)
def test_a_plot_is_on_the_axes_that_are_given_or_on_new_ones(
    run: FinishedRun, draw: Callable[..., Any]
) -> None:
    ours = new_axes(draw)
    others = new_axes(draw)
    assert draw(run, ours) is ours
    assert ours.has_data() and not others.has_data()
    own = draw(run)
    assert own.figure is not ours.figure
    assert lines(own) == lines(ours) and bars(own) == bars(ours)


def test_the_report_has_the_same_panels(run: FinishedRun) -> None:
    found = run.findings
    (report,) = run_figures.forces(run, found).axes
    assert lines(report) == lines(plot.drag(run, peaks=False))
    left, right = run_figures.force_depth(run, found).axes
    assert bars(left) == bars(plot.force_over_depth(run))
    assert bars(right) == bars(plot.force_over_depth(run, total=True)) != bars(left)
    _, lower = run_figures.chains_peaks(run, found).axes
    assert lines(lower) == lines(plot.bottleneck(run))
    (around,) = run_figures.force_around_workpiece(run, found).axes
    assert bars(around) == bars(plot.force_around(run))


def test_the_drag_is_drawn_with_its_peaks(run: FinishedRun) -> None:
    axes = plot.drag(run)
    drag = np.array(lines(axes)[1])
    force = run.force[run.force["phase"] == "drag"]
    assert drag[:, 1].tolist() == force["drag_n"].tolist()
    assert drag[:, 0] == pytest.approx((force["step"] - DRAG_START) * STEP_S)
    (peak,) = lines(axes)[-1]
    assert peak == pytest.approx([0.23, -5.0])
    assert axes.get_legend() is not None
    assert len(lines(plot.drag(run, peaks=False))) == len(lines(axes)) - 1
    assert len(lines(plot.bottleneck(run, peaks=False))) == len(lines(plot.bottleneck(run))) - 1


def test_the_legend_of_a_narrow_panel_leaves_its_label_free(run: FinishedRun) -> None:
    figure, (panel, *_) = pyplot.subplots(1, 3, figsize=(9, 2))
    axes = plot.drag(run, panel)
    figure.canvas.draw()
    label, legend = axes.xaxis.label.get_window_extent(), axes.get_legend().get_window_extent()
    pyplot.close(figure)
    assert not label.overlaps(legend)


def test_chain_lengths_are_fractions_of_each_definition(run: FinishedRun) -> None:
    axes = plot.chain_lengths(run)
    _, paths = lines(axes)
    assert paths == [[2.0, 1.0]]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels[1] == "widest_path (mean 2.0)"


def test_contact_forces_are_a_density_of_the_frames_in_the_statistics(run: FinishedRun) -> None:
    (steps,) = plot.contact_forces(run).patches
    density, edges, _ = steps.get_data()  # type: ignore[attr-defined]
    assert density @ np.diff(edges) == pytest.approx(1.0)
    counted = run.contacts[run.contacts["step"].isin(run.network["step"])]
    weak = counted["normal_force_n"] / counted["normal_force_n"].mean() < edges[1]
    assert density[0] * edges[1] == pytest.approx(weak.mean())
    axes = plot.contact_forces(run, kind="particle-floor")
    assert axes.get_legend().get_texts()[0].get_text() == "particle-floor (mean 0.01 N)"
    with pytest.raises(UnknownNameError, match=r"(?s)'particle-side-'.*mean 'particle-side'"):
        plot.contact_forces(run, kind="particle-side-")
