"""The templates of input scripts: what they may use, and whether a study's own fit the project's.

A template is data: it runs in Jinja's sandbox, and each value that it inserts passes `quoted`.
"""

import contextlib
import hashlib
import math
import re
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import jinja2
from jinja2 import nodes
from jinja2.exceptions import SecurityError
from jinja2.runtime import BlockReference, Context, Macro
from jinja2.sandbox import ImmutableSandboxedEnvironment, safe_range
from markupsafe import Markup

from dragdeck.errors import InputError, choices, together
from dragdeck.files import table_rows

_NOT_IN_A_VALUE = set("$&#\"'\\")
"""What LIGGGHTS reads as a variable, a continued line, a comment or a quotation."""

_TRUSTING = ("e", "escape", "forceescape", "random", "safe", "tojson", "urlize", "xmlattr")
"""Filters of Jinja that would pass text by `quoted`, or give another script each time."""

_SHIPPED = Path(__file__).parents[1] / "data" / "templates.csv"
"""Hash of the commands of each of the project's templates, as this version has them."""

_BASE = "base"
"""Prefix of the project's own templates, which a study's may replace."""

_FAILURES: Mapping[type[BaseException], tuple[str, str]] = {
    RecursionError: (
        "the template extends or calls itself endlessly",
        'extend "base/<name>" instead',
    ),
    MemoryError: ("the template requires more memory than there is", "make it smaller"),
    SecurityError: (
        "is not allowed: ",
        "docs/reference/templates.md lists what a template may use",
    ),
    jinja2.TemplateNotFound: ("no such template: ", "put it into templates/, or correct the name"),
    jinja2.TemplateSyntaxError: ("template syntax: ", "see docs/reference/templates.md"),
    jinja2.UndefinedError: ("a value is missing: ", "docs/reference/templates.md lists the values"),
    Exception: ("a value cannot be used: ", "docs/reference/templates.md lists the values"),
}
"""What a template may raise: the problem, which goes on with the exception if it ends with a space,
and the remedy."""


class _Sandbox(ImmutableSandboxedEnvironment):
    """Macros, blocks and ``range`` may be called, and nothing else."""

    intercepted_binops = frozenset(["**"])

    def is_safe_callable(self, obj: Any) -> bool:
        return isinstance(obj, Macro | BlockReference) or obj is safe_range

    def call_binop(self, context: Context, operator: str, left: Any, right: Any) -> Any:
        return math.pow(left, right)  # never a number of a million digits


def environment(project: Path, *studies: Path) -> jinja2.Environment:
    """The Jinja environment: a study's own templates first, then the project's.

    Parameters
    ----------
    project : Path
        The project's folder of templates. Its files are also known as
        ``base/<name>``, so that a study's template of the same name can extend
        the one it replaces.
    *studies : Path
        The folders of templates of the study and of those that it extends, nearest first; each file
        is taken from the first that has it. A folder need not exist.

    Raises
    ------
    InputError
        A template of a study is used by no input script, or overrides no block.
    """
    folders = [study for study in studies if study.is_dir()]
    loader = jinja2.ChoiceLoader(
        [
            jinja2.FileSystemLoader([*folders, str(project)]),
            jinja2.PrefixLoader({_BASE: jinja2.FileSystemLoader(str(project))}),
        ]
    )
    sandbox = _Sandbox(
        loader=loader,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=True,  # tells the text of templates from values; `quoted` does the rest
        finalize=_inserted,
    )
    for name in _TRUSTING:
        del sandbox.filters[name]
    sandbox.filters.update(num=exact_number, nums=exact_numbers, comment=comment)
    if folders:
        environment(project, *folders[1:])  # a file may be of use to the base alone
        with template_errors(folders[0]):
            _check_own(sandbox, folders[0], project)
    return sandbox


def exact_number(value: float) -> str:
    """A number that reads back exactly."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError(f"{value!r} is not a number")
    return repr(value if isinstance(value, int) else float(value))


def exact_numbers(values: Iterable[float]) -> str:
    """Numbers that read back exactly, with spaces between."""
    return " ".join(exact_number(value) for value in values)


def comment(text: str) -> str:
    """Free text as LIGGGHTS can have it in a comment: without the characters that it reads."""
    return "".join(char for char in text if char.isprintable() and char not in _NOT_IN_A_VALUE)


def quoted(value: object) -> Markup:
    """A value as it may stand in an input script.

    Raises
    ------
    ValueError
        A text has a character that LIGGGHTS would read as more than a part of a word.
    TypeError
        Neither text nor number.
    """
    if isinstance(value, Markup):
        return value  # the text of a template
    if not isinstance(value, str):
        return Markup(exact_number(value))  # type: ignore[arg-type]
    bad = {char for char in value if char in _NOT_IN_A_VALUE or not char.isprintable()}
    if bad:
        shown = " ".join(ascii(char) for char in sorted(bad))
        raise ValueError(f"{value[:80]!a} is not allowed in an input script: it contains {shown}")
    return Markup(value)


@jinja2.pass_context
def _inserted(context: Context, value: object) -> Markup:
    """`quoted`; with the context, Jinja leaves constants for it too."""
    return quoted(str(value) if isinstance(value, jinja2.Undefined) else value)


@contextlib.contextmanager
def template_errors(template: Path | str) -> Iterator[None]:
    """Turn what templates raise into an error with file and line.

    Parameters
    ----------
    template : Path or str
        The template, or folder of templates, that is named where the error does not say.

    Raises
    ------
    InputError
        Whatever went wrong in the template.
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        problem, remedy = next(
            texts for kind, texts in _FAILURES.items() if isinstance(error, kind)
        )
        file, line = _place(error, template)
        text = f"{problem}{error}" if problem.endswith(" ") else problem
        raise InputError(text, file=file, field=line, remedy=remedy) from None


def _place(error: Exception, template: Path | str) -> tuple[Path | str, str | None]:
    """File and line where an error arose, as far as it says."""
    if isinstance(error, jinja2.TemplateSyntaxError):
        return error.filename or template, f"line {error.lineno}"
    place: tuple[Path | str, str | None] = (template, None)
    for frame, line in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_filename.endswith(".j2"):
            place = (frame.f_code.co_filename, f"line {line}")
    return place


_REFERENCES = (nodes.Extends, nodes.FromImport, nodes.Import, nodes.Include)


def used(templates: jinja2.Environment, *names: str) -> list[str]:
    """Names of the templates that some templates are made of, themselves first.

    Raises
    ------
    InputError
        One of them names a template that there is not.
    """
    used_names = list(names)
    for current in used_names:
        for node in _parsed(templates, current).find_all(_REFERENCES):
            for name in _named(node):
                if not _is_there(templates, name):
                    problem, remedy = _FAILURES[jinja2.TemplateNotFound]
                    raise InputError(
                        f"{problem}{name!a}",
                        file=file_of(templates, current),
                        field=f"line {node.lineno}",
                        remedy=remedy,
                    )
                if name not in used_names:
                    used_names.append(name)
    return used_names


def _named(reference: nodes.Node) -> list[str]:
    """The templates that a node refers to, as far as they do not depend on values."""
    target = reference.template  # type: ignore[attr-defined]
    items = target.items if isinstance(target, nodes.Tuple | nodes.List) else [target]
    return [item.value for item in items if isinstance(item, nodes.Const)]


def _is_there(templates: jinja2.Environment, name: str) -> bool:
    try:
        file_of(templates, name)
    except jinja2.TemplateNotFound:
        return False
    return True


def replaced(templates: jinja2.Environment, name: str) -> bool:
    """Whether a study has its own file in place of a template of the project."""
    base = f"{_BASE}/{name}"
    return _is_there(templates, base) and file_of(templates, base) != file_of(templates, name)


def without(templates: jinja2.Environment, name: str | None = None) -> jinja2.Environment:
    """The same templates, but the project's in place of a study's own.

    Parameters
    ----------
    templates : Environment
    name : str, optional
        The only one to take from the project.
    """
    assert templates.loader is not None
    every = templates.loader

    def original(asked: str) -> tuple[str, str | None, Callable[[], bool] | None] | None:
        if name not in (None, asked) or not _is_there(templates, f"{_BASE}/{asked}"):
            return None
        return every.get_source(templates, f"{_BASE}/{asked}")

    return templates.overlay(loader=jinja2.ChoiceLoader([jinja2.FunctionLoader(original), every]))


def own_blocks(templates: jinja2.Environment, name: str) -> list[str]:
    """The blocks that a template overrides; none of one that replaces a whole file."""
    tree = _parsed(templates, name)
    blocks = tree.find_all(nodes.Block) if tree.find(nodes.Extends) else ()
    return list(dict.fromkeys(block.name for block in blocks))


def without_block(templates: jinja2.Environment, name: str, block: str) -> jinja2.Environment:
    """The same templates, but one of them does not override a block."""
    copy = templates.overlay()
    copy.get_template(name).blocks.pop(block)
    return copy


def edited(templates: jinja2.Environment, names: Iterable[str]) -> list[str]:
    """Those of the project's own templates that are not as they were shipped, remarks apart."""
    shipped = {row["template"]: row["commands"] for row in table_rows(_SHIPPED)}
    bases = dict.fromkeys(f"{_BASE}/{name.removeprefix(f'{_BASE}/')}" for name in names)
    files = {base: file_of(templates, base) for base in bases if _is_there(templates, base)}
    return [
        file.name
        for file in files.values()
        if shipped.get(file.name) != commands_digest(file.read_text(encoding="utf-8"))
    ]


def commands_digest(template: str) -> str:
    """Hash of a template without remarks and empty lines."""
    lines = re.sub(r"\{#.*?#\}", "", template, flags=re.DOTALL).splitlines()
    kept = [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:16]


def file_of(templates: jinja2.Environment, name: str) -> Path:
    """The file of a template."""
    assert templates.loader is not None
    _, file, _ = templates.loader.get_source(templates, name)
    return Path(str(file))


def _parsed(templates: jinja2.Environment, name: str) -> nodes.Template:
    assert templates.loader is not None
    file = name
    try:
        source, name_of_file, _ = templates.loader.get_source(templates, name)
        file = name_of_file or name
        return _tree(templates, source, name, name_of_file)
    except (RecursionError, UnicodeDecodeError) as error:
        problem = "not UTF-8 text" if isinstance(error, ValueError) else "nested too deeply"
        raise InputError(problem, file=file, remedy="see docs/reference/templates.md") from None


@lru_cache(maxsize=64)
def _tree(env: jinja2.Environment, source: str, name: str, file: str | None) -> nodes.Template:
    return env.parse(source, name, file)


def template_files(templates: jinja2.Environment, scene: str) -> list[Path]:
    """The template files that a scene's deck is made of, in no order that matters.

    Raises
    ------
    InputError
        One of them is missing or cannot be parsed.
    """
    with template_errors(f"{scene}.in.j2"):
        return sorted({file_of(templates, name) for name in used(templates, f"{scene}.in.j2")})


def _check_own(templates: jinja2.Environment, study: Path, project: Path) -> None:
    """Refuse files of a study that no input script uses, and blocks that override nothing."""
    files = {str(file.relative_to(study)) for file in study.rglob("[!.]*") if file.is_file()}
    known = {str(file.relative_to(project)) for file in project.rglob("*.j2")}
    reached = set(used(templates, *sorted(files & known)))
    problems = [
        InputError("no input script uses this file", file=study / name, limit=choices(name, known))
        for name in sorted(files - reached)
    ]
    for name in sorted(known):
        if (study / name).is_dir() or ((study / name).is_symlink() and not (study / name).exists()):
            problems.append(InputError("this is not a file", file=study / name))
    for name in sorted(files & reached):
        problems += _idle_parts(templates, name)
    if problems:
        raise together(problems)


def _idle_parts(templates: jinja2.Environment, name: str) -> Iterator[InputError]:
    """What an extending template has that no script contains, whatever the values."""
    tree, *others = (_parsed(templates, file) for file in used(templates, name))
    blocks = {block.name for other in others for block in other.find_all(nodes.Block)}
    macros = {macro.name for other in others for macro in other.find_all(nodes.Macro)}
    file, see = file_of(templates, name), "docs/reference/templates.md lists the blocks"
    for node in tree.body if tree.find(nodes.Extends) else ():
        line = f"line {node.lineno}"
        if isinstance(node, nodes.Block) and node.name not in blocks:
            problem = f"no template that it extends has a block {node.name!r}"
            yield InputError(problem, file=file, field=line, limit=choices(node.name, blocks))
        elif isinstance(node, nodes.Macro) and node.name in macros:
            problem = f"the macro {node.name!r} does not replace that of the extended template"
            remedy = f"override a block, or copy the whole file and change it; {see}"
            yield InputError(problem, file=file, field=line, remedy=remedy)
        elif not isinstance(node, nodes.Block | nodes.Macro) and _writes(node):
            problem = "text outside of the blocks of an extending template is not used"
            remedy = f"put it into a block; {see}"
            yield InputError(problem, file=file, field=line, remedy=remedy)


def _writes(node: nodes.Node) -> bool:
    """Whether a part of a template would be text of the script."""
    if isinstance(node, nodes.AssignBlock):
        return False
    parts = (node, *node.find_all((nodes.Output, nodes.Include)))
    return any(isinstance(part, nodes.Include) or _is_text(part) for part in parts)


def _is_text(part: nodes.Node) -> bool:
    return isinstance(part, nodes.Output) and any(
        not isinstance(node, nodes.TemplateData) or node.data.strip() for node in part.nodes
    )
