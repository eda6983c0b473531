"""What a deck leaves out of its contacts changes nothing that the analysis gives."""

from pathlib import Path

import pandas as pd
import pytest
from fat_files import fatten

from dragchain import load_outputs, write_tables
from dragchain.network.write import write_chains
from dragchain.run.run_parts import iter_frames

TABLES = (
    "contacts",
    "workpiece_contacts",
    "workpiece_force",
    "particles",
    "thermo",
    "network",
    "chains",
)


@pytest.fixture
def fat_run(tiny_run: Path) -> Path:
    target = tiny_run.with_name("fat")
    fatten(tiny_run, target)
    return target


def test_more_columns_in_another_order_give_the_same_tables(tiny_run: Path, fat_run: Path) -> None:
    for run in (tiny_run, fat_run):
        write_tables(run)
        write_chains(run)
    for name in TABLES:
        lean, fat = (pd.read_parquet(run / f"tables/{name}.parquet") for run in (tiny_run, fat_run))
        assert len(lean) > 0
        pd.testing.assert_frame_equal(lean, fat, check_exact=True)
    lean_json, fat_json = ((run / "tables/closure.json").read_text() for run in (tiny_run, fat_run))
    assert lean_json == fat_json


def test_the_overlap_is_what_the_particle_frames_give(fat_run: Path) -> None:
    outputs = load_outputs(fat_run)
    frames = list(iter_frames(fat_run, outputs["contacts"]))
    assert sum(frame.rows for frame in frames) > len(frames)
    for frame in frames:
        from_particles = frame.columns["radii_m"] - frame.columns["distance_m"]
        # both lengths were written with nine digits
        assert frame.columns["overlap_m"] == pytest.approx(from_particles, abs=2e-10)
