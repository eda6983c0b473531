"""The arrays and compiled loops against the plain oracle: the same to the last bit."""

from dataclasses import replace

import numpy as np
import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st
from networks import random_frame, real_frame
from plain_chains import plain_paths, plain_peters, plain_stress, plain_table

from dragchain.network.chains import (
    dominant_path,
    particle_stress,
    peters_rows,
    widest_paths,
)
from dragchain.network.frame import NetworkFrame
from dragchain.network.write import chain_table

frames = st.builds(
    random_frame,
    st.integers(0, 2**32 - 1),
    edge=st.integers(2, 7),
    levels=st.sampled_from([None, 1, 2, 5]),
    jitter=st.sampled_from([0.0, 0.3]),
)


def assert_same_table(frame: NetworkFrame) -> None:
    found, plain = chain_table(frame), plain_table(frame)
    if plain.empty:
        assert found.empty
        return
    plain = plain[list(found.columns)].astype(found.dtypes.to_dict())
    pd.testing.assert_frame_equal(found, plain, check_exact=True)


@given(frames)
@settings(max_examples=30)
def test_tables_of_random_networks(frame: NetworkFrame) -> None:
    assert_same_table(frame)


@given(frames, st.sampled_from([0.3, 1.0, 2.0]), st.booleans())
@settings(max_examples=30)
def test_paths_of_random_networks(
    frame: NetworkFrame, threshold: float, with_workpiece: bool
) -> None:
    plain = plain_paths(frame, threshold, with_workpiece=with_workpiece)
    found = widest_paths(frame, threshold, with_workpiece=with_workpiece)
    assert found == plain
    best = dominant_path(frame, found, with_workpiece=with_workpiece)
    assert best == dominant_path(frame, plain, with_workpiece=with_workpiece)


@given(frames, st.sampled_from([30.0, 45.0, 60.0]), st.sampled_from([0.3, 1.0, 2.0]))
@settings(max_examples=30)
def test_peters_chains_of_random_networks(frame: NetworkFrame, angle: float, factor: float) -> None:
    alpha = float(np.radians(angle))
    np.testing.assert_array_equal(particle_stress(frame), plain_stress(frame))
    chains = peters_rows(frame, alpha, factor).particle_lists()
    assert chains == plain_peters(frame, alpha, factor)


def test_the_table_of_a_real_frame() -> None:
    frame = real_frame()
    assert frame.normal_force.size == 3442
    assert len(chain_table(frame)) > 50
    assert_same_table(frame)


def test_a_real_frame_with_rounded_forces_has_ties() -> None:
    frame = real_frame()
    step = frame.mean_force_n() / 2.0
    forces = np.ceil(frame.normal_force / step) * step
    assert np.unique(forces).size < 100
    assert_same_table(replace(frame, normal_force=forces))
