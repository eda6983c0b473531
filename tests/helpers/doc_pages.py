"""The pages of the documentation as the tests read them."""

import re
from collections.abc import Iterator
from pathlib import Path

from page_parts import pages
from paths import ROOT

HISTORY = {"CHANGELOG.md"}
"""Pages about earlier versions."""

PAGES = [page for page in pages() if page.name not in HISTORY]
FENCE = re.compile(r"^( *)(```+|:::+)(?P<info>[^\n`]*)\n(?P<body>.*?)^\1\2 *$", re.M | re.S)


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def fences(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of every code block."""
    for found in FENCE.finditer(page.read_text(encoding="utf-8")):
        yield found["info"].strip(), found["body"]


def template_examples() -> dict[str, str]:
    """The templates that the how-to on input scripts shows, by the name of their file."""
    shown = (
        text
        for language, text in fences(ROOT / "docs/howto/input_scripts.md")
        if language == "jinja"
    )
    return {
        found[1]: text for text in shown if (found := re.match(r'{% extends "base/(.+?)"', text))
    }
