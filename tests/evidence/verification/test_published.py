"""The published points."""

from importlib import resources

import numpy as np
import pandas as pd
import pytest

from evidence.verification.published import published
from evidence.verification.quantities import QUANTITIES


def test_published_curves_are_in_order_and_only_where_they_belong() -> None:
    curve = published("oblique_angle", "aluminium_oxide on rigid", "spin_rad_s")
    assert curve.spans(30.0)
    assert not curve.spans(89.0)
    assert curve.at(29.96) == pytest.approx(-616.5)
    assert len(published("oblique_angle", "no such", "spin_rad_s").x) == 0


def test_every_published_point_is_a_number() -> None:
    with resources.files("evidence.verification").joinpath("published.csv").open() as file:
        table = pd.read_csv(file, comment="#")
    assert np.isfinite(table[["x", "y"]].to_numpy()).all()
    assert set(table["test"]) <= {*QUANTITIES, "elastic_pair", "elastic_plane"}
