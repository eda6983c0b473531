"""A roughness profile is read from a file beside the study, or refused with its line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dragdeck.errors import InputError
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]

REMOVAL = {"coefficient_m2_n": 2e-11}
HEIGHTS = np.round(1e-6 * np.sin(np.arange(150)), 12)
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
        (ROWS, {"removal": None}, "roughness follows from the depth of removal"),
    ],
)
def test_what_is_no_profile_is_refused(
    small: dict[str, Any], write_study: Write, rows: list[str], more: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(small, write_study, rows, **more)
    assert words in str(caught.value)
