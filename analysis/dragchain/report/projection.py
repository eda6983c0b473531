"""Load and removal on a mesh of the user's own; the sums over it are those over the contacts.

The amount of a contact at the point x is shared among the facets that face the same side as the
facet that it touches, by their areas times a cone: ``A_j (1 - |x - c_j| / h)`` for centres c_j
within the smoothing length h, divided by the sum of these weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.loading.contact_events import AMOUNTS, POINT
from dragchain.loading.samples import sample
from dragchain.loading.wear import acting
from dragchain.report.cases import ReportedCase, StudyRuns, cases_of, read_study_runs
from dragchain.report.page import write_bundle
from dragchain.report.removal import patch_means, removal_of
from dragchain.run.kinematics import needed
from dragchain.run.workpiece import Surface, read_surface
from dragchain.statistics.correlated import slow_waves
from dragdeck.errors import InputError
from dragdeck.files import draft_of
from dragdeck.mesh.files import STEP, read

_BLOCK_ROWS = 20_000
"""Contacts of a block, which bounds the memory of the weights."""

_FACES = 1e-3
"""Least cosine between facets that face the same side: rounding must not open a right angle."""

NAME = "projection"


def write_projection(
    run_dirs: Sequence[Path], out_dir: Path, mesh: Path, unit: str, smoothing_length: float
) -> str:
    """Write loads, and removal if the study has a law, on a mesh: CSV, Parquet and VTU.

    Parameters
    ----------
    run_dirs : sequence of Path
        Process runs of one case: its packings, over which the loads are means.
    out_dir : Path
    mesh : Path
        In the coordinates of ``workpiece.vtp``.
    unit : str
        What one is in the file.
    smoothing_length : float
        In m.

    Raises
    ------
    InputError
        If the mesh or the smoothing length cannot be used.
    TableError
        If the runs are of several cases, or a table is missing.
    """
    target, points, faces = read_target(mesh, unit, smoothing_length)
    cases = cases_of(map(read_study_runs, run_dirs))
    if len(cases) > 1:
        names = ", ".join(case.name for case in cases)
        raise TableError(f"the runs are of {len(cases)} cases: {names}\n"
                         "  remedy: give the packings of one case")  # fmt: skip
    table = projected(cases[0], replace(target, file=mesh))
    write_bundle(out_dir, tables={NAME: table})
    import meshio

    file = out_dir / f"{NAME}.vtu"
    data = {name: [table[name].to_numpy(np.float64)] for name in table}
    with draft_of(file) as draft:
        meshio.vtu.write(draft, meshio.Mesh(points, [("triangle", faces)], cell_data=data))
    settings = cases[0].values.notes
    return "\n".join([f"{len(table)} facets: {file}, {NAME}.csv", *settings])


@dataclass(frozen=True)
class Target:
    """A surface that receives amounts, and over which length these are smoothed, m."""

    surface: Surface
    length_m: float
    file: Path | None = None

    def receive(self, rows: pd.DataFrame, normals: Floats, amounts: Floats) -> Floats:
        """Sums over each of M facets, (M, K), of (N, K) amounts of contacts.

        Parameters
        ----------
        rows : DataFrame
            N contacts with `POINT` and ``facet_id`` of the workpiece.
        normals : (F, 3) array
            Of the workpiece's facets.
        amounts : (N, K) array

        Raises
        ------
        InputError
            If a contact has no facet of the surface within the length on its side.
        """
        tree, facing = KDTree(self.surface.centres), self.surface.normals
        points, sides = rows[POINT].to_numpy(np.float64), normals[rows["facet_id"].to_numpy()]
        sums = np.zeros((len(facing), amounts.shape[1]))
        for part in np.array_split(np.arange(len(rows)), 1 + len(rows) // _BLOCK_ROWS):
            block = KDTree(points[part])
            near = block.sparse_distance_matrix(tree, self.length_m, output_type="ndarray")
            at, to = near["i"], near["j"]
            same = np.einsum("ij,ij->i", sides[part][at], facing[to]) > _FACES
            weight = self.surface.areas[to] * (1 - near["v"] / self.length_m) * same
            total = np.bincount(at, weight, len(part))
            if (lost := np.flatnonzero(total == 0.0)).size:
                raise self._unreached(float(np.max(tree.query(points[part][lost])[0])))
            shares = csr_array((weight / total[at], (at, to)), shape=(len(part), len(facing)))
            sums += shares.T @ amounts[part]
        return sums

    def _unreached(self, away_m: float) -> InputError:
        far, field = away_m >= self.length_m, "--smoothing-length"
        return InputError(
            "the mesh is farther from a contact on the workpiece than the smoothing length"
            if far
            else "the facets of the mesh near a contact on the workpiece face the other way",
            file=self.file,
            field=field if far else None,
            value=f"{away_m:.3g} m from the nearest centre of a facet",
            limit=f"below {self.length_m:g} m" if far else "facets that face out",
            remedy="place it as workpiece.vtp (tip or reference point in the origin, z up), check "
            "--unit, or increase the length" if far else "turn its normals",
        )  # fmt: skip


def read_target(mesh: Path, unit: str, length_m: float) -> tuple[Target, Floats, Floats]:
    """A user's mesh with its nodes, (N, 3) in m, and facets, (M, 3).

    Raises
    ------
    InputError
        If the file is missing or no surface, or the smoothing length is below its facets.
    """
    field = "--smoothing-length"
    if not 0.0 < length_m < np.inf:
        raise InputError("the smoothing length is not positive", field=field, value=length_m,
                         limit="a number above 0, m")  # fmt: skip
    body = read(mesh, unit, length_m / 2 if mesh.suffix.lower() in STEP else None)
    longest = float(np.max(body.edges_unique_length, initial=0.0))
    if body.is_empty or not longest < length_m:
        raise InputError(
            "the mesh has no facets" if body.is_empty
            else "the smoothing length is smaller than the facets of the mesh",
            file=mesh, field=None if body.is_empty else field, value=f"{length_m:g} m",
            limit=f"above its longest edge, {longest:.3g} m",
            remedy="check --unit, use a finer mesh or a larger length",
        )  # fmt: skip
    points, faces = np.asarray(body.vertices), np.asarray(body.faces)[body.area_faces > 0.0]
    return Target(Surface(points[faces]), length_m), points, faces


def projected(case: ReportedCase, target: Target) -> pd.DataFrame:
    """What the packings of a case do to each facet of a mesh; one row per facet.

    The amounts are means over packings of the sums over a run. ``action_w_m2`` is that of the law
    of removal, or of Archard, per area and process time, with its standard error. Of first touches
    there are the number and mean normal velocity. With a law, `RemovalOfCase.facets` follows.
    """
    sums, actions, studies = zip(*(_of_run(study, target) for study in case.studies), strict=True)
    mean, error, _ = patch_means(*np.swapaxes(actions, 0, 1))
    amounts, surface = sum(sums) / len(sums), target.surface
    if "touches" in amounts:
        amounts["touch_normal_m_s"] /= amounts["touches"].where(amounts["touches"] > 0)
    columns = {f"centre_{axis}_m": at for axis, at in zip("xyz", surface.centres.T, strict=True)}
    first = {**columns, "area_m2": surface.areas, "smoothing_length_m": target.length_m}
    table = pd.DataFrame(first).assign(**amounts, action_w_m2=mean, action_w_m2_se=error)
    removed = removal_of(ReportedCase(studies))
    return table if removed is None else table.assign(**removed.facets)


def _of_run(study: StudyRuns, target: Target) -> tuple[pd.DataFrame, Floats, StudyRuns]:
    """Amounts, action and its standard error, (2, M), and the run with these instead of its own."""
    folder, case, areas = study.process.folder, study.process.case, target.surface.areas
    sampled, normals = sample(folder, case), read_surface(folder, case).normals
    amounts = sampled.rows[list(AMOUNTS)].to_numpy(np.float64)
    sums = pd.DataFrame(target.receive(sampled.rows, normals, amounts), columns=list(AMOUNTS))
    of_laws, _, events = acting(folder, case, sampled)
    if events is not None:
        hits = events.assign(touches=1.0)[["touches", "touch_normal_m_s"]]
        sums[[*hits]] = target.receive(events, normals, hits.to_numpy(np.float64))
    action = np.zeros((2, len(areas)))
    for law in of_laws:
        waves = np.vstack([np.ones(law.frames), slow_waves(law.frames)])[:, law.rows["frame"]]
        load = target.receive(law.rows, normals, law.rows["action"].to_numpy()[:, None] * waves.T)
        error = np.sqrt(law.frames * np.mean(load[:, 1:] ** 2, axis=1))
        per = areas * law.frames * law.interval_s * case.fidelity.speed_factor
        action = np.array([action[0] + load[:, 0] / per, np.hypot(action[1], error / per)])
    if study.wear is None:
        return sums, action, study
    highest = needed(case.workpiece, "workpiece").immersion_depth_m
    changed = {"area_m2": areas, "patch_w_m2": action[0], "patch_se_w_m2": action[1],
               "patch": np.arange(len(areas)),
               "immersed": target.surface.centres[:, 2] <= highest}  # fmt: skip
    update = {name: tuple(values.tolist()) for name, values in changed.items()}
    return sums, action, replace(study, wear=study.wear.model_copy(update=update))
