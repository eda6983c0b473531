"""The acceptance checks that a finished run must pass before it counts as a result."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.decks import CASE_FILE, PACKING_FILE
from dragdeck.decks.outputs import WORKPIECE_FORCE, OutputOfRun
from dragdeck.engine import log
from dragdeck.engine.checkpoints import is_whole
from dragdeck.engine.completeness import coverage, part_files, some_frames
from dragdeck.physics.contact_network import stability_number
from dragdeck.physics.rigid import RigidBodies, pose
from dragdeck.physics.run_limits import SPEED_FACTOR
from dragdeck.records.bed import CaseOfBed
from dragdeck.records.run import (
    AcceptanceCheck,
    CaseFile,
    CheckReason,
    Decomposition,
    RunPart,
    SteadyCriterion,
)

_FRAMES = 20
"""Frames whose contacts are evaluated. An assumption: the median of so many frames scatters little
(docs/evidence/stability.md)."""


def check_run(
    folder: Path,
    inputs: CaseFile,
    outputs: Mapping[str, OutputOfRun],
    exit_status: int,
    parts: Sequence[RunPart],
    ranks: int,
) -> list[AcceptanceCheck]:
    """Look at all that a run left.

    Parameters
    ----------
    folder : Path
        The run's folder.
    inputs : CaseFile
        From ``case.json``.
    outputs : mapping of str to OutputOfRun
        From ``columns.json``.
    exit_status : int
        Of the last part.
    parts : sequence of RunPart
        The last one has the end.
    ranks : int
        That were asked for.
    """
    screens = [_text(folder / f"screen.{part.part}.txt") for part in parts]
    checks = [_ended(screens[-1], exit_status), _no_errors(folder, outputs, parts, screens[-1])]
    checks += [_packing(folder / mark, inputs.media.n_spheres, ranks) for mark in inputs.marks]
    if inputs.settled is not None:
        checks.append(_at_rest(screens[-1]))
        checks.append(_packing(folder / PACKING_FILE, inputs.media.n_spheres, ranks))
        if "particles" in outputs:
            checks += _in_bowl(folder, outputs["particles"], parts, inputs.settled.highest_m)
    if "thermo" in outputs:
        samples = _samples(folder, outputs["thermo"], parts)
        checks += _thermo(samples, inputs.media.n_spheres)
        if inputs.steady is not None:
            checks.append(_steady(samples, inputs.steady))
    if inputs.thrown_m_s is not None and WORKPIECE_FORCE in outputs:
        checks.append(_thrown(folder, outputs[WORKPIECE_FORCE], parts, inputs.thrown_m_s))
    checks += [_complete(folder, name, output, parts) for name, output in outputs.items()]
    checks.append(ranks_check(log.decomposition(screens[-1]), ranks))
    if inputs.scene in ("filling", "process") and "particles" in outputs:
        checks.append(_stable_timestep(folder, outputs["particles"], parts))
    if inputs.limits is not None and "thermo" in outputs:
        # once more on all rows: the watch may not have looked at the last ones
        checks.append(log.breach(samples, inputs.limits) or log.within(inputs.limits))
    return checks


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""


def _ended(screen: str, exit_status: int) -> AcceptanceCheck:
    at_end = log.reached_end(screen)
    seen = f"exit status {exit_status}, end {'reached' if at_end else 'not reached'}"
    passed = at_end and exit_status == 0
    return AcceptanceCheck.of("ended", passed, seen, "exit status 0, end reached")


def _no_errors(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart], screen: str
) -> AcceptanceCheck:
    errors = log.engine_errors(screen)
    seen = "; ".join(errors) or "none"
    reason: CheckReason = "other"
    if "Lost atoms" in seen:
        seen += _through_the_top(folder, outputs, parts, screen)
        reason = "lost_particles"
    return AcceptanceCheck.of("no_engine_error", not errors, seen, "none", reason)


def _through_the_top(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart], screen: str
) -> str:
    """Whether particles of the last frame fly out of the box, in words; empty if none does."""
    top = log.top_of_box(screen)
    if top is None or "particles" not in outputs or not (folder / CASE_FILE).is_file():
        return ""
    particles = outputs["particles"]
    none = np.empty((0, len(particles.columns)))
    *_, (_, rows) = [(0, none), *some_frames(folder, particles, parts, 2)]
    names = "z_m", "vz_m_s", "radius_m"
    z, speed, radius = rows[:, [particles.columns.index(name) for name in names]].T
    gravity = CaseOfBed.read(folder / CASE_FILE).gravity_m_s2
    count = int((z + radius + np.maximum(speed, 0.0) ** 2 / (2 * gravity) >= top).sum())
    if not count:
        return ""
    return (
        f"; in the last frame, {count} particles fly through the open top of the simulation box at "
        f"{top:.3g} m: use a lid (bowl.lid_m) or a higher bowl (bowl.height_m)"
    )


def _at_rest(screen: str) -> AcceptanceCheck:
    rests, seen = log.settling(screen)
    return AcceptanceCheck.of("at_rest", rests, seen, "SETTLED")


def _steady(samples: Sequence[log.Sample], asked: SteadyCriterion) -> AcceptanceCheck:
    """Whether the mean kinetic energy of a particle stays, from its first third to its last."""
    energies = [sample.mean_energy_j for sample in samples if sample.step > asked.from_step]
    third = len(energies) // 3
    drift = math.nan
    if third:
        drift = abs(sum(energies[:third]) / sum(energies[-third:]) - 1)
    seen = f"mean kinetic energy changes by {100 * drift:.2g} % during the statistics"
    limit = f"at most {100 * asked.energy_drift:g} %"
    passed = drift <= asked.energy_drift
    return AcceptanceCheck.of("steady_bed", passed, seen, limit, number=drift)


def _packing(file: Path, particles: int, ranks: int) -> AcceptanceCheck:
    whole = file.is_file() and is_whole(file, particles, ranks)
    seen = "all particles present" if whole else f"{file.name} is missing or truncated"
    return AcceptanceCheck.of("packing_whole", whole, seen, f"{particles} particles")


def _in_bowl(
    folder: Path, particles: OutputOfRun, parts: Sequence[RunPart], highest_m: float
) -> list[AcceptanceCheck]:
    """Whether the settled packing lies between the walls, below the rim; none without a frame."""
    *_, (_, rows) = [(0, np.empty((0, 0))), *some_frames(folder, particles, parts, 2)]
    if not rows.size:
        return []
    z, radius = (particles.columns.index(name) for name in ("z_m", "radius_m"))
    top = float((rows[:, z] + rows[:, radius]).max())
    centres = rows[:, [particles.columns.index(name) for name in ("x_m", "y_m", "z_m")]]
    beyond = int((CaseOfBed.read(folder / CASE_FILE).bowl.distance(centres) <= 0).sum())
    seen, limit = f"highest point {top:.4g} m", f"rim of the bowl, {highest_m:.4g} m"
    seen += f", {beyond} particles beyond a wall" if beyond else ""
    passed = top <= highest_m and not beyond
    return [AcceptanceCheck.of("packing_in_bowl", passed, seen, limit, number=top)]


def _samples(folder: Path, output: OutputOfRun, parts: Sequence[RunPart]) -> list[log.Sample]:
    """All whole rows of all parts."""
    texts = [_text(folder / output.pattern.format(part=part.part)) for part in parts]
    return [
        sample for text in texts for sample in log.thermo_samples(text.splitlines(), output.columns)
    ]


def _thermo(samples: list[log.Sample], count: int) -> list[AcceptanceCheck]:
    finite = bool(samples) and all(sample.finite for sample in samples)
    fewest = min((sample.n_particles for sample in samples), default=0)
    seen, limit = f"smallest number of particles {fewest}", f"{count} particles"
    return [
        AcceptanceCheck.of("particles_kept", fewest == count, seen, limit),
        AcceptanceCheck.of("finite_numbers", finite, f"{len(samples)} thermo rows", "no NaN"),
    ]


def _thrown(
    folder: Path, force: OutputOfRun, parts: Sequence[RunPart], limit_m_s: float
) -> AcceptanceCheck:
    """Whether no particle was ever as fast as one that a contact found too late has thrown."""
    place = force.columns.index("fastest_particle_m_s")
    files = part_files(folder, {"": force}, parts)
    rows = [row.split() for file in files for row in _text(file).splitlines()]
    whole = [row for row in rows if len(row) == len(force.columns) and row[0].isdigit()]
    speeds = np.array([float(row[place]) for row in whole])
    passed = bool((speeds <= limit_m_s).all())
    seen, fastest = "no sample", None
    if len(speeds):
        at = int(speeds.argmax())  # NaN, if there is one
        fastest = float(speeds[at])
        seen = f"a particle at {fastest:.3g} m/s at step {int(whole[at][0]):,}"
    limit = (
        f"{limit_m_s:.3g} m/s, a fall through the simulation box plus {SPEED_FACTOR:g} times the "
        "largest speed of the scene"
    )
    return AcceptanceCheck.of("none_thrown", passed, seen, limit, number=fastest)


def _complete(
    folder: Path, name: str, output: OutputOfRun, parts: Sequence[RunPart]
) -> AcceptanceCheck:
    """Whether every promised step is there, in whichever part, and nothing else."""
    cover = coverage(folder, output, parts)
    (file,) = part_files(folder, {name: output}, parts[-1:])
    passed, seen = False, f"to step {cover.last}"
    promised = output.last_step is not None and cover.gap is None
    if not file.is_file() and not promised:  # a part from a checkpoint at the end writes nothing
        seen = f"no {file.name}"
    elif cover.problem:
        seen = f"{file.name}, {cover.problem}"
    elif not cover.steps:
        seen = f"{file.name} is empty"
    elif cover.gap is not None:
        seen = f"step {cover.gap} is missing"
    else:
        passed = True
    limit = "every frame complete" if output.last_step is None else f"to step {output.last_step}"
    return AcceptanceCheck.of("output_complete", passed, seen, limit, output=name)


def _stable_timestep(
    folder: Path, particles: OutputOfRun, parts: Sequence[RunPart]
) -> AcceptanceCheck:
    """Whether the median `stability_number` of the frames is 1 at most."""
    case = CaseOfBed.read(folder / CASE_FILE)
    names = ("x_m", "y_m", "z_m", "radius_m", "particle_id")
    wanted = [particles.columns.index(name) for name in names]
    frames = some_frames(folder, particles, parts, _FRAMES)
    numbers = [_stability_number(case, step, rows[:, wanted]) for step, rows in frames]
    number, reason, limit = float(np.median(numbers or [0.0])), case.unsafe_timestep, "1"
    if number > 1:
        stable = f"{number**-2:.2g} times the time step is stable"
        limit = f"1; exceeded on purpose: {reason}" if reason else f"1; {stable}"
    seen = f"stability number {number:.3g} of the contacts, median of {len(numbers)} frames"
    passed, median = number <= 1 or bool(reason), number if numbers else None
    return AcceptanceCheck.of("stable_timestep", passed, seen, limit, number=median)


def _stability_number(case: CaseOfBed, step: int, rows: Floats) -> float:
    """That of centres, radii and ids; infinite for those of no packing."""
    if not (rows.size and np.isfinite(rows).all()):
        return math.inf
    if case.bowl.motion is not None:
        shift = case.bowl.motion.shift(np.array([step]), case.timestep_s)
        rows = rows - np.pad(shift, ((0, 0), (0, 2)))
    rows = rows[np.argsort(rows[:, 4])] if case.bodies else rows
    ids = rows[:, 4].astype(np.int64)
    ids = case.body_of(ids) if case.bodies else ids
    bodies = (
        [*(class_.name for class_ in case.classes), "bowl"]
        if case.classes
        else ["particle", "bowl"]
    )
    constants = [
        [class_.contact_moduli[body] for body in bodies] for class_ in case.classes or (case,)
    ]
    of_case = case.density_of(ids), case.bowl, constants, case.timestep_s
    rigid = _rigid(case, rows[:, :3], ids) if case.bodies else None
    return stability_number(rows[:, :3], rows[:, 3], *of_case, case.class_of(ids), rigid)


def _rigid(case: CaseOfBed, places_m: Floats, body_id: Ints) -> RigidBodies:
    """The bodies of (N,) spheres in the order of their ids."""
    centres, masses, roots = [], [], []
    for body in case.bodies:
        centre, turned = pose(np.array(body.offsets_m), body.by_particle(places_m))
        axes = turned.as_matrix()
        centres.append(centre)
        masses.append(np.full(body.count, body.mass_kg))
        roots.append(axes / np.sqrt(body.inertia_kg_m2) @ axes.transpose(0, 2, 1))
    return RigidBodies(body_id - 1, *map(np.concatenate, (centres, masses, roots)))


def ranks_check(split: Decomposition | None, ranks: int) -> AcceptanceCheck:
    """Whether LIGGGHTS ran on the ranks that were asked for.

    A LIGGGHTS that was built for another MPI than its launcher's runs once per rank, each
    with all particles, and all write the same files.
    """
    seen, passed = "LIGGGHTS printed no processor grid", False
    if split is not None:
        seen, passed = " by ".join(map(str, split.grid)), math.prod(split.grid) == ranks
        if split.particles:
            least, most = split.particles.least, split.particles.most
            seen += f", {least:,} to {most:,} particles per rank"
    limit = f"{ranks} rank{'s' if ranks > 1 else ''}"
    return AcceptanceCheck.of("ranks", passed, seen, limit)
