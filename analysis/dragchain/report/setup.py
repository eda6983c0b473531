"""What a process run simulated, in six lines."""

from collections.abc import Iterator

import numpy as np
from pydantic import JsonValue

from dragchain.report.findings import FillingFindings
from dragchain.report.notation import TIMES, number
from dragchain.run.case import Case
from dragchain.run.kinematics import axis_speed, drag_phase, motion_of, needed, path_passed


def set_up(case: Case, packings: int, filling: FillingFindings | None) -> list[tuple[str, str]]:
    """Workpiece, path, speed, media, bowl and settings of a case.

    Parameters
    ----------
    case : Case
        A process run.
    packings : int
        Number of packings (seeds) that are averaged.
    filling : FillingFindings or None
        Of its packing.

    Returns
    -------
    list of (str, str)
        Name and text of each line.
    """
    return [
        ("Workpiece", "; ".join(_workpiece(case))),
        ("Path and depth", "; ".join(_path(case))),
        ("Speed", "; ".join(_speed(case))),
        ("Media", "; ".join(_media(case))),
        ("Bowl", "; ".join(_bowl(case, filling))),
        ("Settings", "; ".join(_settings(case, packings))),
    ]


def _workpiece(case: Case) -> Iterator[str]:
    own, inputs = needed(case.workpiece, "workpiece"), case.inputs
    material = _text(inputs.get("workpiece.material"))
    if inputs.get("workpiece.shape.kind", own.kind) == "cylinder":
        yield f"{material} cylinder, diameter {_mm(2 * own.radius_m)}".strip()
    else:
        file = _text(inputs.get("workpiece.shape.file")) or own.mesh
        yield f"{material} part {file}, up to {_mm(own.radius_m)} from its axis".strip()
    if own.count > 1:
        yield f"number {own.number} of {own.count}"


def _path(case: Case) -> Iterator[str]:
    yield motion_of(case).motion.path.words(number)
    end_s = np.array([drag_phase(case).end_step * case.timestep_s])
    yield f"{_mm(float(path_passed(end_s, case)[0]))} long"
    yield f"immersed {_mm(needed(case.workpiece, 'workpiece').immersion_depth_m)}"
    yield from (f"with {one.kind}" for one in case.superposed)


def _speed(case: Case) -> Iterator[str]:
    simulated, factor = axis_speed(case), case.fidelity.speed_factor
    yield f"{number(1e3 * simulated / factor)} mm/s"
    if factor != 1.0:
        yield f"simulated at {number(1e3 * simulated)} mm/s"


def _media(case: Case) -> Iterator[str]:
    media, material = case.media, _text(case.inputs.get("media.material"))
    yield " ".join(filter(None, (number(media.count), material, "spheres")))
    spread = (
        f" \N{PLUS-MINUS SIGN} {_mm(2 * media.radius_std_m)} (standard deviation)"
        if media.radius_std_m
        else ""
    )
    yield f"diameter {_mm(2 * media.radius_mean_m)}{spread}"


def _bowl(case: Case, filling: FillingFindings | None) -> Iterator[str]:
    bowl, material = needed(case.bowl, "bowl"), _text(case.inputs.get("bowl.material"))
    yield f"{material} cylinder, radius {_mm(bowl.radius_m)}".strip()
    if filling is not None and "bed_height_m" in filling.bed:
        fraction = filling.bed.get("solid_fraction")
        solid = f", solid fraction {number(fraction)}" if fraction is not None else ""
        yield f"filled to {_mm(float(filling.bed['bed_height_m']))}{solid}"


def _settings(case: Case, packings: int) -> Iterator[str]:
    own = case.fidelity
    yield (
        f"{own.name}: Young's modulus {TIMES} {number(own.youngs_modulus_scale)}, time step "
        f"{number(100 * own.timestep_fraction)} % of the Rayleigh time, "
        f"speed {TIMES} {number(own.speed_factor)}"
    )
    yield f"{packings} packings (seeds)" if packings > 1 else "one packing (seed)"


def _mm(length_m: float) -> str:
    return f"{number(1e3 * length_m)} mm"


def _text(value: JsonValue) -> str:
    return value if isinstance(value, str) else ""
