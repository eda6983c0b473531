"""A call of Snakemake: its settings, the records of its rules, and errors that stop it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, TypeVar
from uuid import uuid4

from jsonschema import Draft202012Validator
from snakemake.exceptions import IncompleteCheckpointException
from snakemake_interface_common.exceptions import WorkflowError

from dragdeck.errors import DragdeckError, choices
from dragdeck.files import file_checksum, write_text

V = TypeVar("V")


def or_stop(function: Callable[..., V], *arguments: object, **options: object) -> V:
    """The value of a function; what is wrong with its input stops the workflow."""
    try:
        return function(*arguments, **options)
    except DragdeckError as error:
        _stop(error)


def _stop(error: DragdeckError) -> NoReturn:
    raise WorkflowError(str(error)) from None


def checked_settings(
    config: Mapping[str, object],
    known: Mapping[str, Mapping[str, object]],
    typed: Iterable[str] = (),
) -> dict[str, str]:
    """The keys of config/config.yaml and of --config as text; `known` has the schema of each.

    Snakemake and YAML read a name such as 2024_05 as a number. `typed` has what stands behind
    --config as it was typed, ``key=value`` each.

    Raises
    ------
    WorkflowError
        A key is unknown, or a value does not fit or is no text.
    """
    given = {key: "" if value is None else value for key, value in config.items()}
    given |= dict(word.split("=", 1) for word in typed if "=" in word)
    for key, text in given.items():
        rule = known.get(key)
        if rule is None:
            problem, limit = "unknown key", choices(key, known)
        elif not isinstance(text, str):
            problem, limit = "not text", "text: in quotes in config/config.yaml"
        elif not Draft202012Validator(rule).is_valid(text):
            problem, limit = str(rule["title"]), str(rule["description"])
        else:
            continue
        raise WorkflowError(f"--config {key}={text}: {problem}\n  limit:  {limit}")
    return {key: str(text) for key, text in given.items()}


def add_records(rules: Iterable[Any], environment_file: str = "../envs/python.yaml") -> None:
    """Give each of Snakemake's rules that has a command a log, a benchmark and an environment.

    They stand in ``logs/`` and ``benchmarks/`` of the folder of its run or study, and are called
    like the rule, without the place of its runs. Rules that have a log already are left alone.
    """
    for rule in rules:
        if rule.norun or rule.log:
            continue
        folders, name = str(next(iter(rule.output), "results")).split("/"), rule.name
        depth = 2
        if "run" in rule.wildcard_names:
            depth, name = 4, name.removesuffix(f"_{folders[2]}").removesuffix("_of")
        folder = "/".join(folders[:depth])
        others = sorted(rule.wildcard_names - {"study", "run"})
        name += "".join(f"-{{{wildcard}}}" for wildcard in others)
        rule.log_modifier = rule.benchmark_modifier = rule.output_modifier
        rule.set_log(f"{folder}/logs/{name}.log")
        rule.benchmark = f"{folder}/benchmarks/{name}.tsv"
        rule.conda_env = environment_file
        rule.set_params(content=_content_of(list(rule.input)))


def _content_of(inputs: Sequence[Any]) -> Callable[[Any], str]:
    """Checksum of the project's own files among a rule's inputs: a restored file may be older."""

    def content(wildcards: Any) -> str:
        given = []
        for input_ in inputs:
            with suppress(IncompleteCheckpointException):
                given.append(input_(wildcards) if callable(input_) else input_)
        names = [name for item in given for name in ([item] if isinstance(item, str) else item)]
        paths = (Path(name) for name in names if not name.startswith(("results/", _HOMES)))
        return " ".join(file_checksum(file)[:12] for file in paths if file.is_file())

    return content


_HOMES = ".snakemake/dragdeck"


def home_of(study: str, *, idle: bool) -> str:
    """A file that is newer than results that were copied here, or whose records are gone.

    Without its records in ``.snakemake``, Snakemake takes any file for up to date. A mark among the
    results says where they were made: elsewhere, all that they are made from is checked. An `idle`
    call makes no folder for it.
    """
    home, mark = Path(_HOMES, study), Path("results", study, ".made")
    made = home.read_text() if home.is_file() else ""
    if not made or (mark.read_text() if mark.is_file() else "") != made:
        made = uuid4().hex
        write_text(home, made)
        if mark.parent.is_dir() or not idle:
            write_text(mark, made)
    return str(home)
