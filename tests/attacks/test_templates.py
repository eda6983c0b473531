"""Hostile templates: a template is data, not a program."""

from pathlib import Path

import pytest
from attack.checked import REFUSED, WARNED, checked
from attack.ground import STUDY, new_project, tiny_study, write_study

pytestmark = [pytest.mark.engine, pytest.mark.slow]

_BASE = '{% extends "base/process.in.j2" %}\n'


def _in_extra(text: str) -> str:
    return f"{_BASE}{{% block extra %}}\n{text}\n{{% endblock %}}\n"


_POPEN = ".os.popen('touch pwned').read()"
_EXPRESSIONS = {
    "the class of the deck": "{{ deck.__class__ }}",
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
    "a filter that is unknown": "{{ 1|speeed }}",
    "a test that is unknown": "{{ 1 is speeed }}",
    "an index beyond": "{{ deck.outputs[99].name }}",
    "a sum of text and number": "{{ 'a' + 1 }}",
    "lorem ipsum for ever": "{{ lipsum(n=100000000) }}",
    "a macro that calls itself": "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}",
    "it includes itself": '{% include "process.in.j2" %}',
    "it includes a study": '{% include "../study.yaml" %}',
    "it includes the password file": '{% include "/etc/passwd" %}',
    "it imports what is missing": '{% import "missing.j2" as m %}',
    "a tag that is unknown": "{% do deck.title %}",
    "it changes the deck": "{% set deck.title = 'b' %}",
    "deeply nested brackets": "{{ " + "(" * 3000 + "1" + ")" * 3000 + " }}",
    "deeply nested tags": "{% if true %}" * 2000 + "{% endif %}" * 2000,
}

_NAMED = {"it includes a study": r"study\.yaml", "it includes the password file": "passwd"}

_PROCESS = "process.in.j2"
_EITHER = r"process\.in\.j2|DRAGDECK END"
_FILES: dict[str, tuple[str, str | bytes, str]] = {
    "two extend each other": (_PROCESS, '{% extends "filling.in.j2" %}',
                              r"(process|filling)\.in\.j2"),
    "a block twice": (_PROCESS, _BASE + 2 * "{% block extra %}{% endblock %}", "extra"),
    "a file in capitals": ("Process.in.j2", _BASE, r"Process\.in\.j2"),
    "an empty one": (_PROCESS, "", _EITHER),
    "one without its end": (_PROCESS, "run 1\n", _EITHER),
    "random bytes": (_PROCESS, bytes(range(256)) * 9, r"process\.in\.j2"),
    "UTF-16": (_PROCESS, _BASE.encode("utf-16"), r"process\.in\.j2"),
    "a NUL": (_PROCESS, _in_extra("a\x00b"), r"process\.in\.j2"),
}  # fmt: skip
Template = tuple[str, str | bytes | Path | None, str]
"""A file's name, its content, or where it links to, or None for a folder, and what is named."""

_TEMPLATES: dict[str, Template] = {
    **{what: (_PROCESS, _in_extra(text), _NAMED.get(what, r"\.j2"))
       for what, text in _EXPRESSIONS.items()},
    **{what: (name, content, named) for what, (name, content, named) in _FILES.items()},
    "a symlink to itself": (_PROCESS, Path(_PROCESS), r"process\.in\.j2"),
    "a symlink to nothing": (_PROCESS, Path("no"), r"process\.in\.j2"),
    "a folder in its place": (_PROCESS, None, r"process\.in\.j2"),
}  # fmt: skip


@pytest.mark.attack(sample=2)
@pytest.mark.parametrize("attack", _TEMPLATES.values(), ids=_TEMPLATES)
def test_a_hostile_template_is_refused(attack: Template, tmp_path: Path) -> None:
    name, content, named = attack
    project = new_project(tmp_path / "project")
    write_study(project, tiny_study())
    file = project / "studies" / STUDY / "templates" / name
    file.parent.mkdir()
    if content is None:
        file.mkdir()
    elif isinstance(content, Path):
        file.symlink_to(content)
    else:
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        if name == _PROCESS and b"filling.in.j2" in file.read_bytes():
            (file.parent / "filling.in.j2").write_text('{% extends "process.in.j2" %}')
    warning_will_do = name == "Process.in.j2" or content is None or isinstance(content, Path)
    assert checked(project, (named,)) in ((REFUSED, WARNED) if warning_will_do else (REFUSED,))
