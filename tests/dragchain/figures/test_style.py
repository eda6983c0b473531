"""What all figures have in common: minus signs."""

import pytest

from dragchain.figures.panels import head, new_panels
from dragchain.figures.style import png


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("mean -2.55 N (-2.75 to -.5)", "mean \u22122.55 N (\u22122.75 to \u2212.5)"),
        ("tolerance-0.1, 2026-11-23, 1e-05, -- 3", "tolerance-0.1, 2026-11-23, 1e-05, -- 3"),
    ],
)
def test_a_hyphen_before_a_number_becomes_a_minus_sign(written: str, shown: str) -> None:
    figure, (axes,) = new_panels(3.0)
    head(figure, written)
    axes.plot([0, 1], label=written)
    axes.set_title(written)
    legend = axes.legend()
    png(figure)
    texts = [figure.get_suptitle(), axes.get_title("left"), axes.get_title()]
    assert shown in texts and (written == shown or written not in texts)
    assert legend.get_texts()[0].get_text() == shown
