"""Commands that would leave the engine or the run's folder, as LIGGGHTS 3.8.0 takes them."""

import pytest

from dragdeck.script.commands import leaving_folder

SOURCE = "../../filling/bed/packing.restart"


@pytest.mark.parametrize(
    "deck",
    [
        "shell touch x",
        "  shell touch x",
        '"shell" touch x',
        "she&\nll touch x",
        "she& \t\nll touch x",
        "include other",
        "jump other",
        "partition yes 1 shell touch x",
        "python f input 0",
        "variable c string shell\n${c} touch x",
        "s$c touch x",
        'if "1 == 1" then "shell touch x"',
        "if \"1 == 1\" then \"if '1 == 1' then 'shell touch x'\"",
        'if "1 == 1" then "print a" else "shell touch x"',
        'if "1 == 1" then "print a" elif "2 == 2" "shell touch x"',
        'if "1 == 1" then "${c}"',
        'if "1 == 1" then """shell touch x"""',
        'run 100 every 10 "shell touch x"',
        "variable home getenv HOME",
        'print "x" append /etc/passwd',
        'print "x" append ~/.profile',
        "write_restart ../other",
        "write_restart ${home}/x",
        "variable f string /etc/passwd",
        'dump a all custom 1 "x;touch y.gz" id',
    ],
)
def test_a_way_out_is_found(deck: str) -> None:
    assert list(leaving_folder(deck, SOURCE))


@pytest.mark.parametrize(
    "deck",
    [
        "",
        "# shell is a word here",
        f"variable from index {SOURCE}",
        'if "${resume} == 0" then "read_data ${from}" else "read_restart ${from}"',
        'if "${now} < 1 && ${before} < 1" then "jump SELF settled"',
        "jump SELF settle",
        "run ${next} upto",
        "fix wall all wall/gran model hertz tangential history",
        "variable x equal (a+b)/../c",
        'print "DRAGDECK SETTLED: energy ratio ${now}"',
        "dump a all custom 10 particles.${part}.bin id x y z",
        'fix w all print 10 "${a} ${b}" file thermo.${part}.txt screen no title "a b"',
    ],
)
def test_an_ordinary_command_stays(deck: str) -> None:
    assert not list(leaving_folder(deck, SOURCE))
