import pytest
from matplotlib.figure import Figure

from dragchain.figures.panels import legend_below, new_panels
from dragchain.figures.style import WIDTH_IN, drawing


@pytest.mark.parametrize(("count", "columns", "made"), [(1, 0, 1), (3, 0, 3), (5, 3, 6), (2, 3, 2)])
def test_panels_that_nothing_is_drawn_on_are_hidden(count: int, columns: int, made: int) -> None:
    figure, panels = new_panels(3.0, count, columns=columns)
    assert len(panels) == count and len(figure.axes) == made
    assert [axes.get_visible() for axes in figure.axes] == [True] * count + [False] * (made - count)


def drawn(labels: list[str]) -> Figure:
    """A figure whose two panels both name all series, with its legend."""
    figure, panels = new_panels(3.0, 2)
    for axes in panels:
        for label in labels:
            axes.plot([0, 1], label=label)
    return legend_below(figure)


@pytest.mark.parametrize("letters", [12, 40])
@pytest.mark.parametrize("count", [1, 7])
def test_a_legend_fits_into_the_figure(letters: int, count: int) -> None:
    with drawing():
        figure = drawn([chr(97 + number) + "m" + "e" * (letters - 2) for number in range(count)])
        figure.draw_without_rendering()
        (legend,) = figure.legends
        box = legend.get_window_extent()
    assert box.width <= WIDTH_IN * figure.dpi
