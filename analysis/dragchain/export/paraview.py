"""A run as a time series of ParaView: VTP files, joined by a VTM file a frame and a PVD file.

The files are not compressed and name what a particle has as LIGGGHTS does in its own VTK
files (``id``, ``radius``, ``v``, ``omega``), so that OVITO opens the same series.
"""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.export.frames import MEMBERSHIPS, FrameData, FrameSeries
from dragchain.figures.network_picture import segments
from dragchain.network.chains import major_stress, particle_stress
from dragchain.network.frame import PARTICLE, NetworkFrame
from dragchain.network.statistics import contact_counts
from dragchain.run.workpiece import placed, read_workpiece_mesh
from dragchain.tables.run_folder import Run
from dragdeck.files import write_text, write_vtp

MAIN = "run.pvd"
"""The file to open: all there is."""

_FRAMES = "frames"
FILES = (_FRAMES, MAIN, *(f"{part}.pvd" for part in ("particles", "contacts", "workpiece")))
"""What an export consists of."""

_LOADING = ("mean_pressure_pa", "friction_work_pa", "peak_normal_force_n")


def write_paraview(folder: Path, series: FrameSeries) -> None:
    """Write the frames of a series into an empty folder, and the lists of them."""
    workpiece = None if series.run.case.workpiece is None else _loaded_workpiece(series.run)
    listed = defaultdict[str, list[str]](list)
    (folder / _FRAMES).mkdir()
    for frame_data in series:
        parts = _parts(frame_data, workpiece, with_chains=series.has_chains)
        name = f"{frame_data.step:0{len(str(series.steps[-1]))}d}"
        for part, file in _write_frame(folder / _FRAMES, name, parts).items():
            time, path = f'timestep="{frame_data.time_s!r}" part="0"', f"{_FRAMES}/{file}"
            listed[part].append(f"{time} file={quoteattr(path)}")
    for part, rows in listed.items():
        write_text(folder / f"{part}.pvd", _data_sets("Collection", "0.1", rows))


def _parts(frame_data: FrameData, workpiece: Any, *, with_chains: bool) -> dict[str, Any]:
    parts = {"particles": _particles_mesh(frame_data, with_chains=with_chains)}
    if frame_data.network is not None:
        parts["contacts"] = _contacts_mesh(frame_data, with_chains=with_chains)
    if workpiece is not None and frame_data.workpiece is not None:
        parts["workpiece"] = placed(workpiece, *frame_data.workpiece)
    return parts


def _write_frame(folder: Path, name: str, parts: Mapping[str, Any]) -> dict[str, str]:
    """Write the files of one frame; the file of each part, and of the whole ``run``."""
    files = {part: f"{name}/{name}_{number}.vtp" for number, part in enumerate(parts)}
    rows = []
    for number, (part, file) in enumerate(files.items()):
        write_vtp(folder / file, parts[part], compressed=False)
        rows.append(f'index="{number}" name="{part}" file="{file}"')
    write_text(folder / f"{name}.vtm", _data_sets("vtkMultiBlockDataSet", "1.0", rows))
    return {**files, "run": f"{name}.vtm"}


def _data_sets(kind: str, version: str, rows: list[str]) -> str:
    """A file of VTK that lists other files, each by the attributes of its data set."""
    return (
        '<?xml version="1.0"?>\n'
        f'<VTKFile type="{kind}" version="{version}" byte_order="LittleEndian">\n'
        f"  <{kind}>\n"
        + "".join(f"    <DataSet {row}/>\n" for row in rows)
        + f"  </{kind}>\n</VTKFile>\n"
    )


def _loaded_workpiece(run: Run) -> Any:
    """The workpiece's mesh; if its loading was computed, with the arrays `_LOADING` of its facets.

    The facets of ``facets.parquet`` are in the order of the mesh unless VTK left one out.
    """
    mesh = read_workpiece_mesh(run.folder, run.case)
    file = run.file("facets.parquet")
    if file.is_file():
        facets = pd.read_parquet(file, columns=list(_LOADING))
        if len(facets) == mesh.n_cells:
            for name in _LOADING:
                mesh.cell_data[name] = facets[name].to_numpy(np.float64)
    return mesh


def _particles_mesh(frame_data: FrameData, *, with_chains: bool) -> Any:
    """The particles as points with what is known of each.

    ``id``, ``radius`` (m), ``v`` (m/s) and ``omega`` (rad/s); with contacts
    ``coordination_number``, ``major_stress_pa`` (major compressive principal stress) and
    ``max_normal_force_n`` (of the particle's contacts); with chains ``peters_chain``,
    ``widest_paths`` and ``dominant``, see `_chains`.
    """
    import pyvista as pv

    particles, membership = frame_data.particles, frame_data.membership
    mesh = pv.PolyData(particles[["x_m", "y_m", "z_m"]].to_numpy(np.float64))
    data = mesh.point_data
    data["id"] = particles["particle_id"].to_numpy(np.int64)
    data["radius"] = particles["radius_m"].to_numpy(np.float64)
    data["v"] = particles[["vx_m_s", "vy_m_s", "vz_m_s"]].to_numpy(np.float64)
    data["omega"] = particles[["wx_rad_s", "wy_rad_s", "wz_rad_s"]].to_numpy(np.float64)
    if frame_data.network is not None:
        data["coordination_number"] = contact_counts(frame_data.network).astype(np.int32)
        data["major_stress_pa"] = major_stress(particle_stress(frame_data.network))[0]
        data["max_normal_force_n"] = _max_normal_force(frame_data.network)
    if with_chains:
        _chains(data, membership.particles if membership else None, len(particles))
    return mesh


def _max_normal_force(frame: NetworkFrame) -> Floats:
    """The largest normal force of each particle's contacts, (N,) in N; 0 without contacts."""
    largest = np.zeros(frame.particle_id.size)
    inner = frame.between_particles()
    np.maximum.at(largest, frame.a, frame.normal_force)
    np.maximum.at(largest, frame.b[inner], frame.normal_force[inner])
    return largest


def _contacts_mesh(frame_data: FrameData, *, with_chains: bool) -> Any:
    """The contacts as lines from centre to centre, or from centre to contact point.

    Each has ``kind`` (0 between particles, 1 with the workpiece, 2 the floor, 3 the side), ``id1``
    and ``id2`` (as ``a_id`` and ``b_id``), ``force_n`` (on the first), and the columns
    ``normal_force_n``, ``tangential_force_n`` and ``overlap_m``; with chains those of
    `_particles_mesh`. No two lines share a point, so that data of the lines can be moved to
    their points without a mean.
    """
    import pyvista as pv

    contacts, frame = frame_data.contacts, frame_data.network
    membership = frame_data.membership
    assert contacts is not None and frame is not None
    if contacts.empty:
        return pv.PolyData()
    points = segments(frame).reshape(-1, 3)
    ends = np.arange(len(points)).reshape(-1, 2)
    mesh = pv.PolyData(points, lines=np.insert(ends, 0, 2, axis=1).ravel())
    data = mesh.cell_data
    data["kind"] = np.asarray(PARTICLE - frame.other, dtype=np.int32)
    data["id1"] = contacts["a_id"].to_numpy(np.int64)
    data["id2"] = contacts["b_id"].to_numpy(np.int64)
    data["force_n"] = frame.force
    for name in ("normal_force_n", "tangential_force_n", "overlap_m"):
        data[name] = contacts[name].to_numpy(np.float64)
    if with_chains:
        _chains(data, membership.contacts if membership else None, len(contacts))
    return mesh


def _chains(data: Any, chain_columns: Mapping[str, Ints] | None, size: int) -> None:
    """Add number of the chain, number of workpiece paths, and dominance; -1 if not searched."""
    for name in MEMBERSHIPS:
        values = np.full(size, -1) if chain_columns is None else chain_columns[name]
        data[name] = values.astype(np.int32)
