"""From a scene to the files of its run folder."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import jinja2
import jinja2.meta

from dragdeck.decks import CASE_FILE, COLUMNS_FILE, DECK_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.outputs import ColumnsFile
from dragdeck.errors import InputError
from dragdeck.files import file_checksum, replace_text
from dragdeck.mesh import stl_text


def environment(project: Path, study: Path | None = None) -> jinja2.Environment:
    """The Jinja environment: a study's own templates first, then the project's.

    Parameters
    ----------
    project : Path
        The project's folder of templates. Its files are also known as
        ``base/<name>``, so that a study's template of the same name can extend
        the one it replaces.
    study : Path, optional
        The study's folder of templates.
    """
    folders = [str(study)] if study is not None and study.is_dir() else []
    loader = jinja2.ChoiceLoader(
        [
            jinja2.FileSystemLoader([*folders, str(project)]),
            jinja2.PrefixLoader({"base": jinja2.FileSystemLoader(str(project))}),
        ]
    )
    found = jinja2.Environment(
        loader=loader,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    found.filters["num"] = number
    found.filters["nums"] = numbers
    return found


def number(value: float) -> str:
    """A number that reads back exactly."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is not a number")
    return repr(value)


def numbers(values: Iterable[float]) -> str:
    """Numbers that read back exactly, with spaces between."""
    return " ".join(number(value) for value in values)


def deck_text(scene: AnyScene, templates: jinja2.Environment) -> str:
    """The deck of a scene.

    Raises
    ------
    InputError
        A template cannot be used: names template, line and what is missing.
    """
    with _explained():
        template = templates.get_template(scene.template)
        used = "templates: " + ", ".join(_used(templates, scene.template))
        return template.render(deck=replace(scene.deck, templates=used))


@contextlib.contextmanager
def _explained() -> Iterator[None]:
    """Turn what Jinja raises into an error that names template and line."""
    try:
        yield
    except jinja2.TemplateSyntaxError as error:
        raise InputError(
            f"template syntax: {error.message}",
            file=error.filename or error.name,
            field=f"line {error.lineno}",
        ) from None
    except jinja2.TemplateNotFound as error:
        raise InputError(
            "no such template",
            file=str(error.name),
            remedy="put it into the study's templates/, or correct the name",
        ) from None
    except (jinja2.UndefinedError, TypeError) as error:
        file, line = _place(error)
        raise InputError(
            f"a value is missing: {error}",
            file=file,
            field=f"line {line}",
            remedy="correct the name, or set it there; docs/templates.md lists the values",
        ) from None


def _place(error: Exception) -> tuple[str, int | str]:
    """Template file and line where a rendering error arose."""
    trace = error.__traceback__
    place: tuple[str, int | str] = ("template", "?")
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if file.endswith(".j2"):
            place = (file, trace.tb_lineno)
        trace = trace.tb_next
    return place


def _used(templates: jinja2.Environment, name: str) -> list[str]:
    """Names of the templates that a template is made of, itself first."""
    used: list[str] = []
    waiting = [name]
    while waiting:
        current = waiting.pop(0)
        if current in used:
            continue
        used.append(current)
        waiting.extend(_references(templates, current))
    return used


def _references(templates: jinja2.Environment, name: str) -> list[str]:
    assert templates.loader is not None
    source, _, _ = templates.loader.get_source(templates, name)
    found = jinja2.meta.find_referenced_templates(templates.parse(source))
    return [reference for reference in found if reference is not None]


def write_run(scene: AnyScene, folder: Path, templates: jinja2.Environment) -> list[Path]:
    """Write a run's input files: deck, case.json, columns.json, particles, meshes.

    Everything is made before anything is written, and a file replaces its old
    version in one step.

    Returns
    -------
    list of Path
        The files.
    """
    columns = ColumnsFile(outputs={each.name: each.as_part() for each in scene.deck.outputs})
    texts = {
        DECK_FILE: deck_text(scene, templates),
        COLUMNS_FILE: columns.as_text(),
        **scene.files,
        **{name: stl_text(mesh) for name, mesh in scene.meshes.items()},
    }
    checksums = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    source = folder / scene.deck.source
    if scene.deck.source not in texts and source.is_file():
        checksums[scene.deck.source] = file_checksum(source)
    texts[CASE_FILE] = scene.case.model_copy(update={"files": checksums}).as_text()
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        replace_text(folder / name, text)
    return [folder / name for name in texts]


def template_files(templates: jinja2.Environment, scene: str) -> list[Path]:
    """The template files that a scene's deck is made of, in no order that matters.

    Raises
    ------
    InputError
        One of them is missing or cannot be parsed.
    """
    assert templates.loader is not None
    with _explained():
        names = _used(templates, f"{scene}.in.j2")
        sources = [templates.loader.get_source(templates, name)[1] for name in names]
    return sorted({Path(source) for source in sources if source is not None})
