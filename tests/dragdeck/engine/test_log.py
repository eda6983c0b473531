"""What is read of the screen and of the thermo rows of LIGGGHTS."""

import pytest

from dragdeck.engine.log import engine_errors, last_step, loops, settling


def test_errors_are_read_once_each() -> None:
    text = "Step\nERROR: Lost atoms (thermo.cpp:1)\nERROR: Lost atoms (thermo.cpp:1)\nbye\n"
    assert engine_errors(text) == ["ERROR: Lost atoms (thermo.cpp:1)"]


@pytest.mark.parametrize(
    ("screen", "rests", "words"),
    [
        ("DRAGDECK SETTLED: energy ratio 1e-7\n", True, "SETTLED: energy ratio 1e-7"),
        ("DRAGDECK NOT SETTLED: energy ratio 1\n", False, "NOT SETTLED: energy ratio 1"),
        ("print DRAGDECK SETTLED\n", False, "no message of the settling criterion"),
    ],
)
def test_a_bed_rests_if_the_input_script_says_so(screen: str, rests: bool, words: str) -> None:
    assert settling(screen) == (rests, words)


def test_the_last_step_is_that_of_the_last_row() -> None:
    assert last_step("Step Atoms KinEng\n       0 300  0.1 \n     500 300  0.2 \n") == 500
    assert last_step("nothing") is None


def test_each_run_command_has_its_time_and_steps() -> None:
    text = (
        "Loop time of 4 on 1 procs for 100 steps with 300 atoms\n"
        "Loop time of 2.5 on 2 procs for 500 steps with 300 atoms\n"
    )
    assert [(loop.wall_time_s, loop.steps) for loop in loops(text)] == [(4.0, 100), (2.5, 500)]
