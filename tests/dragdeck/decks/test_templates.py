"""What a template may do, and what a value may bring into an input script."""

import re
import signal
from dataclasses import replace
from pathlib import Path

import pytest
from made_study import Made
from markupsafe import Markup

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text, effective, idle, overriding
from dragdeck.decks.templates import (
    comment,
    environment,
    quoted,
    template_files,
)
from dragdeck.errors import InputError
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.scenes.process import process_scene

BED = Bed(surface_m=0.038, top_m=0.0446)


@pytest.mark.parametrize(
    "text",
    ["a\nshell date", "a\rb", "a & b", "$x", "${x}", "a # b", 'a "b', "it's", "a\\b", "a\u2028b"],
)
def test_a_text_that_the_engine_would_read_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not allowed in an input script"):
        quoted(text)


@pytest.mark.parametrize("value", [None, True, [1], {"a": 1}, float("nan"), float("inf")])
def test_what_is_neither_text_nor_number_is_refused(value: object) -> None:
    with pytest.raises(TypeError, match="is not a number"):
        quoted(value)


def test_a_title_stays_in_its_comment(project: Project, made: Made) -> None:
    case = made({"title": 'R&D of "Müller" # $x &'})
    text = deck_text(process_scene(case, BED), environment(project.templates))
    assert text.splitlines()[0] == "# RD of Müller  x "
    assert comment("a\nb") == "ab"


def own(case: Case, text: str, name: str = "process.in.j2") -> Path:
    file = case.file.parent / "templates" / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    return file


def in_block(text: str) -> str:
    return f'{{% extends "base/process.in.j2" %}}\n{{% block extra %}}\n{text}\n{{% endblock %}}\n'


def render(case: Case, project: Project) -> str:
    templates = environment(project.templates, case.file.parent / "templates")
    return deck_text(process_scene(case, BED), templates)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{{ ''.__class__.__mro__ }}", "not allowed"),
        ("{{ deck.outputs.append(1) }}", "not allowed"),
        ("{{ 'a'.upper() }}", "not allowed"),
        ("{{ lipsum() }}", "not allowed"),
        ("{{ 'shell' | safe }}", "No filter named 'safe'"),
        ("{{ 9 ** 9999999 }}", "math range error"),
        ("{% for i in range(1000000) %}{% endfor %}", "Range too big"),
        ("{{ 'a\\nb' }}", "is not allowed in an input script"),
        ("{{ none }}", "is not a number"),
        ("{{ 1 / 0 }}", "division by zero"),
        ("{{ 'x' * 99999999999 }}", "memory"),
    ],
)
def test_a_template_is_data(case: Case, project: Project, text: str, words: str) -> None:
    own(case, in_block(text))
    with pytest.raises(InputError, match=words) as caught:
        render(case, project)
    assert "process.in.j2" in str(caught.value.file)


def test_a_template_that_extends_itself_is_explained(case: Case, project: Project) -> None:
    own(case, '{% extends "process.in.j2" %}')
    with pytest.raises(InputError, match="extends or calls itself") as caught:
        render(case, project)
    assert 'extend "base/' in str(caught.value.remedy)


def test_a_template_without_end_is_stopped(case: Case, project: Project) -> None:
    """Loops within loops: the timer goes off early, so that nobody waits."""
    loops = "{% for i in range(99999) %}" * 3 + "{% endfor %}" * 3
    own(case, in_block("{{ deck.title }}" + loops))
    templates = environment(project.templates, case.file.parent / "templates")
    scene = process_scene(case, BED)
    scene = replace(scene, deck=replace(scene.deck, title=_Alarm("slow")))
    with pytest.raises(InputError, match="takes longer than"):
        deck_text(scene, templates)
    assert signal.getitimer(signal.ITIMER_VIRTUAL)[0] == 0


class _Alarm(Markup):
    """A text that leaves a moment only once it is inserted."""

    def __html__(self) -> str:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.05)
        return ""


def test_a_misspelt_block_is_named(case: Case, project: Project) -> None:
    file = own(case, '{% extends "base/process.in.j2" %}\n\n{% block exta %}{% endblock %}\n')
    with pytest.raises(
        InputError, match="no template that it extends has a block 'exta'"
    ) as caught:
        environment(project.templates, file.parent)
    assert caught.value.field == "line 3"
    assert "did you mean 'extra'" in str(caught.value)
    assert caught.value.file == file


def test_a_new_block_within_a_known_one_is_fine(case: Case, project: Project) -> None:
    own(case, in_block("{% block mine %}# mine{% endblock %}"))
    assert "# mine" in render(case, project)


def test_files_that_no_input_script_uses_are_named_together(case: Case, project: Project) -> None:
    file = own(case, "", "proces.in.j2")
    own(case, "", "notes.txt")
    own(case, "", ".hidden")
    with pytest.raises(InputError) as caught:
        environment(project.templates, file.parent)
    assert "did you mean 'process.in.j2'" in str(caught.value)
    assert "notes.txt" in str(caught.value)
    assert "hidden" not in str(caught.value)


def test_a_file_that_an_own_template_imports_is_used(case: Case, project: Project) -> None:
    own(case, "{% macro hello() %}# hello{% endmacro %}", "mine.j2")
    text = '{% from "mine.j2" import hello %}{{ hello() }}'
    file = own(case, in_block(text))
    assert "# hello" in render(case, project)
    templates = environment(project.templates, file.parent)
    assert file.parent / "mine.j2" in template_files(templates, "process")


def test_a_command_that_leaves_the_run_is_refused(case: Case, project: Project) -> None:
    own(case, in_block("shell date"))
    with pytest.raises(InputError, match="start another program") as caught:
        render(case, project)
    assert caught.value.value == "'shell date'"


LAW = """{% extends "base/base.in.j2" %}
{% block contact_model %}
hooke tangential history
{% endblock %}
"""


@pytest.mark.parametrize("name", ["base", "process"])
def test_a_contact_law_of_a_template_holds_for_particles_and_walls(
    case: Case, project: Project, name: str
) -> None:
    own(case, LAW.replace("base.in", f"{name}.in"), f"{name}.in.j2")
    text = render(case, project)
    laws = re.findall(r"^(?:pair_style|fix .* wall/gran) .*$", text, re.MULTILINE)
    assert len(laws) == 4
    assert all(" model hooke tangential history " in law for law in laws)
    assert "Hertz-Mindlin" not in text


def test_a_whole_file_may_be_replaced(case: Case, project: Project) -> None:
    walls = (project.templates / "walls.j2").read_text()
    own(case, walls.replace("zplane 0.0", "zplane 0.001"), "walls.j2")
    assert "zplane 0.001 store_force" in render(case, project)


@pytest.mark.parametrize(
    ("name", "text", "words", "remedy"),
    [
        (
            "walls.j2",
            '{% extends "base/walls.j2" %}\n{% macro bowl(script) %}# mine{% endmacro %}',
            "the macro 'bowl' does not replace",
            "copy the whole file",
        ),
        (
            "process.in.j2",
            '{% extends "base/process.in.j2" %}\nfix damping all viscous 1e-4\n',
            "text outside of the blocks",
            "put it into a block",
        ),
        (
            "process.in.j2",
            '{% extends "base/process.in.j2" %}\n{% if deck.hard %}run 1{% endif %}\n',
            "text outside of the blocks",
            "put it into a block",
        ),
    ],
)
def test_what_an_extending_template_cannot_change_is_refused(
    case: Case, project: Project, name: str, text: str, words: str, remedy: str
) -> None:
    file = own(case, text, name)
    with pytest.raises(InputError, match=words) as caught:
        environment(project.templates, file.parent)
    assert (caught.value.file, caught.value.field) == (file, "line 2")
    assert remedy in str(caught.value.remedy)


def test_what_a_template_defines_for_its_blocks_is_no_text(case: Case, project: Project) -> None:
    text = "{% set rate %}5{% endset %}\n{% macro mine() %}# {{ rate }}{% endmacro %}\n"
    own(case, in_block("{{ mine() }}").replace("\n{% block", f"\n{text}{{% block", 1))
    assert "# 5" in render(case, project)


def test_a_template_that_changes_nothing_has_no_effect(case: Case, project: Project) -> None:
    file = own(
        case, "{% extends 'base/base.in.j2' %}{% block run %}# never{% endblock %}", "base.in.j2"
    )
    own(case, in_block("# mine"))
    templates, scene = environment(project.templates, file.parent), process_scene(case, BED)
    assert overriding(scene, templates) == {"base.in.j2", "process.in.j2"}
    assert effective(scene, templates) == {"process.in.j2"}
    (error,) = idle({"base.in.j2"}, templates)
    assert error.file == file and "changes no input script" in str(error)


@pytest.mark.parametrize("block", ["outputs", "contacts", "run", "integration"])
def test_output_that_is_analysed_cannot_be_left_out(
    case: Case, project: Project, block: str
) -> None:
    own(case, in_block("").replace("extra", block))
    with pytest.raises(InputError, match="would not write the output files") as caught:
        render(case, project)
    assert str(caught.value.value).startswith("missing: ")
    assert "super()" in str(caught.value.remedy)


def test_columns_of_a_contact_cannot_be_exchanged(case: Case, project: Project) -> None:
    contacts = "compute workpiece_contacts all wall/gran/local id pos force delta torque\n"
    own(case, in_block(contacts + "compute particle_contacts all pair/gran/local id force delta")
        .replace("extra", "contacts"))  # fmt: skip
    with pytest.raises(InputError, match="would not write the output files") as caught:
        render(case, project)
    assert "compute workpiece_contacts" in str(caught.value.value)


def test_output_of_a_template_is_its_own(case: Case, project: Project) -> None:
    own(case, in_block("{{ super() }}\nvariable mine equal step").replace("extra", "outputs"))
    assert "variable mine equal step" in render(case, project)


@pytest.mark.parametrize(
    "loop", ["label again\nrun 1\njump SELF again", "jump SELF", "label a\nlabel b\njump SELF a"]
)
def test_a_loop_without_end_is_refused(case: Case, project: Project, loop: str) -> None:
    own(case, in_block(loop))
    with pytest.raises(InputError, match="run for ever") as caught:
        render(case, project)
    assert "jump SELF" in str(caught.value.value)


@pytest.mark.parametrize(
    "loop",
    [
        "variable i loop 3\nlabel again\nnext i\njump SELF again",
        'label again\nif "1 > 0" then "jump SELF out"\njump SELF again\nlabel out',
        'label again\nif "0 > 1" then "jump SELF again"',
        "jump SELF out\nlabel out",
    ],
)
def test_a_loop_that_can_end_stays(case: Case, project: Project, loop: str) -> None:
    own(case, in_block(loop))
    assert "jump SELF" in render(case, project)


@pytest.mark.parametrize("verb", ["extends", "include"])
def test_a_missing_template_is_named_where_it_is_used(
    case: Case, project: Project, verb: str
) -> None:
    file = own(case, f'\n{{% {verb} "base/proces.in.j2" %}}\n')
    with pytest.raises(InputError, match=r"no such template: 'base/proces\.in\.j2'") as caught:
        environment(project.templates, file.parent)
    assert (caught.value.file, caught.value.field) == (file, "line 2")
