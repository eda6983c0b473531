"""The particles of a run as one text file in the extended XYZ format.

Of the text formats that OVITO reads, this one says in each frame's header what every
column is and of which type, holds the time in s beside the step, and is read by other
programs too; a LAMMPS dump has neither types nor, in most readers, the time.
"""

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

from dragchain.export.frames import FrameData, FrameSeries
from dragchain.network.statistics import contact_counts

MAIN = "run.xyz"
"""The file to open."""

_COLUMNS = {
    "id": ("particle_id",),
    "pos": ("x_m", "y_m", "z_m"),
    "velo": ("vx_m_s", "vy_m_s", "vz_m_s"),
    "omega": ("wx_rad_s", "wy_rad_s", "wz_rad_s"),
    "radius": ("radius_m",),
}
"""Columns of ``particles.parquet`` under the names by which OVITO knows them."""

_SPECIES = "X"
"""What each line begins with, as in any XYZ file: no chemical element."""

_PLAIN = pyarrow.csv.WriteOptions(include_header=False, delimiter=" ", quoting_style="none")


def write_xyz(folder: Path, _series: FrameSeries, frames: Iterable[FrameData]) -> None:
    """Write frames one after another, with numbers that read back to the last bit."""
    with (folder / MAIN).open("wb") as stream:
        for frame_data in frames:
            columns = {"species": pa.repeat(_SPECIES, len(frame_data.particles))}
            for name in chain.from_iterable(_COLUMNS.values()):
                columns[name] = pa.array(frame_data.particles[name].to_numpy())
            if frame_data.network is not None:
                columns["coordination"] = pa.array(contact_counts(frame_data.network))
            stream.write(_header(frame_data).encode())
            pyarrow.csv.write_csv(pa.table(columns), stream, _PLAIN)
            stream.flush()


def _header(frame_data: FrameData) -> str:
    """The two lines before the particles of a frame."""
    kinds = [f"{name}:{'I' if name == 'id' else 'R'}:{len(of)}" for name, of in _COLUMNS.items()]
    if frame_data.network is not None:
        kinds.append("Coordination:I:1")
    words = [
        f"Properties=species:S:1:{':'.join(kinds)}",
        f"Time={frame_data.time_s!r}",
        f"Timestep={frame_data.step}",
        'pbc="F F F"',
    ]
    if frame_data.workpiece is not None:
        words.append(
            f'workpiece_m="{" ".join(map(repr, np.asarray(frame_data.workpiece[0]).tolist()))}"'
        )
    return f"{len(frame_data.particles)}\n{' '.join(words)}\n"
