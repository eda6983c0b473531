"""The entry script in a clone whose Python packages are stand-ins, on a PATH with few programs.

A set-up with network is a matter of a container: docs/start/installation.md has its command.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from entry import write_entry
from packaging.requirements import Requirement
from paths import ROOT
from snakemake.cli import get_argument_parser

SYSTEM_TOOLS = """
    bash cat cksum df dirname env false find flock grep id readlink rm sed sh sleep tr true
"""

CALLED = """\
#!/bin/sh
name=${0##*/}
printf '%s' "$name"
printf ' [%s]' "$@"
printf ' in %s with %s\\n' "$PWD" "${DRAGDECK_ENGINE:-no engine}"
[ "$name" != "${FAILS:-}" ] || exit 5
"""
"""A program that says how it was called."""

PACKAGES = ["snakemake", "dragdeck", "dragchain", "pytest", "ruff", "mypy", "lint-imports"]

SNAKEMAKE = "snakemake [--logger] [dragdeck] [--show-failed-logs]"

EVIDENCE = "[--snakefile] [evidence/Snakefile]"


class Clone:
    """A clone of the project's entry that is set up, and the programs on its PATH."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "a clone"
        self.path = folder / "bin"
        self.path.mkdir()
        (self.root / ".ci").mkdir(parents=True)
        shutil.copy(ROOT / ".ci/run", self.root / ".ci/run")
        self.packages = write_entry(self.root)
        for tool in SYSTEM_TOOLS.split():
            if found := shutil.which(tool):
                (self.path / tool).symlink_to(found)
        for name in ("liggghts", "mpirun"):
            write_program(self.path / name, CALLED)
        for name in PACKAGES:
            write_program(self.packages / name, CALLED)
        self.python = self.packages / "python"
        self.python.symlink_to("/bin/true")
        self.stamp = self.root / ".venv/dragdeck-stamp"

    def run(
        self, *arguments: str, cwd: Path | None = None, script: str = "run", **settings: Any
    ) -> subprocess.CompletedProcess[str]:
        options = {name: settings.pop(name) for name in ("user",) if name in settings}
        return subprocess.run(
            [self.root / script, *arguments],
            cwd=cwd or self.root,
            env={"PATH": str(self.path), "HOME": str(self.root), "PIP_NO_INDEX": "1", **settings},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            **options,
        )

    def extras(self) -> list[str]:
        """The extras that are there according to the stamp."""
        return self.stamp.read_text().splitlines()[2:]

    def write_study(self, name: str, text: str) -> None:
        (self.root / "studies" / name).mkdir(parents=True)
        (self.root / "studies" / name / "study.yaml").write_text(text)


def write_program(file: Path, text: str) -> Path:
    file.unlink(missing_ok=True)
    file.write_text(text)
    file.chmod(0o755)
    return file


def refused(call: subprocess.CompletedProcess[str], *words: str) -> bool:
    """Whether a call ended with a message that has these words and a remedy, and ran nothing."""
    assert call.returncode == 1 and call.stdout == ""
    assert all(word in call.stderr for word in (*words, "remedy:")), call.stderr
    return True


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    return Clone(tmp_path)


# --- what is called ----------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_usage_needs_nothing(clone: Clone, arguments: list[str]) -> None:
    shutil.rmtree(clone.root / ".venv")
    (clone.path / "liggghts").unlink()
    shown = clone.run(*arguments)
    assert shown.returncode == 0
    assert shown.stdout.startswith("usage: ./run")


@pytest.mark.parametrize(
    ("arguments", "called"),
    [
        (["all", "--config", "study=two words"], f"{SNAKEMAKE} [all] [--config] [study=two words]"),
        (["tradeoff"], f"{SNAKEMAKE} [tradeoff] {EVIDENCE}"),
        (
            ["-n", "results/a/validation/report.html"],
            f"{SNAKEMAKE} [-n] [results/a/validation/report.html] {EVIDENCE}",
        ),
        (["status", "verify"], "dragdeck [status] [verify]"),
        (["dragchain", "tables", "a b"], "dragchain [tables] [a b]"),
        (["status", "small"], "dragdeck [status] [small]"),
    ],
)
def test_arguments_arrive_whole_from_anywhere(
    clone: Clone, tmp_path: Path, arguments: list[str], called: str
) -> None:
    (tmp_path / "link").symlink_to(clone.root / "run")
    for script in ("run", "../link"):
        ended = clone.run(*arguments, cwd=tmp_path, script=script)
        assert ended.stdout == f"{called} in {clone.root} with no engine\n"
        assert ended.returncode == 0
        assert clone.run(*arguments, FAILS=called.split()[0]).returncode == 5


@pytest.mark.parametrize(
    ("arguments", "called"),
    [
        (["--quick", "-x"], r"ruff .*\npytest .*\[-m\] \[not engine and not slow\] \[-x\]"),
        (["--attacks", "-k", "kill"], r"pytest .*\[--attacks\] \[-m\] \[attack\] \[-k\] \[kill\]"),
        (["-k", "mesh or run"], r"pytest \[-k\] \[mesh or run\]"),
        (["--checks"], r"ruff \[check\] .*\n(.*\n)*lint-imports .*"),
        ([], r"pytest \[-n\] [^k]* in .*\nrun: ruff check .*\n(.*\n)*lint-imports .*"),
    ],
)
def test_tests_bring_their_packages(clone: Clone, arguments: list[str], called: str) -> None:
    ended = clone.run("test", *arguments)
    assert ended.returncode == 0
    assert re.fullmatch(rf"{called} in .*\n", ended.stdout)
    assert clone.extras() == ["cad", "crate", "docs", "notebook", "search", "test"]


def test_a_failed_check_fails_the_whole_and_still_tests(clone: Clone, tmp_path: Path) -> None:
    ended = clone.run(script=".ci/run", cwd=tmp_path, FAILS="mypy")
    assert ended.returncode == 1
    assert "quality check failed" in ended.stderr
    assert ended.stdout.startswith("pytest ")
    assert clone.run(script=".ci/run", cwd=tmp_path, FAILS="pytest").returncode == 5


def test_studies_are_run_one_by_one_and_then_compared(clone: Clone) -> None:
    ended = clone.run("compare", "--config", "studies=a,b", "fidelity=draft", "--cores", "1")
    each = f"{SNAKEMAKE} [all] [--config] [study={{}}] [fidelity=draft] [--cores] [1]"
    last = "dragchain [compare] [--out] [results/compare/a+b] [results/a] [results/b]"
    called = [line.partition(" in ")[0] for line in ended.stdout.splitlines()]
    assert called == [each.format("a"), each.format("b"), last]
    failed = clone.run("compare", "--config", "studies=a,b", FAILS="snakemake")
    assert failed.returncode != 0 and len(failed.stdout.splitlines()) == 1


@pytest.mark.parametrize("option", ["-n", "-np", "-pn", "--dry-run", "--dryrun"])
@pytest.mark.parametrize("command", ["compare", "search"])
def test_a_dry_run_ends_after_what_it_can_tell(clone: Clone, command: str, option: str) -> None:
    (clone.root / "rounds").write_text("round")
    write_program(clone.packages / "dragchain", STEPS)
    clone.stamp.write_text(clone.stamp.read_text() + "search\n")
    config = "studies=a,b" if command == "compare" else "study=a"
    ended = clone.run(command, "--config", config, "--cores", "1", option)
    assert ended.returncode == 0
    called = [line for line in ended.stdout.splitlines() if line.startswith("snakemake")]
    assert len(called) == (2 if command == "compare" else 1)
    assert len(called) == len(ended.stdout.splitlines())


NOTHING = """
    allowed_rules archive batch cleanup_metadata cleanup_shadow conda_cleanup_envs
    conda_create_envs_only container_cleanup_images containerize d3dag dag delete_all_output
    delete_temp_output detailed_summary draft_notebook edit_notebook export_cwl filegraph
    generate_unit_tests help immediate_submit lint list_changes list_conda_envs list_input_changes
    list_params_changes list_rules list_target_rules list_untracked mode omit_from
    print_compilation report rulegraph summary target_jobs touch unlock until version
"""
"""What Snakemake calls its options with which it runs nothing, or not all."""


def test_every_option_of_snakemake_is_passed_on_or_refused(clone: Clone) -> None:
    """Those that keep a study from its end, by all their names; no other one."""
    options = get_argument_parser()._actions
    refusals = [
        (word, action.dest in NOTHING.split())
        for action in options
        for word in action.option_strings
    ]
    assert {*NOTHING.split()} <= {action.dest for action in options}
    script = """
set -eu; . "$1"; shift
for word in "$@"; do (refuse_partial "$word" 2>/dev/null) || echo "$word"; done
"""
    words = [word for word, _ in refusals]
    asked = [clone.root / "workflow/run.sh", *words]
    shown = subprocess.run(["sh", "-c", script, "sh", *asked], cwd=clone.root, text=True,
                           capture_output=True, check=True)  # fmt: skip
    assert shown.stdout.split() == [word for word, refused_ in refusals if refused_]


@pytest.mark.parametrize(
    ("word", "refusal"),
    [
        *((word, "runs nothing") for word in ("--unt", "--touc", "--until=a", "-kt", "-pU")),
        *((word, "the folder of this script") for word in ("-d", "-pd", "--directory=a", "--dir")),
    ],
)  # fmt: skip
def test_an_option_is_seen_in_any_form(clone: Clone, word: str, refusal: str) -> None:
    assert refused(clone.run("compare", "--config", "studies=a", word, "a"), refusal)


@pytest.mark.parametrize("word", ["-j4", "-c1", "-k", "-Rtouch", "--jobs=2", "--keep-going", "-T2"])
def test_an_option_that_keeps_all_jobs_is_passed_on(clone: Clone, word: str) -> None:
    ended = clone.run("compare", "--config", "studies=a", word)
    assert f"[{word}]" in ended.stdout and "dragchain [compare]" in ended.stdout


STEPS = """\
#!/bin/sh
state=$(cat rounds)
printf '%s\\n' "${state%% *}"
[ "$state" = "${state#* }" ] || printf '%s' "${state#* }" > rounds
"""
"""A search whose steps say one word after the other of a file; the last one again and again."""


@pytest.mark.parametrize(
    ("rounds", "fails", "calls", "status"),
    [
        ("round round complete", "", 2, 0),
        ("unfinished round complete", "", 2, 0),
        ("round round complete", "snakemake", 2, 0),  # a run that failed is a finding
        ("round unfinished", "snakemake", 1, 5),  # nothing can go on
        ("unfinished unfinished", "", 1, 1),  # a round that changes nothing
    ],
)
def test_a_search_goes_on_round_by_round(
    clone: Clone, rounds: str, fails: str, calls: int, status: int
) -> None:
    (clone.root / "rounds").write_text(rounds)
    write_program(clone.packages / "dragchain", STEPS)
    clone.stamp.write_text(clone.stamp.read_text() + "search\n")
    ended = clone.run("search", "--config", "study=a", FAILS=fails)
    called = [line.partition(" in ")[0] for line in ended.stdout.splitlines()]
    assert called == [f"{SNAKEMAKE} [searched] [--config] [study=a]"] * calls
    assert ended.returncode == status


# --- what is missing -----------------------------------------------------------------------


INSTALL = "apt-get install --no-install-recommends liggghts"
UNMADE = "rm .venv/dragdeck-stamp"
OLD_PYTHON = f"{UNMADE}; ln -s false ../bin/python3"
PYTHON_OF_DEBIAN = f"""{UNMADE}; echo raise ImportError > ensurepip.py
printf '#!/bin/sh\nPYTHONPATH="%s" exec {sys.executable} "$@"\n' "$PWD" > ../bin/python3
chmod +x ../bin/python3"""
FULL_DISK = r"""rm ../bin/df
printf "#!/bin/sh\necho /dev/vda 9999999 9999957 42 100%% /\n" > ../bin/df
chmod +x ../bin/df"""


@pytest.mark.parametrize(
    ("broken", "arguments", "settings", "words"),
    [
        ("rm ../bin/liggghts", ["all"], {}, [INSTALL, "DRAGDECK_ENGINE"]),
        ("", ["all"], {"DRAGDECK_ENGINE": "./no/such"}, ["/./no/such"]),
        (UNMADE, ["all"], {}, ["3.11 or newer", "PYTHON"]),
        (OLD_PYTHON, ["all"], {}, ["3.11 or newer", "PYTHON"]),
        (UNMADE, ["all"], {"PYTHON": "bin/python"}, ["/bin/python"]),
        (PYTHON_OF_DEBIAN, ["all"], {}, ["apt-get install python3-venv"]),
        (FULL_DISK, ["all"], {}, ["the disk is full", "42 kB free"]),
        ("", ["web"], {}, ["npm is missing"]),
        ("", ["all", "--profile", "profiles/slurm"], {}, ["--workflow-profile"]),
        ("", ["compare", "--config", "study=a"], {}, ["no studies to compare", "studies=A,B"]),
        ("", ["compare", "--config", "studies=a b;c"], {}, ["not names of studies", "a b;c"]),
        ("", ["search", "--config", "study=a", "fidelity=full"], {}, ["fidelity=full"]),
        ("", ["search", "--config", "study=a", "--summary"], {}, ["runs nothing", "--summary"]),
        ("", ["compare", "--config", "studies=a,b", "-t"], {}, ["runs nothing", "-t"]),
        ("", ["setup", "crates"], {}, ["crates", "cad, crate, docs"]),
    ],
)
def test_what_is_missing_is_named_with_a_remedy(
    clone: Clone, broken: str, arguments: list[str], settings, words
) -> None:
    subprocess.run(broken, shell=True, cwd=clone.root, check=True)
    assert refused(clone.run(*arguments, **settings), *words)


def test_a_moved_clone_is_set_up_again(clone: Clone) -> None:
    clone.root = clone.root.rename(clone.root.with_name("moved"))
    assert refused(clone.run("all"), "3.11 or newer")


def test_engine_of_ones_own_is_seen_from_where_the_caller_is(clone: Clone, tmp_path: Path) -> None:
    own = (clone.path / "liggghts").rename(clone.path / "own")
    (clone.path / "mpirun").unlink()
    ended = clone.run("all", cwd=tmp_path, DRAGDECK_ENGINE="./bin/own")
    assert own.samefile(ended.stdout.strip().split(" with ")[-1])
    assert "warning: mpirun is missing" in ended.stderr


def test_a_folder_that_cannot_be_written() -> None:
    with TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        clone = Clone(Path(folder))
        clone.root.chmod(0o555)
        other = {"user": 65534} if os.geteuid() == 0 else {}
        assert refused(clone.run("all", **other), "cannot be written to", str(clone.root))
        clone.root.chmod(0o755)


# --- the set-up ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_set_up_that_failed_is_not_taken_for_done(clone: Clone) -> None:
    """A real one, which ends where pip asks for packages."""
    (clone.path / "python3").symlink_to(sys.executable)
    with (clone.root / "constraints.txt").open("a") as pins:
        pins.write("# changed\n")
    assert refused(clone.run("all"), "making .venv", "network access")
    assert not clone.stamp.exists()


STEP = "workpiece: {shape: {kind: mesh, file: part.STP}}\n"


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (["all", "--config", "study=cut"], "cad"),
        (["dragdeck", "check", "child"], "cad"),
        (["crate", "--config", "study=plain"], "crate"),
        (["all", "--workflow-profile", "profiles/slurm"], "slurm"),
        (["setup", "docs"], "docs"),
    ],
)
def test_packages_are_added_when_first_asked_for(
    clone: Clone, arguments: list[str], extra: str
) -> None:
    clone.write_study("cut", STEP)
    clone.write_study("child", "extends: cut\n")
    clone.write_study("plain", "# not a part.step\nextends: plain\n")
    for others in (["all", "--config", "study=plain"], ["status", "cut"], ["setup"]):
        assert clone.run(*others).returncode == 0
    assert clone.extras() == []

    clone.python.unlink()
    clone.python.symlink_to("/bin/false")
    assert refused(clone.run(*arguments), f"packages of {extra}", "pip could not install")
    assert clone.extras() == []
    assert clone.run("all").returncode == 0

    clone.python.unlink()
    clone.python.symlink_to("/bin/true")
    assert f"packages of {extra}" in clone.run(*arguments).stderr
    assert clone.extras() == [extra]
    assert clone.run(*arguments).stderr == ""


@pytest.mark.skipif(not shutil.which("flock"), reason="the lock is flock's")
def test_two_calls_at_once_set_up_once(clone: Clone) -> None:
    write_program(clone.python, "#!/bin/sh\necho called >>calls\nsleep 1\n")
    with ThreadPoolExecutor() as pool:
        calls = [pool.submit(clone.run, "crate") for _ in range(2)]
    assert [call.result().returncode for call in calls] == [0, 0]
    assert (clone.root / "calls").read_text() == "called\n"
    assert clone.extras() == ["crate"]


# --- the pins ----------------------------------------------------------------------------------


def test_every_dependency_is_pinned_at_or_above_its_minimum() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins: dict[str, list[str]] = {}
    for line in lines:
        if not line.startswith("#"):
            pin = Requirement(line)
            ((operator, version),) = ((one.operator, one.version) for one in pin.specifier)
            assert operator == "==" and "*" not in version
            pins.setdefault(re.sub(r"[-_.]+", "-", pin.name.lower()), []).append(version)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    for extra in ("cad", "crate", "docs", "lammps", "notebook", "slurm", "test"):
        wanted += project["project"]["optional-dependencies"][extra]
    for requirement in map(Requirement, wanted):
        for version in pins[requirement.name.lower()]:
            assert requirement.specifier.contains(version), requirement
