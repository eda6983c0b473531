"""What a template may do, and what a value may bring into an input script."""

import re
from pathlib import Path

import pytest
from made_scenes import BED, own_template, script
from made_study import Made

from dragdeck.cases.case import Case
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import comment, environment, quoted, template_files
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.process import process_scene


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
    text = script(case, project)
    assert text.splitlines()[0] == "# RD of Müller  x "
    assert comment("a\nb") == "ab"


def in_block(text: str) -> str:
    return f'{{% extends "base/process.in.j2" %}}\n{{% block extra %}}\n{text}\n{{% endblock %}}\n'


def render(case: Case, project: Project) -> str:
    templates = environment(project.templates, case.file.parent / "templates")
    return deck_text(process_scene(case, BED), templates)


PROCESS, WALLS = "process.in.j2", "walls.j2"
_EXTENDS = '{% extends "base/process.in.j2" %}\n'
_CONTACTS = """compute workpiece_contacts all wall/gran/local id pos force delta torque
compute particle_contacts all pair/gran/local id force delta"""
_LOOPS = ("label again\nrun 1\njump SELF again", "jump SELF", "label a\nlabel b\njump SELF a")
_ANALYSED = ("outputs", "contacts", "run", "integration")
_NOT_WRITTEN = "would not write the output files"
_GLOBALS = "__init__.__globals__"
_SHELL = ".popen('touch pwned').read() }}"
_NOT_ALLOWED = [
    *(f"{{{{ {name}.{_GLOBALS}.os{_SHELL}" for name in ("cycler", "joiner", "namespace")),
    f"{{{{ self.{_GLOBALS}.__builtins__.__import__('os'){_SHELL}",
    *("{{ deck.__class__ }}", f"{{{{ deck.{_GLOBALS} }}}}", "{{ deck.__module__ }}"),
    *("{{ '{0.__class__.__mro__}'.format(deck) }}", "{{ '{a.b}'.format_map({'a': deck}) }}"),
]
_MISTAKEN = {
    f"{{{{ (cycler|attr('__init__')|attr('__globals__'))['os']{_SHELL}": "a value is missing",
    "{{ [deck]|map(attribute='__class__')|list }}": "is not a number",
    "{{ 1|speeed }}": "No filter named",
    "{{ 1 is speeed }}": "No test named",
    "{{ deck.outputs[99].name }}": "has no element 99",
    "{{ 'a' + 1 }}": "cannot be used",
    "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}": "calls itself endlessly",
    '{% include "../study.yaml" %}': "no such template",
    '{% include "/etc/passwd" %}': "no such template",
    '{% import "missing.j2" as m %}': "no such template",
    "{% do deck.title %}": "unknown tag",
    "{% set deck.title = 'b' %}": "cannot assign attribute",
    "{{ " + "(" * 3000 + "1" + ")" * 3000 + " }}": "nested too deeply",
    "{% if true %}" * 2000 + "{% endif %}" * 2000: "nested too deeply",
    "{% endblock %}{% block extra %}": "defined twice",
    "a\x00b": "not printable text",
}
REFUSED = [
    *((PROCESS, in_block(text), "not allowed") for text in _NOT_ALLOWED),
    *((PROCESS, in_block(text), words) for text, words in _MISTAKEN.items()),
    (PROCESS, "", "lacks its last command"),
    (PROCESS, "run 1\n", "lacks its last command"),
    (PROCESS, in_block("{{ ''.__class__.__mro__ }}"), "not allowed"),
    (PROCESS, in_block("{{ deck.outputs.append(1) }}"), "not allowed"),
    (PROCESS, in_block("{{ 'a'.upper() }}"), "not allowed"),
    (PROCESS, in_block("{{ lipsum() }}"), "not allowed"),
    (PROCESS, in_block("{{ 'shell' | safe }}"), "No filter named 'safe'"),
    (PROCESS, in_block("{{ 9 ** 9999999 }}"), "math range error"),
    (PROCESS, in_block("{% for i in range(1000000) %}{% endfor %}"), "Range too big"),
    (PROCESS, in_block("{{ 'a\\nb' }}"), "is not allowed in an input script"),
    (PROCESS, in_block("{{ none }}"), "is not a number"),
    (PROCESS, in_block('{{ "x" | num }}'), "'x'"),
    (PROCESS, in_block("{{ 1 / 0 }}"), "division by zero"),
    (PROCESS, in_block("{{ 'x' * 99999999999 }}"), "memory"),
    (PROCESS, in_block("\n{{ deck.colour }}"), "line 4: .*colour"),
    (PROCESS, "{% block extra %}", "template syntax"),
    (PROCESS, '{% extends "process.in.j2" %}', '(?s)extends or calls itself.*extend "base/'),
    (PROCESS, f"{_EXTENDS}\n{{% block exta %}}{{% endblock %}}\n",
     "(?s)line 3: .*no template that it extends has a block 'exta'.*did you mean 'extra'"),
    *((PROCESS, in_block(f"neigh_modify {words}"), f"(?s)rebuild neighbour lists too late.*{words}")
      for words in ("every 5", "delay 10 check no", "exclude type 1 1 once yes")),
    (PROCESS, in_block("shell date"), "(?s)start another program.*'shell date'"),
    (PROCESS, f"{_EXTENDS}fix damping all viscous 1e-4\n",
     "(?s)line 2: .*text outside of the blocks.*put it into a block"),
    (PROCESS, f"{_EXTENDS}{{% if deck.hard %}}run 1{{% endif %}}\n",
     "(?s)line 2: .*text outside of the blocks.*put it into a block"),
    (WALLS, '{% extends "base/walls.j2" %}\n{% macro bowl(script) %}# mine{% endmacro %}',
     "(?s)line 2: .*the macro 'bowl' does not replace.*copy the whole file"),
    *((PROCESS, in_block("").replace("extra", block), rf"(?s){_NOT_WRITTEN}.*missing: .*super\(\)")
      for block in _ANALYSED),
    (PROCESS, in_block(_CONTACTS).replace("extra", "contacts"),
     f"(?s){_NOT_WRITTEN}.*compute workpiece_contacts"),
    *((PROCESS, in_block(loop), "(?s)run for ever.*jump SELF") for loop in _LOOPS),
    *((PROCESS, f'\n{{% {verb} "base/proces.in.j2" %}}\n',
       r"line 2: no such template: 'base/proces\.in\.j2'") for verb in ("extends", "include")),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "words"), REFUSED)
def test_a_template_that_cannot_be_is_refused_and_named(
    case: Case, project: Project, name: str, text: str, words: str
) -> None:
    own_template(case, text, name)
    with pytest.raises(InputError, match=words) as caught:
        render(case, project)
    assert name in str(caught.value.file)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (bytes(range(256)) * 9, "not UTF-8 text"),
        (_EXTENDS.encode("utf-16"), "not UTF-8 text"),
        (Path(PROCESS), "this is not a file"),
        (Path("nothing"), "this is not a file"),
        (None, "this is not a file"),
    ],
)
def test_a_template_that_cannot_be_read_is_refused(
    case: Case, project: Project, content: bytes | Path | None, words: str
) -> None:
    """Bytes, a link to itself or to nothing, a folder."""
    file = own_template(case, "")
    file.unlink()
    if content is None:
        file.mkdir()
    elif isinstance(content, Path):
        file.symlink_to(content)
    else:
        file.write_bytes(content)
    with pytest.raises(InputError, match=rf"process\.in\.j2: {words}"):
        render(case, project)


def test_templates_that_extend_each_other_are_refused(case: Case, project: Project) -> None:
    own_template(case, '{% extends "filling.in.j2" %}')
    own_template(case, '{% extends "process.in.j2" %}', "filling.in.j2")
    with pytest.raises(InputError, match="extends or calls itself endlessly"):
        render(case, project)


def test_a_new_block_within_a_known_one_is_fine(case: Case, project: Project) -> None:
    own_template(case, in_block("{% block mine %}# mine{% endblock %}"))
    assert "# mine" in render(case, project)


def test_files_that_no_input_script_uses_are_named_together(case: Case, project: Project) -> None:
    file = own_template(case, "", "proces.in.j2")
    own_template(case, "", "notes.txt")
    own_template(case, "", ".hidden")
    with pytest.raises(InputError) as caught:
        environment(project.templates, file.parent)
    assert "did you mean 'process.in.j2'" in str(caught.value)
    assert "notes.txt" in str(caught.value)
    assert "hidden" not in str(caught.value)


def test_a_file_that_an_own_template_imports_is_used(case: Case, project: Project) -> None:
    own_template(case, "{% macro hello() %}# hello{% endmacro %}", "mine.j2")
    text = '{% from "mine.j2" import hello %}{{ hello() }}'
    file = own_template(case, in_block(text))
    assert "# hello" in render(case, project)
    templates = environment(project.templates, file.parent)
    assert file.parent / "mine.j2" in template_files(templates, "process")


LAW = """{% extends "base/base.in.j2" %}
{% block contact_model %}
hooke tangential history
{% endblock %}
"""


@pytest.mark.parametrize("name", ["base", "process"])
def test_a_contact_law_of_a_template_holds_for_particles_and_walls(
    case: Case, project: Project, name: str
) -> None:
    own_template(case, LAW.replace("base.in", f"{name}.in"), f"{name}.in.j2")
    text = render(case, project)
    laws = re.findall(r"^(?:pair_style|fix .* wall/gran) .*$", text, re.MULTILINE)
    assert len(laws) == 4
    assert all(" model hooke tangential history " in law for law in laws)
    assert "Hertz-Mindlin" not in text


def test_a_whole_file_may_be_replaced(case: Case, project: Project) -> None:
    walls = (project.templates / "walls.j2").read_text()
    own_template(case, walls.replace("(wall.at_m | num)", "0.001"), "walls.j2")
    assert "zplane 0.001 store_force" in render(case, project)


def test_what_a_template_defines_for_its_blocks_is_no_text(case: Case, project: Project) -> None:
    text = "{% set rate %}5{% endset %}\n{% macro mine() %}# {{ rate }}{% endmacro %}\n"
    own_template(case, in_block("{{ mine() }}").replace("\n{% block", f"\n{text}{{% block", 1))
    assert "# 5" in render(case, project)


def test_output_of_a_template_is_its_own(case: Case, project: Project) -> None:
    own_template(
        case, in_block("{{ super() }}\nvariable mine equal step").replace("extra", "outputs")
    )
    assert "variable mine equal step" in render(case, project)


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
    own_template(case, in_block(loop))
    assert "jump SELF" in render(case, project)


def test_each_template_is_that_of_the_nearest_study_which_has_it(
    case: Case, project: Project
) -> None:
    """Also where a file of the base, which another one includes, is of no use to the child."""
    own_template(case, LAW, "base.in.j2")
    own_template(case, in_block('# of the base\n{% include "more.j2" %}'))
    own_template(case, "# more\n", "more.j2")
    child = project.studies / "child/study.yaml"
    child.parent.mkdir()
    child.write_text("extends: small\n")
    (extending,) = project.cases("child")
    texts = [deck_text(process_scene(extending, BED), project.templates_of(extending))]
    own_template(extending, in_block("# of the child"))
    texts += [deck_text(process_scene(extending, BED), project.templates_of(extending))]
    for text, said in zip(texts, ("# of the base\n# more", "# of the child"), strict=True):
        assert "model hooke tangential history" in text
        assert [name for name in ("# of the base\n# more", "# of the child") if name in text] == [
            said
        ]
