import numpy as np
import pytest
from matplotlib.axes import Axes

from dragchain.figures.panels import compass, compass_bars, depth_bars, new_figure, new_panels
from dragchain.statistics.estimate import Estimate, EstimateColumns


@pytest.mark.parametrize(("count", "columns", "made"), [(1, 0, 1), (3, 0, 3), (5, 3, 6), (2, 3, 2)])
def test_panels_that_nothing_is_drawn_on_are_hidden(count: int, columns: int, made: int) -> None:
    figure, panels = new_panels(3.0, count, columns=columns)
    assert len(panels) == count and len(figure.axes) == made
    assert [axes.get_visible() for axes in figure.axes] == [True] * count + [False] * (made - count)


@pytest.fixture
def axes() -> Axes:
    _, (panel,) = new_panels(3.0)
    return panel


def test_an_interval_that_excludes_its_value_reaches_up_to_it(axes: Axes) -> None:
    depth_bars(axes, [0.0, 0.001], EstimateColumns.of([Estimate(1.0, 1.5, 2.0)]))
    (reach,) = axes.collections
    assert reach.get_segments()[0][:, 0].tolist() == [1.0, 2.0]


def test_ahead_and_behind_differ_in_colour() -> None:
    axes = compass(new_figure(3.0))
    columns = EstimateColumns.of([Estimate.around(1.0, 2.0)] * 4)
    compass_bars(axes, [-np.pi, -np.pi / 2, 0.0, np.pi / 2, np.pi], columns)
    behind, ahead, also_ahead, also_behind = (bar.get_facecolor() for bar in axes.patches)
    assert ahead == also_ahead and behind == also_behind and ahead != behind
    assert axes.get_rmin() == 0.0  # an interval beyond zero ends there
