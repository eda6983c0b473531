"""The entry script against a machine made of fakes: no network, no real environment."""

import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]

SYSTEM_TOOLS = [
    "sh",
    "bash",
    "env",
    "cat",
    "cksum",
    "cp",
    "df",
    "chmod",
    "dirname",
    "find",
    "flock",
    "ln",
    "mkdir",
    "readlink",
    "rm",
    "sed",
    "sleep",
    "touch",
]

SHOWN = "[--logger] [dragdeck] [--show-failed-logs]"
"""What follows the name of Snakemake in every call."""

FAKE_PYTHON = """\
#!/bin/sh
case "$*" in
    *version_info*) exit "${FAKE_OLD:-0}" ;;
    *"import gmsh"*) exit "${FAKE_NO_CAD:-0}" ;;
    *executor_plugin*) exit "${FAKE_NO_PLUGIN:-0}" ;;
    *ensurepip*) exit "${FAKE_NO_VENV:-0}" ;;
    --version) echo Python 3.12.1 ;;
    "-m venv --clear "*)
        echo venv >>"$FAKE_LOG"
        sleep "${FAKE_SLOW:-0}"
        mkdir -p "$4/bin"
        cp "$0" "$4/bin/python"
        for tool in snakemake dragdeck dragchain pytest ruff mypy lint-imports snakefmt; do
            cp "$FAKE_TOOL" "$4/bin/$tool"
        done
        ;;
    "-m pip "*)
        echo "pip $*" >>"$FAKE_LOG"
        exit "${FAKE_PIP:-0}"
        ;;
    -)
        cat >/dev/null
        echo picture >>"$FAKE_LOG"
        exit "${FAKE_PICTURE:-0}"
        ;;
esac
"""

FAKE_TOOL = """\
#!/bin/sh
name=${0##*/}
{
    printf '%s' "$name"
    printf ' [%s]' "$@"
    printf ' in %s with %s\\n' "$PWD" "${DRAGDECK_ENGINE:-no engine}"
} >>"$FAKE_LOG"
[ "$name" != "${FAKE_FAILS:-}" ] || exit "${FAKE_STATUS:-7}"
"""

FAKE_APT = """\
#!/bin/sh
echo "apt-get $*" >>"$FAKE_LOG"
case "$*" in *liggghts*) cp "$FAKE_TOOL" "$FAKE_BIN/liggghts" ;; esac
"""


class Machine:
    """A clone and a PATH that holds what a test puts there."""

    def __init__(self, folder: Path) -> None:
        self.clone = folder / "a clone"
        self.bin = folder / "bin"
        self.log = folder / "log"
        self.clone.mkdir()
        self.bin.mkdir()
        for name in ("run", "pyproject.toml", "constraints.txt", ".ci/run"):
            (self.clone / name).parent.mkdir(exist_ok=True)
            shutil.copy(ROOT / name, self.clone / name)
        for tool in SYSTEM_TOOLS:
            if found := shutil.which(tool):
                (self.bin / tool).symlink_to(found)
        self.add("tool", FAKE_TOOL)
        self.add("id", "#!/bin/sh\necho 1000\n")
        for name in ("liggghts", "mpirun"):
            self.add(name, FAKE_TOOL)
        self.add("python3", FAKE_PYTHON)

    def add(self, name: str, text: str) -> Path:
        path = self.bin / name
        path.write_text(text)
        path.chmod(0o755)
        return path

    def make_root(self) -> None:
        self.add("id", "#!/bin/sh\necho 0\n")
        self.add("apt-get", FAKE_APT)

    def remove(self, name: str) -> None:
        (self.bin / name).unlink()

    def run(
        self, *arguments: str, cwd: Path | None = None, script: str = "run", **settings: str
    ) -> subprocess.CompletedProcess[str]:
        self.log.touch()
        fakes = {"LOG": self.log, "TOOL": self.bin / "tool", "BIN": self.bin}
        environment = {"PATH": str(self.bin), "HOME": str(self.clone)}
        environment |= {f"FAKE_{name}": str(path) for name, path in fakes.items()}
        return subprocess.run(
            [self.clone / script, *arguments],
            cwd=cwd or self.clone,
            env=environment | settings,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )

    def done(self) -> list[str]:
        """What the fakes were asked to do, and forget it."""
        lines = self.log.read_text().splitlines()
        self.log.write_text("")
        return lines


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    yield Machine(tmp_path)


@pytest.mark.parametrize("script", ["run", ".ci/run"])
def test_scripts_are_executable_and_parse(script: str):
    shell = (ROOT / script).read_text().splitlines()[0].split("/")[-1].split()[-1]
    assert os.access(ROOT / script, os.X_OK)
    subprocess.run([shell, "-n", ROOT / script], check=True)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_usage_needs_nothing(machine: Machine, arguments: list[str]):
    machine.remove("liggghts")
    machine.remove("python3")
    shown = machine.run(*arguments)
    assert shown.returncode == 0
    assert shown.stdout.startswith("usage: ./run")
    assert "DRAGDECK_ENGINE" in shown.stdout


def test_arguments_reach_snakemake_whole_and_from_anywhere(machine: Machine, tmp_path: Path):
    ended = machine.run("all", "--config", "study=two words", cwd=tmp_path)
    assert ended.returncode == 0
    assert machine.done()[-1].startswith(
        f"snakemake {SHOWN} [all] [--config] [study=two words] in {machine.clone} "
    )


def test_a_symbolic_link_leads_to_the_clone(machine: Machine, tmp_path: Path):
    (tmp_path / "link").symlink_to(machine.clone / "run")
    ended = machine.run("all", cwd=tmp_path, script="../link")
    assert ended.returncode == 0
    assert machine.done()[-1].startswith(f"snakemake {SHOWN} [all] in {machine.clone} ")


@pytest.mark.parametrize("name", ["dragdeck", "dragchain"])
def test_console_scripts_are_reached(machine: Machine, name: str):
    machine.run(name, "explain", "--help")
    assert machine.done()[-1].startswith(f"{name} [explain] [--help] ")


@pytest.mark.parametrize("name", ["status", "open"])
def test_status_and_report_are_near(machine: Machine, name: str):
    machine.run(name, "small")
    assert machine.done()[-1].startswith(f"dragdeck [{name}] [small] ")


@pytest.mark.parametrize(
    ("fails", "arguments"),
    [("snakemake", ["all"]), ("dragdeck", ["dragdeck", "x"]), ("pytest", ["test"])],
)
def test_exit_status_passes_through(machine: Machine, fails: str, arguments: list[str]):
    assert machine.run(*arguments, FAKE_FAILS=fails, FAKE_STATUS="5").returncode == 5


# --- the environment ---------------------------------------------------------------


def test_set_up_once_and_again_when_the_pins_change(machine: Machine):
    machine.run("setup")
    first = machine.done()
    assert first[0] == "venv"
    assert all("--constraint constraints.txt" in line for line in first if line[:3] == "pip")
    assert first[-1] == "picture"

    machine.run("setup")
    assert machine.done() == []

    with (machine.clone / "constraints.txt").open("a") as pins:
        pins.write("# changed\n")
    machine.run("setup")
    assert machine.done() == first


def test_a_moved_clone_is_set_up_again(machine: Machine):
    machine.run("setup")
    machine.done()
    machine.clone = machine.clone.rename(machine.clone.with_name("moved"))
    machine.run("setup")
    assert machine.done()[0] == "venv"


def test_a_set_up_that_failed_is_not_taken_for_done(machine: Machine):
    failed = machine.run("setup", FAKE_PIP="1")
    assert failed.returncode == 1
    assert "remedy" in failed.stderr
    machine.done()
    assert machine.run("setup").returncode == 0
    assert machine.done()[0] == "venv"


@pytest.mark.skipif(not shutil.which("flock"), reason="the lock is flock's")
def test_two_calls_at_once_set_up_once(machine: Machine):
    with ThreadPoolExecutor() as pool:
        calls = [pool.submit(machine.run, "setup", FAKE_SLOW="1") for _ in range(2)]
    assert [call.result().returncode for call in calls] == [0, 0]
    assert machine.done().count("venv") == 1


# --- what is missing -----------------------------------------------------------------


def test_missing_engine_is_named_with_both_ways_out(machine: Machine):
    machine.remove("liggghts")
    refused = machine.run("all")
    assert refused.returncode == 1
    assert "apt-get install --no-install-recommends liggghts" in refused.stderr
    assert "DRAGDECK_ENGINE" in refused.stderr
    assert machine.done() == []


def test_missing_engine_is_installed_by_root(machine: Machine):
    machine.remove("liggghts")
    machine.make_root()
    assert machine.run("setup").returncode == 0
    assert machine.done()[:2] == [
        "apt-get update -q",
        "apt-get install -q -y --no-install-recommends liggghts",
    ]


def test_sudo_that_asks_for_a_password_is_not_used(machine: Machine):
    machine.remove("liggghts")
    machine.make_root()
    machine.add("id", "#!/bin/sh\necho 1000\n")
    machine.add("sudo", "#!/bin/sh\nexit 1\n")
    assert machine.run("setup").returncode == 1
    assert machine.done() == []


def test_engine_of_ones_own(machine: Machine, tmp_path: Path):
    machine.remove("liggghts")
    own = machine.add("own-engine", FAKE_TOOL)
    ended = machine.run("all", cwd=tmp_path, DRAGDECK_ENGINE="./bin/own-engine")
    assert ended.returncode == 0
    assert own.samefile(machine.done()[-1].split(" with ")[-1])

    refused = machine.run("all", DRAGDECK_ENGINE="/no/such/engine")
    assert refused.returncode == 1
    assert "/no/such/engine" in refused.stderr


@pytest.mark.parametrize("settings", [{"FAKE_OLD": "1"}, {"PYTHON": "/no/such/python"}])
def test_python_that_is_no_use(machine: Machine, settings: dict[str, str]):
    for newer in ("python3.11", "python3.12", "python3.13", "python3.14"):
        (machine.bin / newer).unlink(missing_ok=True)
    refused = machine.run("setup", **settings)
    assert refused.returncode == 1
    assert "3.11 or newer" in refused.stderr
    assert "PYTHON" in refused.stderr


def test_python_of_ones_own(machine: Machine):
    own = machine.add("newer", FAKE_PYTHON)
    machine.remove("python3")
    assert machine.run("setup", PYTHON=str(own)).returncode == 0


def test_python_without_venv(machine: Machine):
    refused = machine.run("setup", FAKE_NO_VENV="1")
    assert refused.returncode == 1
    assert "python3-venv" in refused.stderr


def test_drawing_is_installed_or_missed_aloud(machine: Machine):
    warned = machine.run("setup", FAKE_PICTURE="1")
    assert warned.returncode == 0
    assert "libegl1" in warned.stderr

    machine.make_root()
    (machine.clone / ".venv/dragdeck-stamp").unlink()
    machine.done()
    machine.run("setup", FAKE_PICTURE="1")
    done = machine.done()
    assert any("libegl1" in line for line in done if line.startswith("apt-get install"))
    assert done.count("picture") == 2


def test_what_step_files_need_is_installed_or_missed_aloud(machine: Machine):
    warned = machine.run("setup", FAKE_NO_CAD="1")
    assert warned.returncode == 0
    assert "STEP" in warned.stderr and "libglu1-mesa" in warned.stderr
    assert any(".[cad,crate,docs,test]" in line for line in machine.done())

    machine.make_root()
    (machine.clone / ".venv/dragdeck-stamp").unlink()
    machine.run("setup", FAKE_NO_CAD="1")
    assert any("libglu1-mesa" in line for line in machine.done() if line.startswith("apt-get i"))


def test_missing_mpirun_is_only_a_warning(machine: Machine):
    machine.remove("mpirun")
    warned = machine.run("setup")
    assert warned.returncode == 0
    assert "openmpi-bin" in warned.stderr


# --- a queue ---------------------------------------------------------------------------


def test_only_the_queue_needs_its_plugin(machine: Machine):
    machine.run("setup")
    machine.done()
    machine.run("all", FAKE_NO_PLUGIN="1")
    assert names(machine.done()) == ["snakemake"]
    machine.run("all", "--workflow-profile", "profiles/slurm", FAKE_NO_PLUGIN="1")
    installed, ran = machine.done()
    assert ".[slurm]" in installed and "--constraint constraints.txt" in installed
    assert ran.startswith(f"snakemake {SHOWN} [all] [--workflow-profile] [profiles/slurm] ")
    machine.run("all", "--workflow-profile", "profiles/slurm")
    assert names(machine.done()) == ["snakemake"]


def test_a_queue_that_would_cut_ranks_is_refused(machine: Machine):
    machine.run("setup")
    machine.done()
    refused = machine.run("all", "--profile", "profiles/slurm")
    assert refused.returncode == 1
    assert "remedy: --workflow-profile profiles/slurm" in refused.stderr
    assert machine.done() == []


def test_the_test_of_the_queue_installs_a_slurm(machine: Machine):
    machine.run("setup")
    machine.done()
    if not shutil.which("slurmctld", path="/usr/sbin"):
        refused = machine.run("test", "--slurm")
        assert refused.returncode == 1
        assert "slurm-wlm munge" in refused.stderr
    for name in ("slurmctld", "munged"):
        machine.add(name, FAKE_TOOL)
    assert machine.run("test", "--slurm", "-x").returncode == 0
    assert machine.done()[-1].startswith("pytest [--slurm] [-m] [slurm] [-x] ")


# --- the tests -------------------------------------------------------------------------


def names(lines: list[str]) -> list[str]:
    return [line.split(" [")[0].split(" in ")[0] for line in lines]


def test_test_runs_the_checks_then_pytest(machine: Machine):
    (machine.clone / "Snakefile").touch()
    (machine.clone / "workflow/rules").mkdir(parents=True)
    (machine.clone / "workflow/rules/decks.smk").touch()
    machine.run("setup")
    machine.done()
    assert machine.run("test").returncode == 0
    done = machine.done()
    checks = ["ruff", "ruff", "mypy", "lint-imports", "snakefmt", "snakemake"]
    assert names(done) == [*checks, "pytest"]
    assert "[Snakefile] [workflow/rules/decks.smk]" in done[4]


def test_the_browser_of_the_tests_is_installed_or_missed_aloud(machine: Machine):
    machine.run("setup")
    assert not any("chromium" in line for line in machine.done())
    warned = machine.run("test")
    assert warned.returncode == 0
    assert "chromium-driver" in warned.stderr

    machine.make_root()
    machine.done()
    machine.run("test")
    assert any("chromium chromium-driver" in line for line in machine.done())
    for name in ("chromium", "chromedriver"):
        machine.add(name, FAKE_TOOL)
    machine.run("test")
    assert not any("apt-get" in line for line in machine.done())


def test_bundling_scripts_needs_npm_alone(machine: Machine):
    for name in ("liggghts", "python3"):
        machine.remove(name)
    refused = machine.run("web")
    assert refused.returncode == 1
    assert "npm is missing" in refused.stderr
    for name in ("npm", "node"):
        machine.add(name, FAKE_TOOL)
    assert machine.run("web").returncode == 0
    assert names(machine.done()) == ["npm", "node"]


def test_a_quick_test_leaves_out_what_is_slow(machine: Machine):
    machine.run("setup")
    machine.done()
    assert machine.run("test", "--quick", "-x").returncode == 0
    linted, tested = machine.done()
    assert linted.startswith("ruff [check]")
    assert "[-m] [not engine and not slow] [-x]" in tested


def test_all_attacks_are_made_when_asked_for(machine: Machine):
    machine.run("setup")
    machine.done()
    assert machine.run("test", "--attacks", "-k", "kill").returncode == 0
    (line,) = machine.done()
    assert line.startswith("pytest [-n]")
    assert "[--attacks] [-m] [attack] [-k] [kill]" in line


def test_everything_leaves_no_test_out(machine: Machine):
    machine.run("setup")
    for name in ("slurmctld", "munged"):
        machine.add(name, FAKE_TOOL)
    machine.done()
    assert machine.run("test", "--everything").returncode == 0
    tested = machine.done()[-1]
    assert "[--attacks] [--slurm] [--audit] [--long-commands]" in tested and "[-m]" not in tested


def test_the_audit_runs_alone_when_asked_for(machine: Machine):
    machine.run("setup")
    machine.done()
    assert machine.run("test", "--audit", "-x").returncode == 0
    assert machine.done()[-1].startswith("pytest [--audit] [-m] [audit] [-x] ")


def test_arguments_go_to_pytest_alone(machine: Machine):
    machine.run("setup")
    machine.done()
    assert machine.run("test", "-k", "mesh or run").returncode == 0
    (line,) = machine.done()
    assert line.startswith("pytest [-k] [mesh or run] ")


def test_a_failed_check_fails_the_whole_and_still_tests(machine: Machine):
    ended = machine.run("test", FAKE_FAILS="mypy")
    assert ended.returncode == 1
    assert "quality check failed" in ended.stderr
    assert names(machine.done())[-1] == "pytest"


def test_ci_does_what_the_readme_says(machine: Machine, tmp_path: Path):
    ended = machine.run(script=".ci/run", cwd=tmp_path, FAKE_FAILS="pytest", FAKE_STATUS="4")
    assert ended.returncode == 4
    assert names(machine.done())[-1] == "pytest"


# --- the pins ----------------------------------------------------------------------------


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    entries = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+]+", entry) for entry in entries)
    named = (entry.lower().split("==") for entry in entries)
    return {re.sub(r"[-_.]+", "-", name): version for name, version in named}


def test_every_dependency_is_pinned_at_or_above_its_minimum():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = [
        *project["project"]["dependencies"],
        *project["project"]["optional-dependencies"]["test"],
        *project["project"]["optional-dependencies"]["slurm"],
        *project["build-system"]["requires"],
    ]
    for requirement in map(Requirement, wanted):
        assert requirement.specifier.contains(pins()[requirement.name.lower()]), requirement
