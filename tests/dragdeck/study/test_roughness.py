"""A roughness profile is read from a file beside the study, or refused with its line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dragdeck.errors import InputError
from dragdeck.study.roughness import Roughness
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]

REMOVAL = {"coefficient_m2_n": 2e-11}
HEIGHTS = np.round(1e-6 * np.sin(np.arange(150)), 12)
SINE = {"shape": "sine", "ra_m": 1e-6}
ROWS = [f"{1e-6 * place:.6g},{height:.6g}" for place, height in enumerate(HEIGHTS)]


def read(small: dict[str, Any], write_study: Write, rows: list[str], **more: Any) -> Any:
    small |= {"removal": REMOVAL, "roughness": {"profile": "profile.csv"}} | more
    file = write_study(small)
    file.with_name("profile.csv").write_text("\n".join(["x_m,z_m", *rows]) + "\n")
    return load_cases(file)[0].study.roughness


def test_a_profile_is_read_from_its_file(small: dict[str, Any], write_study: Write) -> None:
    roughness = read(small, write_study, ROWS)
    assert [height.z_m for height in roughness.profile] == pytest.approx(HEIGHTS)


@pytest.mark.parametrize(
    ("rows", "more", "words"),
    [
        ([*ROWS[:50], *ROWS[60:]], {}, "not evenly spaced along x_m: resample it"),
        ([*ROWS[:50], "5e-5,a", *ROWS[51:]], {}, "profile.csv:52: z_m"),
        (ROWS[:20], {}, "the list has 20 entries"),
        ([f"0,{height}" for height in HEIGHTS], {}, "not evenly spaced"),
        ([f"{1e-6 * place:.6g},1e-6" for place in range(150)], {}, "Ra is 0"),
        ([f"{place},{height}" for place, height in enumerate(HEIGHTS)], {}, "148 more of its list"),
        *(
            (ROWS, {"roughness": {"form": SINE, name: 2e-6}}, f"{name} is 2e-06, not below")
            for name in ("target_ra_m", "steady_ra_m")
        ),
        (ROWS, {"removal": None}, "roughness follows from the depth of removal"),
    ],
)
def test_what_is_no_profile_is_refused(
    small: dict[str, Any], write_study: Write, rows: list[str], more: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(small, write_study, rows, **more)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("header", "x", "z"),
    [("x_mm,z_um", 1e3, 1e6), ("X [mm];Z [\u00b5m]", 1e3, 1e6), (",x_cm,z_mm", 1e2, 1e3)],
)
def test_a_profile_may_have_other_units(
    header: str, x: float, z: float, small: dict[str, Any], write_study: Write
) -> None:
    mark = ";" if ";" in header else ","
    rows = [f"{x * 1e-6 * place:.6g}{mark}{z * height:.9g}" for place, height in enumerate(HEIGHTS)]
    if not header.split(mark)[0]:
        rows = [f"{number},{row}" for number, row in enumerate(rows)]
    small |= {"removal": REMOVAL, "roughness": {"profile": "profile.csv"}}
    file = write_study(small)
    file.with_name("profile.csv").write_text("\n".join([header, *rows]) + "\n")
    profile = load_cases(file)[0].study.roughness.profile
    assert [height.z_m for height in profile] == pytest.approx(HEIGHTS)
    assert profile[-1].x_m == pytest.approx(149e-6)


@pytest.mark.parametrize(
    ("changes", "count"),
    [
        ({"form": SINE}, 0),
        ({"form": SINE, "measured": [(60, 8e-7), (120, 6e-7), (240, 4e-7)]}, 0),
        ({"form": SINE, "measured": [(240, 3e-7), (120, 2.9e-7), (60, 3.1e-7)]}, 0),
        ({"form": SINE, "measured": [(60, 4e-7), (120, 6e-7), (240, 9e-7)]}, 1),
        ({"form": SINE, "measured": [(60, 2e-6), (120, 6e-7), (240, 4e-7)]}, 1),
        ({"form": SINE, "steady_ra_m": 5e-7, "measured": [(60, 8e-7), (120, 4e-7)]}, 1),
        ({"profile": [(1e-6 * x, 1e-6 * np.sin(x)) for x in range(200)]}, 0),
        ({"profile": [(1e-6 * x, 1e-6 * np.sin(x) + 1e-7 * x) for x in range(200)]}, 1),
    ],
)  # fmt: skip
def test_values_that_contradict_are_doubted(changes: dict[str, Any], count: int) -> None:
    rows = [{"time_s": time, "ra_m": ra} for time, ra in changes.get("measured", ())]
    assert len(list(Roughness(**{**changes, "measured": rows}).doubts())) == count
