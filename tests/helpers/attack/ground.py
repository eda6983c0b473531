"""The study that is attacked: made once, copied for every attack, compared afterwards."""

import fcntl
import json
import os
import resource
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from paths import DATA, PROJECT, ROOT

from attack.calls import Said, call, command, main_of
from dragdeck.project import Project
from dragdeck.scenes.process import SCENES

SEED = int(os.environ.get("ATTACK_SEED", "13"))
"""Of the random choices of the attacks."""

STUDY = "tiny"
TINY_STUDY = DATA / "tiny_study.yaml"
PLACES = ("drop_test", "filling", "process")


@dataclass(frozen=True)
class Phase:
    """A command of the study, what it takes, and the files there are before it.

    Attributes
    ----------
    name : str
    words : sequence of str
        The command, with paths from the project's folder.
    run : str
        The run folder that it works on, or the report's.
    engine : bool
        Whether it runs LIGGGHTS.
    cpu_s : float
        Processor time that it took undisturbed, s.
    bytes : int
        What it wrote.
    before : sequence of str
        Files of the project before it.
    """

    name: str
    words: Sequence[str]
    run: str
    engine: bool
    cpu_s: float = 0.0
    bytes: int = 0
    before: Sequence[str] = ()


@dataclass(frozen=True)
class Undisturbed:
    """The tiny study as it was made command by command, with what resumed runs must give.

    LIGGGHTS gives the same digits every time from the same start, and others after a resume.
    What a killed run must give is therefore what the engine gives that is stopped and
    resumed at the same steps: alone, with every checkpoint kept.
    """

    root: Path
    phases: Mapping[str, Phase]

    @property
    def cache(self) -> Path:
        """Folder of the resumed runs."""
        return self.root.parent

    def run(self, place: str) -> str:
        """Path of the one run folder of a scene from the project's folder."""
        (folder,) = (self.root / "results" / STUDY / place).iterdir()
        return str(folder.relative_to(self.root))

    def phase(self, place: str) -> Phase:
        """The command that runs the engine for a scene."""
        return self.phases[place.replace("_", " ")]

    def after(self, phase: Phase) -> Sequence[str]:
        """Files of the project after a phase."""
        order = [*self.phases]
        following = order[order.index(phase.name) + 1 :]
        return self.phases[following[0]].before if following else files_of(self.root)

    def copy_before(self, phase: Phase, target: Path) -> Path:
        """A copy of the project as it was before a phase."""
        return _copied(self.root, phase.before, target)

    def copy(self, target: Path) -> Path:
        """A copy of the finished project."""
        return _copied(self.root, files_of(self.root), target)

    def tables(self, place: str, steps: Sequence[int]) -> Path:
        """Folder of the tables of a run that was resumed at these steps."""
        run, name = self.run(place), "-".join([place, "from", "0", *map(str, steps)])
        with made_once(self.cache / name) as project:
            if project is not None:
                self._resume(place, steps, project)
        return self.cache / name / run / "tables"

    def _resume(self, place: str, steps: Sequence[int], project: Path) -> None:
        run = self.run(place)
        folder = self.copy(project) / run
        shutil.rmtree(folder / "tables")
        for file in self._checkpoints(place) if steps else ():
            shutil.copy2(file, folder / file.name)
        for part, step in enumerate(steps, 2):
            _engine(folder, part, f"checkpoint.{step}.restart")
            if place == "filling":  # only the part that ends writes the settled particles
                (folder / f"particles.{part - 1}.bin").unlink()
        said = main_of("dragchain", ["tables", run], project)
        assert said.status == 0, said.text

    def _checkpoints(self, place: str) -> Iterator[Path]:
        """Every checkpoint of an undisturbed run."""
        folder = self.cache / f"{place}-checkpoints"
        with made_once(folder) as project:
            if project is not None:
                self.copy_before(self.phase(place), project)
                _engine(project / self.run(place), 1)
        return (folder / self.run(place)).glob("checkpoint.*.restart")


def files_of(root: Path) -> list[str]:
    """Files of the study's results and of the study, from the project's folder."""
    found = [*(root / "results").rglob("*"), *(root / "studies").rglob("*")]
    return sorted(str(file.relative_to(root)) for file in found if file.is_file())


def _copied(root: Path, files: Sequence[str], target: Path) -> Path:
    new_project(target)
    for name in files:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(root / name, target / name)
    return target


def new_project(folder: Path, *, whole: bool = False) -> Path:
    """An empty project with the real templates and meshes; `whole`: with its workflow."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PROJECT if whole else ("templates", "meshes"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "studies").mkdir()
    return folder


def tiny_study() -> dict[str, Any]:
    """The tiny study as plain data."""
    data: dict[str, Any] = yaml.safe_load(TINY_STUDY.read_text(encoding="utf-8"))
    return data


def write_study(project: Path, data: object, name: str = STUDY) -> Path:
    """Write a study into a project."""
    file = project / "studies" / name / "study.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    text = data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False)
    file.write_text(text, encoding="utf-8")
    return file


# --- making it ----------------------------------------------------------------------


def undisturbed(folder: Path) -> Undisturbed:
    """The study that all processes of one test session share; the first one makes it."""
    record = folder / "project/phases.json"
    with made_once(folder / "project") as project:
        if project is not None:
            record.write_text(json.dumps([asdict(phase) for phase in _make(project)]))
    phases = [Phase(**phase) for phase in json.loads(record.read_text())]
    return Undisturbed(folder / "project", {phase.name: phase for phase in phases})


@contextmanager
def made_once(folder: Path) -> Iterator[Path | None]:
    """One process at a time: the folder while it is to be made, None when it has been."""
    with folder.with_suffix(".lock").open("w") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        if (folder / "done").is_file():
            yield None
        else:
            shutil.rmtree(folder, ignore_errors=True)
            yield folder
            (folder / "done").touch()


def _make(root: Path) -> Iterator[Phase]:
    new_project(root)
    write_study(root, TINY_STUDY.read_text(encoding="utf-8"))
    runs = {}
    for place in PLACES:
        runs[place] = _render(root, place, runs.get("filling"))
        name = place.replace("_", " ")
        words = command("dragdeck", "run", runs[place])
        yield _made(root, Phase(name, words, runs[place], engine=True))
        for step in ("tables", "figures") if place != "process" else ():
            said = main_of("dragchain", [step, runs[place]], root)
            assert said.status == 0, said.text
    for step in ("tables", "chains", "loading", "quantities", "figures"):
        words = command("dragchain", step, runs["process"])
        yield _made(root, Phase(step, words, runs["process"], engine=False))
    folder = f"results/{STUDY}/report"
    words = command("dragchain", "report", "--out", folder, runs["process"])
    yield _made(root, Phase("report", words, folder, engine=False))


def _render(root: Path, place: str, filling: str | None) -> str:
    """Render the only run of a scene."""
    (case,) = Project(root).cases(STUDY)
    name = SCENES[place].run_id(case)
    bed = ["--packing", f"{filling}/tables/packing.json"] if place == "process" else []
    said = main_of("dragdeck", ["step", "render", STUDY, place, name, *bed], root)
    assert said.status == 0, said.text
    return f"results/{STUDY}/{place}/{name}"


def _made(root: Path, phase: Phase) -> Phase:
    before = files_of(root)
    size = size_of(root)
    if phase.name == "chains":  # it compiles code when it is called for the first time
        main_of("dragchain", ["chains", phase.run], root)
    spent = _children_s()
    said = call(phase.words, root, root / "said.log")
    assert said.status == 0, f"{phase.name}: {said.text}"
    written, cpu_s = size_of(root) - size, _children_s() - spent
    return replace(phase, cpu_s=cpu_s, bytes=written, before=before)


def _children_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def size_of(folder: Path) -> int:
    """Bytes of disk that the files below a folder take."""
    return sum(512 * file.lstat().st_blocks for file in folder.rglob("*"))


# --- the same tables ------------------------------------------------------------------

_VOLATILE = {"started", "wall_time_s", "cpu_time_s", "steps_per_s", "versions", "made", "written"}


def differences(found: Path, wanted: Path, names: Iterable[str] | None = None) -> list[str]:
    """What is not the same in two folders of tables, to the last bit of every column.

    `names`: of the files that are compared, all by default, from the folder.
    """
    every = (str(file.relative_to(wanted)) for file in wanted.rglob("*"))
    problems = []
    for name in sorted(every if names is None else names):
        if not name.endswith((".parquet", ".json", ".csv")):
            continue
        if not (found / name).is_file():
            problems.append(f"{name} is missing")
        elif not name.endswith(".csv"):
            try:
                problems += [f"{name}{at} differs" for at in _unlike(found / name, wanted / name)]
            except (ValueError, OSError, pa.ArrowException) as error:
                problems.append(f"{name} cannot be read: {error}")
    return problems


def _unlike(found: Path, wanted: Path) -> list[str]:
    """Names of columns or keys whose values differ; one without a name if those differ."""
    one, other = _content(found), _content(wanted)
    if isinstance(one, dict) and isinstance(other, dict) and list(one) == list(other):
        return [f": {name}" for name in other if repr(one[name]) != repr(other[name])]
    return [] if repr(one) == repr(other) else [""]


def _content(file: Path) -> Any:
    """What a table or a document says, without what is never the same twice."""
    if file.suffix == ".parquet":
        return _lasting(pq.read_table(file).to_pydict())
    return _lasting(json.loads(file.read_text(encoding="utf-8")))


def _lasting(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _lasting(item) for name, item in value.items() if name not in _VOLATILE}
    return [_lasting(item) for item in value] if isinstance(value, list) else value


# --- what a resumed run must give -----------------------------------------------------


def resumed_at(run_dir: Path) -> list[int]:
    """Steps at which a finished run was resumed."""
    parts = json.loads((run_dir / "run.json").read_text())["parts"]
    steps = [part["from_step"] for part in parts]
    while len(steps) > 1 and steps[1] == 0:  # a start that left no checkpoint was made again
        steps.pop(0)
    return steps[1:]


def _engine(folder: Path, part: int, source: str | None = None) -> Said:
    words = ["liggghts", "-in", "in.liggghts", "-log", f"engine.{part}.log"]
    words[0] = os.environ.get("DRAGDECK_ENGINE", words[0])
    words += ["-var", "part", str(part)]
    if source is not None:
        words += ["-var", "resume", "1", "-var", "from", source]
    said = call(words, folder, folder / f"screen.{part}.txt")
    assert said.status == 0, said.text
    return said
