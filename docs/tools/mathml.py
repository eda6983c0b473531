"""Equations as MathML, which browsers show without scripts or network: an extension of Sphinx."""

import re
import unicodedata
from html import unescape
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

_BOLD = re.compile(r'<mi mathvariant="(bold|bold-italic)">([^<]+)</mi>')


def mathml(latex: str, display: str = "inline") -> str:
    """An equation as MathML whose vectors are bold characters.

    The attribute of the converter for bold letters is not part of MathML Core: browsers ignore it.
    """
    return _BOLD.sub(_bold, convert(latex, display=display))


def _bold(letter: re.Match[str]) -> str:
    style, character = letter.group(1).replace("-", " "), unescape(letter.group(2))
    _, case, _, name = unicodedata.name(character).split(maxsplit=3)
    return f"<mi>{unicodedata.lookup(f'MATHEMATICAL {style} {case} {name}')}</mi>"


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    text = node.astext().replace(r"\begin{split}", "").replace(r"\end{split}", "")
    translator.body.append(f'<div class="math">{mathml(text, "block")}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Enter it; without it, equations would need a script from another server."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
