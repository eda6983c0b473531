"""From a scene to the files of its run folder."""

import hashlib
import re
from dataclasses import replace
from pathlib import Path

import jinja2

from dragdeck.decks import CASE_FILE, COLUMNS_FILE, DECK_FILE, END, OUTCOME_FILE, RUN_FILE
from dragdeck.decks import templates as deck_templates
from dragdeck.decks.deck import AnyScene
from dragdeck.decks.outputs import WORKPIECE_FORCE, ColumnsFile, in_writing_order
from dragdeck.errors import InputError
from dragdeck.files import file_checksum, write_text
from dragdeck.script.commands import (
    commands,
    contact_laws,
    endless,
    late_lists,
    law_commands,
    leaving_folder,
)
from dragdeck.script.findings import Finding, without_accepted
from dragdeck.script.flow import read_script
from dragdeck.script.rules import script_findings
from dragdeck.study import contact_law


def deck_text(scene: AnyScene, templates: jinja2.Environment) -> str:
    """The deck of a scene.

    Raises
    ------
    InputError
        A template cannot be used: names template, line and what is missing. Or the deck would
        start a program, reach files outside of the run's folder, run for ever, rebuild its
        neighbour lists too late, not write what ``columns.json`` says, or has a contact law in an
        order that LIGGGHTS refuses.
    """
    names = ", ".join(_used(scene, templates))
    text = _rendered(scene, templates, names)
    file = deck_templates.file_of(templates, scene.template)
    if f'\nprint "{END}"\n' not in text or not all(c.isprintable() or c in "\n\t" for c in text):
        raise InputError(
            "the input script is not printable text, or lacks its last command",
            file=file,
            limit=f"printable characters, and the last command of base.in.j2: print {END}",
            remedy="extend the project's template, and override blocks of it",
        )
    source = scene.deck.source
    for command, why in (*leaving_folder(text, source), *endless(text), *late_lists(text)):
        raise InputError(
            f"the input script would {why}",
            file=file,
            value=ascii(command),
            remedy="remove the command from the template; see docs/reference/templates.md",
        )
    for law in contact_laws(text):
        if not contact_law.in_order(law):
            raise InputError(
                "LIGGGHTS refuses the order of keywords in this contact law",
                file=file,
                value=" ".join(law),
                limit=f"the order model {' '.join(contact_law.KEYWORDS)}",
                remedy="write the block contact_model in this order",
            )
    if overriding(scene, templates) and scene.override is None:
        _check_outputs(scene, text, _rendered(scene, deck_templates.without(templates)), file)
    return text


def _used(scene: AnyScene, templates: jinja2.Environment) -> list[str]:
    with deck_templates.template_errors(scene.template):
        return deck_templates.used(templates, scene.template)


def _rendered(scene: AnyScene, templates: jinja2.Environment, names: str = "") -> str:
    """A deck, whose header names these templates."""
    deck = replace(scene.deck, templates=names, outputs=in_writing_order(scene.deck.outputs))
    with deck_templates.template_errors(scene.template):
        return templates.get_template(scene.template).render(deck=deck)


def _check_outputs(scene: AnyScene, text: str, original: str, file: Path) -> None:
    """Refuse a deck that does not write what ``columns.json`` says as the original writes it."""
    columns = [column.engine for output in scene.deck.outputs for column in output.columns]
    names = {
        f"{name}{number}"
        for output in scene.deck.outputs
        for name, number in [
            (f"write_{output.name}", ""),
            *((f"{output.name}_", at) for at in range(1, len(output.columns) + 1)),
        ]
    } | set(re.findall(r"\bc_(\w+)", " ".join(columns)))
    there = [command.words for command in commands(text)]
    for command in commands(original):
        defines = command.words[0] in ("compute", "dump", "fix", "variable")
        if defines and command.words[1] in names and command.words not in there:
            raise InputError(
                "the input script would not write the output files that are analysed",
                file=file,
                value=f"missing: {command.text}",
                limit="all commands that write them, unchanged",
                remedy="insert the original content of the block with {{ super() }}, and write "
                "additional output to files of other names",
            )


def overriding(scene: AnyScene, templates: jinja2.Environment) -> set[str]:
    """Names of the project's templates in whose place a scene uses a study's own."""
    return {name for name in _used(scene, templates) if deck_templates.replaced(templates, name)}


def _added_forces(text: str) -> list[str]:
    """What the contact laws of a deck add to the force that limits friction."""
    laws = contact_laws(text)
    return list(dict.fromkeys(force for law in laws for force in contact_law.added_forces(law)))


def of_its_templates(
    text: str, scene: AnyScene, templates: jinja2.Environment
) -> dict[str, tuple[str, ...]]:
    """What ``case.json`` says of the deck of a scene, `text`, and what templates change in it."""
    original = _rendered(scene, deck_templates.without(templates))
    law, limit = scene.deck.materials.law, ["limitForce on"] if scene.deck.limit_force else []
    options = [*limit, *law.settings]
    unchanged = {
        " ".join(["pair_style gran model", law.model, *options]),
        " ".join(["wall/gran model", law.model, "store_force yes", *options]),
        *(
            command
            for command in law_commands(original)
            if command.startswith(("fix ", "pair_coeff"))
        ),
    }
    changed = tuple(command for command in law_commands(text) if command not in unchanged)
    known = _added_forces(original)  # each has its formula in dragdeck.study.contact_law
    added = tuple(force for force in _added_forces(text) if force not in known or changed)
    scripts = changed_scripts(text, scene, templates)
    findings = tuple(map(str, findings_on(text))) if scripts else ()
    return {
        "added_forces": added,
        "changed_law": changed,
        "changed_scripts": scripts,
        "script_findings": findings,
    }


def findings_on(text: str) -> list[Finding]:
    """What the rules on scripts say of a deck; see `dragdeck.script.rules`."""
    script = read_script(Path(DECK_FILE), text=text)
    return without_accepted(script_findings(script), script, ())[0]


def changed_scripts(text: str, scene: AnyScene, templates: jinja2.Environment) -> tuple[str, ...]:
    """Templates that change commands of the deck of a scene, `text`, each with its blocks.

    Those of the study, and those of the project that are not as they were shipped.
    """
    whole = [command.words for command in commands(text)]

    def changes(others: jinja2.Environment) -> bool:
        try:
            return [command.words for command in commands(_rendered(scene, others))] != whole
        except InputError:  # the rest needs it
            return True

    changed = []
    for name in sorted(overriding(scene, templates)):
        if changes(deck_templates.without(templates, name)):
            blocks = deck_templates.own_blocks(templates, name)
            named = [
                block
                for block in blocks
                if changes(deck_templates.without_block(templates, name, block))
            ]
            changed.append(f"{name} ({', '.join(named)})" if named else name)
    names = _used(scene, templates)
    return *changed, *(
        f"templates/{name} of the project" for name in deck_templates.edited(templates, names)
    )


def write_workpiece(
    scene: AnyScene, folder: Path, number: int, run: Path, templates: jinja2.Environment
) -> None:
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
    templates : Environment
        Those of the run.
    """
    outputs = {output.name: output.as_part() for output in scene.deck.outputs}
    forces = [outputs.pop(name) for name in list(outputs) if name.startswith(WORKPIECE_FORCE)]
    columns = ColumnsFile(outputs={**outputs, WORKPIECE_FORCE: forces[number - 1]})
    changed = of_its_templates(deck_text(scene, templates), scene, templates)
    texts = {
        CASE_FILE: scene.case.model_copy(update=changed).as_text(),
        COLUMNS_FILE: columns.as_text(),
        **scene.texts(),
        **{
            name: (run / name).read_text(encoding="utf-8")
            for name in (RUN_FILE, OUTCOME_FILE)
            if (run / name).is_file()
        },
    }
    for name, text in texts.items():
        write_text(folder / name, text)


def write_run(scene: AnyScene, folder: Path, templates: jinja2.Environment) -> list[Path]:
    """Write a run's input files: deck, case.json, columns.json, particles, meshes.

    Everything is made before anything is written, and a file replaces its old
    version in one step.

    Returns
    -------
    list of Path
        The files.
    """
    columns = ColumnsFile(outputs={output.name: output.as_part() for output in scene.deck.outputs})
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
    written = {"files": checksums, **of_its_templates(texts[DECK_FILE], scene, templates)}
    texts[CASE_FILE] = scene.case.model_copy(update=written).as_text()
    for name, text in texts.items():
        write_text(folder / name, text)
    return [folder / name for name in texts]
