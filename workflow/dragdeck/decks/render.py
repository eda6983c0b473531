"""From a scene to the files of its run folder."""

import hashlib
from dataclasses import replace
from pathlib import Path

import jinja2

from dragdeck.decks import CASE_FILE, COLUMNS_FILE, DECK_FILE, END, RUN_FILE
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.engine_commands import leaving_folder
from dragdeck.decks.outputs import WORKPIECE_FORCE, ColumnsFile, in_writing_order
from dragdeck.decks.templates import explained, file_of, used
from dragdeck.errors import InputError
from dragdeck.files import file_checksum, replace_text


def deck_text(scene: AnyScene, templates: jinja2.Environment) -> str:
    """The deck of a scene.

    Raises
    ------
    InputError
        A template cannot be used: names template, line and what is missing. Or the deck would
        start a program, or reach files outside of the run's folder.
    """
    with explained():
        template = templates.get_template(scene.template)
        names = ", ".join(used(templates, scene.template))
        outputs = in_writing_order(scene.deck.outputs)
        text = template.render(deck=replace(scene.deck, templates=names, outputs=outputs))
    if f'\nprint "{END}"\n' not in text or not all(c.isprintable() or c in "\n\t" for c in text):
        raise InputError(
            "the input script is not printable text, or lacks its last command",
            file=file_of(templates, scene.template),
            limit=f"printable characters, and the last command of base.in.j2: print {END}",
            remedy="extend the project's template, and override blocks of it",
        )
    for command, why in leaving_folder(text, scene.deck.source):
        raise InputError(
            f"the input script would {why}",
            file=file_of(templates, scene.template),
            value=ascii(command),
            remedy="remove the command from the template; see docs/reference/templates.md",
        )
    return text


def write_workpiece(scene: AnyScene, folder: Path, number: int, run: Path) -> None:
    """Write the folder of a further workpiece of a complete run, from which tables are made.

    It has what a run's folder has but for the input script and the output, which are the run's.

    Parameters
    ----------
    scene : AnyScene
        Of the workpiece.
    folder : Path
    number : int
        Of the workpiece, from 1.
    run : Path
        Folder of the run.
    """
    outputs = {each.name: each.as_part() for each in scene.deck.outputs}
    forces = [outputs.pop(name) for name in list(outputs) if name.startswith(WORKPIECE_FORCE)]
    columns = ColumnsFile(outputs={**outputs, WORKPIECE_FORCE: forces[number - 1]})
    texts = {
        CASE_FILE: scene.case.as_text(),
        COLUMNS_FILE: columns.as_text(),
        **scene.texts(),
        RUN_FILE: (run / RUN_FILE).read_text(encoding="utf-8"),
    }
    for name, text in texts.items():
        replace_text(folder / name, text)


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
        **scene.texts(),
    }
    checksums = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    folder.mkdir(parents=True, exist_ok=True)  # the source's path may lead through it
    source = folder / scene.deck.source
    if scene.deck.source not in texts and source.is_file():
        checksums[scene.deck.source] = file_checksum(source)
    texts[CASE_FILE] = scene.case.model_copy(update={"files": checksums}).as_text()
    for name, text in texts.items():
        replace_text(folder / name, text)
    return [folder / name for name in texts]
