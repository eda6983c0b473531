"""Hostile templates: a template is data, not a program."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from attack.calls import REFUSED
from attack.case import Attack, Got
from attack.ground import STUDY, new_project, tiny_study, write_study
from attack.studies import WARNED, checked

_BASE = '{% extends "base/process.in.j2" %}\n'


def _in_extra(text: str) -> str:
    return f"{_BASE}{{% block extra %}}\n{text}\n{{% endblock %}}\n"


_POPEN = ".os.popen('touch pwned').read()"
_EXPRESSIONS = {
    "the class of the deck": "{{ deck.__class__ }}",
    "all classes": "{{ ''.__class__.__mro__[1].__subclasses__() }}",
    "the globals of a function": "{{ deck.__init__.__globals__ }}",
    "a shell by cycler": "{{ cycler.__init__.__globals__" + _POPEN + " }}",
    "a shell by lipsum": "{{ lipsum.__globals__" + _POPEN + " }}",
    "a shell by joiner": "{{ joiner.__init__.__globals__" + _POPEN + " }}",
    "a shell by namespace": "{{ namespace.__init__.__globals__" + _POPEN + " }}",
    "a shell by self": "{{ self.__init__.__globals__.__builtins__.__import__('os')"
    ".popen('touch pwned').read() }}",
    "a shell by attr": "{{ (cycler|attr('__init__')|attr('__globals__'))['os']"
    ".popen('touch pwned').read() }}",
    "a class by format": "{{ '{0.__class__.__mro__}'.format(deck) }}",
    "a class by format_map": "{{ '{a.__class__}'.format_map({'a': deck}) }}",
    "a class by map": "{{ [deck]|map(attribute='__class__')|list }}",
    "a file by the deck's path": "{{ deck.__module__ }}",
    "a name that is unknown": "{{ deck.speeed }}",
    "a filter that is unknown": "{{ 1|speeed }}",
    "a test that is unknown": "{{ 1 is speeed }}",
    "a division by zero": "{{ 1 / 0 }}",
    "an index beyond": "{{ deck.outputs[99].name }}",
    "text as number": "{{ 'a'|num }}",
    "a sum of text and number": "{{ 'a' + 1 }}",
    "a loop of 1e10": "{% for i in range(10000000000) %}{% endfor %}",
    "a loop of loops": "{% for i in range(90000) %}{% for j in range(90000) %}{% endfor %}"
    "{% endfor %}",
    "text of 1e11 letters": "{{ 'a' * 100000000000 }}",
    "text that doubles": "{% set n = namespace(x='aaaaaaaaaa') %}{% for i in range(40) %}"
    "{% set n.x = n.x ~ n.x %}{% endfor %}{{ n.x }}",
    "a number of 1e10 digits": "{{ 10 ** (10 ** 10) }}",
    "padding of 1e11": "{{ 'a'.rjust(100000000000) }}",
    "lorem ipsum for ever": "{{ lipsum(n=100000000) }}",
    "a macro that calls itself": "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}",
    "it includes itself": '{% include "process.in.j2" %}',
    "it includes a study": '{% include "../study.yaml" %}',
    "it includes the password file": '{% include "/etc/passwd" %}',
    "it imports what is missing": '{% import "missing.j2" as m %}',
    "a block without an end": "{% if true %}",
    "a tag that is unknown": "{% do deck.title %}",
    "it changes the deck": "{% set deck.title = 'b' %}",
    "it clears the outputs": "{{ deck.outputs.clear() }}",
    "deeply nested brackets": "{{ " + "(" * 3000 + "1" + ")" * 3000 + " }}",
    "deeply nested tags": "{% if true %}" * 2000 + "{% endif %}" * 2000,
}

_NAMED = {"it includes a study": r"study\.yaml", "it includes the password file": "passwd"}

_FILES: dict[str, tuple[str, str | bytes, tuple[str, ...]]] = {
    "it extends itself": (
        "process.in.j2",
        '{% extends "process.in.j2" %}',
        (r"process\.in\.j2",),
    ),
    "two extend each other": (
        "process.in.j2",
        '{% extends "filling.in.j2" %}',
        (r"(process|filling)\.in\.j2",),
    ),
    "a misspelt block": (
        "process.in.j2",
        _BASE + "{% block extras %}\nprint 1\n{% endblock %}\n",
        ("extras",),
    ),
    "a block twice": (
        "process.in.j2",
        _BASE + "{% block extra %}{% endblock %}{% block extra %}{% endblock %}",
        ("extra",),
    ),
    "a macro in place of another": (
        "walls.j2",
        '{% extends "base/walls.j2" %}{% macro bowl(script) %}{% endmacro %}',
        ("walls.j2.*bowl",),
    ),
    "text outside of the blocks": ("process.in.j2", _BASE + "run 1\n", ("outside of the blocks",)),
    "a block that no script contains": (
        "base.in.j2",
        '{% extends "base/base.in.j2" %}{% block run %}{% endblock %}',
        ("changes no input script",),
    ),
    "no outputs": (
        "process.in.j2",
        _BASE + "{% block outputs %}{% endblock %}",
        ("would not write the output files",),
    ),
    "an endless loop": (
        "process.in.j2",
        _in_extra("label again\njump SELF again"),
        ("run for ever",),
    ),
    "a file of no scene": ("proces.in.j2", _BASE, (r"proces\.in\.j2",)),
    "a file in capitals": ("Process.in.j2", _BASE, (r"Process\.in\.j2",)),
    "an empty one": ("process.in.j2", "", (r"process\.in\.j2|DRAGDECK END",)),
    "one without its end": ("process.in.j2", "run 1\n", (r"process\.in\.j2|DRAGDECK END",)),
    "random bytes": ("process.in.j2", bytes(range(256)) * 9, (r"process\.in\.j2",)),
    "UTF-16": ("process.in.j2", _BASE.encode("utf-16"), (r"process\.in\.j2",)),
    "a NUL": ("process.in.j2", _in_extra("a\x00b"), (r"process\.in\.j2",)),
}


def template_attacks(seed: int) -> Iterator[Attack]:
    """Every hostile template; the seed changes nothing."""
    for what, text in _EXPRESSIONS.items():
        named = _NAMED.get(what, r"\.j2")
        act = partial(_template, "process.in.j2", _in_extra(text), (named,))
        yield Attack("template", what, act, (REFUSED,), 1.5)
    for what, (name, content, named) in _FILES.items():
        act = partial(_template, name, content, named)
        unused = what.startswith("a file")
        yield Attack("template", what, act, (REFUSED, WARNED) if unused else (REFUSED,), 1.5)
    for what, target in (("a symlink to itself", "process.in.j2"), ("a symlink to nothing", "no")):
        act = partial(_linked, target)
        yield Attack("template", what, act, (REFUSED, WARNED), 1.5)
    yield Attack("template", "a folder in its place", _folder, (REFUSED, WARNED), 1.5)


def _place(folder: Path, name: str) -> tuple[Path, Path]:
    project = new_project(folder / "project")
    write_study(project, tiny_study())
    file = project / "studies" / STUDY / "templates" / name
    file.parent.mkdir()
    return project, file


def _template(name: str, content: str | bytes, named: tuple[str, ...], folder: Path) -> Got:
    project, file = _place(folder, name)
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    if name == "process.in.j2" and b"filling.in.j2" in file.read_bytes():
        (file.parent / "filling.in.j2").write_text('{% extends "process.in.j2" %}')
    return checked(project, named)


def _linked(target: str, folder: Path) -> Got:
    project, file = _place(folder, "process.in.j2")
    file.symlink_to(target)
    return checked(project, (r"process\.in\.j2",))


def _folder(folder: Path) -> Got:
    project, file = _place(folder, "process.in.j2")
    file.mkdir()
    return checked(project, (r"process\.in\.j2",))
