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

PACKAGES = ["snakemake", "dragdeck", "dragchain", "pytest", "ruff", "mypy", "lint-imports",
            "snakefmt"]  # fmt: skip

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
            ["compare", "--config", "studies=a,b"],
            f"{SNAKEMAKE} [compared] [--config] [studies=a,b]",
        ),
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
        (["--checks"], r"ruff \[check\] .*\n(.*\n)*snakemake .*"),
        ([], r"pytest \[-n\] [^k]* in .*\nrun: ruff check .*\n(.*\n)*snakemake .*"),
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
        (["compare", "--config", "studies=plain,child"], "cad"),
        (["search", "--config", "study=plain"], "search"),
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
