"""Runs on the real engine: to the end, interrupted, killed, failed, changed."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest
from made_scenes import BED, rendered
from made_study import Made
from run_files import rewrite

from dragdeck.engine import run_folder
from dragdeck.engine.checkpoints import checkpoint_files, checkpoint_step
from dragdeck.engine.process import ENGINE_VARIABLE, find_engine
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import fingerprint, run
from dragdeck.engine.watch import EngineEnded, Watcher, cut_screen
from dragdeck.errors import EngineError, InputError, RejectedRunError
from dragdeck.project import Project
from dragdeck.records.run import CaseFile, RunRecord
from dragdeck.scenes.process import PROCESS

pytestmark = pytest.mark.engine


def small_filling(made: Made, project: Project, **fidelity: Any) -> Path:
    """A rendered fill of 150 particles, not yet run."""
    case = made({"media.count": 150, **{f"fidelities.quick.{k}": v for k, v in fidelity.items()}})
    return rendered(case, project)


@pytest.fixture
def filling(made: Made, project: Project) -> Path:
    return small_filling(made, project)


def state(folder: Path) -> RunRecord:
    return RunRecord.read(folder / "state.json")


def test_a_filling_keeps_every_particle_comes_to_rest_and_is_not_repeated(filling: Path) -> None:
    result = run(filling, silent)
    assert result.state == "complete"
    assert all(check.passed for check in result.checks)
    assert {check.code for check in result.checks} >= {"at_rest", "particles_kept", "within_limits"}
    assert (filling / "packing.restart").is_file()
    assert not list(filling.glob("checkpoint.*"))
    first = (filling / "run.json").read_text()
    (filling / "run.json").unlink()  # as Snakemake does before it runs a rule again
    run(filling, silent)
    assert (filling / "run.json").read_text() == first


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_disk_that_is_full_is_named_with_what_is_free_and_needed(filling: Path) -> None:
    (filling / f".state.json.{os.getpid()}").symlink_to("/dev/full")
    with pytest.raises(EngineError) as caught:
        run(filling, silent)
    said = str(caught.value)
    assert said.startswith(f"{filling / 'state.json'}: the disk is full (No space left on device)")
    assert re.search(r"value:  [\d.,]+ .?B free\n  limit:  [\d.,]+ .?B, estimated", said)
    assert "remedy: free disk space" in said
    assert run(filling, silent).state == "complete"


def test_a_comment_in_the_deck_changes_nothing(filling: Path) -> None:
    inputs = CaseFile.read(filling / "case.json")
    before = fingerprint(filling, inputs)
    deck = filling / "in.liggghts"
    deck.write_text("# another title\n" + deck.read_text())
    assert fingerprint(filling, inputs) == before
    deck.write_text(deck.read_text().replace("timestep ", "timestep 0"))
    assert fingerprint(filling, inputs) != before


def test_a_changed_deck_moves_the_old_run_aside(filling: Path) -> None:
    run(filling, silent)
    old = (filling / "particles.1.bin").read_bytes()
    deck = filling / "in.liggghts"
    rewrite(deck, deck.read_text().replace("9.81", "9.80"))
    for name in ("logs/run.log", "benchmarks/run.tsv"):
        (filling / name).parent.mkdir()
        (filling / name).write_text("of Snakemake")
    lines: list[str] = []
    run(filling, lines.append)
    assert (filling / "logs/run.log").is_file()
    assert (filling / "benchmarks/run.tsv").is_file()
    (kept,) = (filling / "archive").iterdir()
    assert (kept / "particles.1.bin").read_bytes() == old
    assert "9.81" in (kept / "as_run/in.liggghts").read_text()
    assert any(str(kept) in line for line in lines)


def test_a_kill_while_a_run_is_moved_aside_leaves_what_shows_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the next start would go on from a checkpoint of other inputs."""
    for name in ("state.json", "screen.1.txt", "checkpoint.90.restart", "a.1.bin", "z.1.bin"):
        (tmp_path / name).touch()
    moved = list[str]()
    monkeypatch.setattr(shutil, "move", lambda file, _: moved.append(Path(file).name))
    run_folder._archive(tmp_path, "0123abcd", silent)
    assert len(moved) == 5 and {*moved[3:]} == {"state.json", "screen.1.txt"}


def slow_filling(made: Made, project: Project, ranks: int = 1) -> Path:
    """A rendered fill of a few seconds, not yet run."""
    return small_filling(made, project, ranks=ranks, filling_timestep_fraction=0.2)


def start(folder: Path) -> subprocess.Popen[bytes]:
    """Run in a process of its own, which can be signalled."""
    words = [sys.executable, "-m", "dragdeck.cli", "run", str(folder)]
    return subprocess.Popen(words, stderr=subprocess.PIPE)


def wait_for(condition: Callable[[], object], process: subprocess.Popen[bytes]) -> None:
    while not condition():
        assert process.poll() is None, "the run ended before it came to that"
        time.sleep(0.02)


def has_checkpoint(folder: Path) -> Callable[[], bool]:
    return lambda: len(list(folder.glob("checkpoint.*"))) > 1


@pytest.mark.parametrize(("ranks", "number"), [(1, signal.SIGINT), (2, signal.SIGTERM)])
def test_a_stop_leaves_a_checkpoint_and_the_run_goes_on(
    made: Made, project: Project, ranks: int, number: signal.Signals
) -> None:
    folder = slow_filling(made, project, ranks)
    process = start(folder)
    wait_for(has_checkpoint(folder), process)
    process.send_signal(number)
    _, said = process.communicate()
    assert process.returncode == 1
    assert b"stopped on request" in said
    assert b"checkpoint at step" in said
    assert state(folder).state == "stopped"
    assert not (folder / "run.json").exists()

    result = run(folder, silent)
    assert [part.part for part in result.parts] == [1, 2]
    assert result.parts[1].from_step > 0
    assert result.state == "complete"


@pytest.mark.parametrize("ranks", [1, 2])
def test_after_a_kill_and_damage_the_run_goes_on_from_what_is_whole(
    made: Made, project: Project, ranks: int
) -> None:
    folder = slow_filling(made, project, ranks)
    process = start(folder)
    wait_for(lambda: len(list(folder.glob("checkpoint.*.*.restart"))) > 1, process)
    family = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.communicate()
    assert psutil.wait_procs(family)[1] == []

    for file in set(checkpoint_files(folder)) - set(folder.glob("checkpoint.*.*.restart")):
        file.unlink()  # written in the last moment: it has no checksum yet
    *_, older, newest = checkpoint_files(folder)
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 1
    newest.write_bytes(content)
    lines: list[str] = []
    result = run(folder, lines.append)
    assert result.state == "complete"
    assert result.parts[1].from_step == checkpoint_step(older)
    assert [file.name for file in (folder / "damaged").iterdir()] == [newest.name]


def test_a_changed_input_is_refused(filling: Path) -> None:
    data = filling / "particles.data"
    data.write_text(data.read_text()[:-200])
    with pytest.raises(InputError, match=r"particles\.data: the file has changed since"):
        run(filling, silent)
    assert not (filling / "state.json").exists()


def refusal(folder: Path, file: Path) -> str:
    """Why a run is refused because of a file, before LIGGGHTS starts."""
    with pytest.raises(InputError) as caught:
        run(folder, silent)
    assert not (folder / "state.json").exists()
    assert caught.value.file == file
    return caught.value.problem


@pytest.mark.parametrize(
    "command",
    [
        "fix part all mesh/surface/stress file {} type 2 move 0 0 1",
        "fix tall all particletemplate/multisphere 15485863 spheres file {} scale 1.0",
        "variable times file {}",
        'if "${{resume}} == 0" then "read_dump {} 0 x y z"',
        "read_restart {}",
    ],
)
def test_a_file_that_a_template_reads_is_named_if_it_is_missing(
    command: str, filling: Path
) -> None:
    deck, file = filling / "in.liggghts", filling / "part.txt"
    before = fingerprint(filling, CaseFile.read(filling / "case.json"))
    rewrite(deck, f"{command.format(file.name)}\n{deck.read_text()}")
    assert "missing" in refusal(filling, file)
    file.write_text("")
    assert "empty" in refusal(filling, file)
    seen = {before}
    for content in "ab":  # it belongs to what the run depends on
        file.write_text(content)
        seen.add(fingerprint(filling, CaseFile.read(filling / "case.json")))
    assert len(seen) == 3


def test_a_file_that_a_template_writes_need_not_be_there(filling: Path) -> None:
    deck = filling / "in.liggghts"
    written = 'print "1.0" file own.txt\nvariable own file own.txt\n# --- Walls'
    rewrite(deck, deck.read_text().replace("# --- Walls", written, 1))
    assert run(filling, silent).state == "complete"


def test_a_packing_that_is_missing_or_not_whole_is_named(
    made: Made, project: Project, filling: Path
) -> None:
    case = made({"media.count": 150})
    process = rendered(case, project, PROCESS, BED)  # by hand, before the filling has run
    packing = filling / "packing.restart"
    assert "missing" in refusal(process, packing)
    packing.touch()
    assert "empty" in refusal(process, packing)
    run(filling, silent)
    content = packing.read_bytes()
    packing.write_bytes(content[: len(content) // 2])
    assert "truncated" in refusal(process, packing)
    packing.write_bytes(content)
    rendered(case, project, PROCESS, BED)
    packing.write_bytes(content[:-1] + b"x")
    assert "has changed" in refusal(process, packing)


def test_a_queue_that_signals_the_engine_too_stops_the_run(made: Made, project: Project) -> None:
    folder = slow_filling(made, project)
    process = start(folder)
    wait_for(has_checkpoint(folder), process)
    (engine,) = psutil.Process(process.pid).children()
    engine.send_signal(signal.SIGTERM)
    _, said = process.communicate()
    assert b"stopped on request" in said
    assert state(folder).parts[0].exit_status == 0
    assert not list(folder.glob("restart_forced_*"))

    (folder / "restart_forced_liggghts_7.data").touch()  # the runner was killed before it looked
    assert run(folder, silent).parts[1].from_step > 0
    assert not (folder / "archive").exists()


def test_an_engine_that_is_killed_after_its_last_line_goes_on(
    filling: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrapper, once = tmp_path / "killed_once", tmp_path / "once"
    wrapper.write_text(f"""#!/bin/sh
{find_engine().path} "$@"
[ "$1" = -h ] || [ -e {once} ] || {{ touch {once}; kill -9 $$; }}
""")
    wrapper.chmod(0o755)
    monkeypatch.setenv(ENGINE_VARIABLE, str(wrapper))
    with pytest.raises(EngineError, match="was killed"):
        run(filling, silent)
    assert state(filling).state == "stopped"
    record = run(filling, silent)
    assert record.state == "complete"
    assert [part.exit_status for part in record.parts] == [-signal.SIGKILL, 0]


def test_what_a_launcher_said_that_refused_is_shown(
    filling: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = tmp_path / "refuses"
    version = "echo 'LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled'"
    engine.write_text(f"""#!/bin/sh
[ "$1" = -h ] && {version} && exit
echo 'There are not enough slots available'
exit 255
""")
    engine.chmod(0o755)
    monkeypatch.setenv(ENGINE_VARIABLE, str(engine))
    words = r"without a message \(exit status 255\); the last lines: There are not enough slots"
    with pytest.raises(EngineError, match=words):
        run(filling, silent)


def test_the_engines_error_reaches_the_user_and_is_not_retried(filling: Path) -> None:
    deck = filling / "in.liggghts"
    good = deck.read_text()
    rewrite(deck, good.replace(" 0.86 ", " 0.01 "))
    with pytest.raises(RejectedRunError, match=r"ERROR.*[Rr]estitution"):
        run(filling, silent)
    assert not (filling / "run.json").exists()
    begun = state(filling).started
    with pytest.raises(RejectedRunError, match="--again"):
        run(filling, silent)
    assert state(filling).started == begun
    rewrite(deck, good)
    run(filling, silent)
    assert (filling / "run.json").is_file()


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("fix part all mesh/surface file ${gone} type 1", "Cannot open mesh file gone.stl"),
        ("fix out all print 1 x file no/such.txt", "Cannot open fix print file"),
        ("read_restart damaged.restart", "Invalid flag in header section of restart file"),
    ],
)
def test_what_a_single_rank_says_before_it_aborts_reaches_the_user(
    command: str, said: str, ranks: int, made: Made, project: Project
) -> None:
    """LIGGGHTS prints such an error without a flush, and calls ``MPI_Abort``."""
    filling = small_filling(made, project, ranks=ranks)
    deck = filling / "in.liggghts"
    text = deck.read_text()
    before = "if" if command.startswith("read") else "# --- Time step"
    (filling / "damaged.restart").write_bytes(b"\xc8" + bytes(4096))
    hidden = f"variable gone string gone.stl\n{command}\n{before}"  # not seen before the start
    rewrite(deck, text.replace(f"\n{before}", f"\n{hidden}", 1))
    unwritten = "print" in command  # as on a full disk
    with pytest.raises(EngineError if unwritten else RejectedRunError) as caught:
        run(filling, silent)
    assert re.search(rf"ERROR.*: {said}", str(caught.value)), caught.value
    assert not re.search("timestep_fraction|mpirun|energy_ratio", str(caught.value))


def test_whoever_lacks_stdbuf_is_told_why_an_error_is_lost(
    filling: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/liggghts").symlink_to(Path(find_engine().path).resolve())
    (tmp_path / "bin/rsh").symlink_to("/bin/true")  # Open MPI looks for one
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    deck = filling / "in.liggghts"
    broken = "variable gone string gone.stl\nfix part all mesh/surface file ${gone} type 1\n"
    rewrite(deck, deck.read_text().replace("# --- Time step", f"{broken}# --- Time step", 1))
    with pytest.raises(EngineError, match=r"without a message.*stdbuf of GNU coreutils"):
        run(filling, silent)


def test_a_bed_that_does_not_come_to_rest_is_rejected_and_not_resumed(filling: Path) -> None:
    deck = filling / "in.liggghts"
    rewrite(deck, deck.read_text().replace("variable check loop 500", "variable check loop 3"))
    with pytest.raises(RejectedRunError, match="packing settled: NOT SETTLED: energy ratio"):
        run(filling, silent)
    assert state(filling).state == "failed" and len(state(filling).parts) == 1
    remedies = {check.code: check.remedy for check in state(filling).checks if not check.passed}
    assert "filling.max_time_s" in (remedies["at_rest"] or "")
    assert all(check.remedy is None for check in state(filling).checks if check.passed)


def test_a_truncated_output_fails_its_check(filling: Path) -> None:
    deck = filling / "in.liggghts"
    rewrite(
        deck,
        deck.read_text().replace(
            "write_restart packing.restart",
            "undump write_particles\nshell truncate -s -5 particles.${part}.bin\nwrite_restart "
            "packing.restart",
        ),
    )
    damage = r"frame \d+, byte \d+: the file ends after \d+ bytes, inside"
    with pytest.raises(EngineError, match=rf"(?s)particles\.1\.bin, {damage}.*disk has space"):
        run(filling, silent)
    assert not (filling / "run.json").exists()
    with pytest.raises(RejectedRunError, match=rf"particles complete: particles\.2\.bin, {damage}"):
        run(filling, silent)


def test_a_lost_particle_fails(filling: Path) -> None:
    data = filling / "particles.data"
    lines = data.read_text().splitlines()
    first = lines.index("Velocities") + 2
    lines[first] = "1 0 0 50.0 0 0 0"  # straight up and out
    rewrite(data, "\n".join(lines) + "\n")
    # whoever sees it first: the engine, or the watcher of the run's limits
    with pytest.raises(RejectedRunError, match=r"Lost atoms|149 particles at step"):
        run(filling, silent)


def test_a_folder_without_a_deck_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"case\.json: there is no such file"):
        run(tmp_path, silent)


def test_a_missing_engine_leaves_no_trace(filling: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRAGDECK_ENGINE", "no-such-engine")
    with pytest.raises(EngineError):
        run(filling, silent)
    assert not (filling / "state.json").exists()


def watcher(folder: Path, **changed: Any) -> Watcher:
    """The watch over a run of one output."""
    thermo = folder / "thermo.1.txt"
    usual: dict[str, Any] = {
        "folder": folder, "screen": folder / "screen.1.txt", "files": [thermo], "thermo": thermo,
        "columns": HEAD.split(), "first": 0, "last": 100, "particles": 9, "ranks": 1,
        "limits": None, "patience_s": 60.0,
    }  # fmt: skip
    return Watcher(**{**usual, **changed})


HEAD = "step time_s n_particles kinetic_energy_j rotational_energy_j fastest_particle_m_s\n"


def test_an_engine_that_writes_nothing_is_ended(tmp_path: Path) -> None:
    watch = watcher(tmp_path)
    (tmp_path / "screen.1.txt").write_text("setting up\n")
    watch(50.0)
    watch(109.0)
    with pytest.raises(EngineEnded, match="produced no output for 61 s"):
        watch(111.0)


def test_output_without_end_is_cut(tmp_path: Path) -> None:
    screen = tmp_path / "screen.1.txt"
    with screen.open("wb") as stream:
        stream.write(b"Invalid flag in header\n")
        stream.truncate(20_000_000)
    with pytest.raises(EngineEnded, match="20 MB"):
        watcher(tmp_path)(0.1)
    cut_screen(screen)
    kept = screen.read_bytes()
    assert len(kept) < 200_000
    assert kept.startswith(b"Invalid flag") and kept.endswith(b"printed without end]\n")
