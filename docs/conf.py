"""Settings of Sphinx for the documentation: ./run docs."""

import re
import sys
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

sys.path[:0] = [str(Path(__file__).with_name("tools")), str(Path(__file__).parents[1])]

from figures import FIGURES, svg  # noqa: E402

project = "dragdeck"
author = "The developers of dragdeck"
project_copyright = f"2026, {author}"
release = version = version_of("dragdeck")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_copybutton",
    "mathml",
    "notebook_pages",
]
html_math_renderer = "mathml"
smartquotes_action = "qe"  # no dashes: options begin with two hyphens
exclude_patterns = ["tools", "data"]
nitpicky = False

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "amsmath"]
myst_heading_anchors = 4
numpydoc_show_class_members = False
autodoc_typehints = "none"
copybutton_prompt_text = r"\$ "

html_theme = "pydata_sphinx_theme"
html_title = "dragdeck"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navigation_with_keys": False,
    "navbar_persistent": ["search-button"],  # its name is what it shows
    "show_nav_level": 1,
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
}

_TOGETHER = re.compile(
    r"(?<=\d) (?=%|(?:[kmµ]?[msNJ]|[kMG]?B|[GMk]?Pa|Hz|kg)\b)|(?<=E) (?=\u00d7)|(?<=\u00d7) (?=\d)"
)


def _keep_together(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """No line ends between a number and its unit."""
    for text in list(doctree.findall(nodes.Text)):
        if not isinstance(text.parent, nodes.FixedTextElement | nodes.literal):
            text.parent.replace(text, nodes.Text(_TOGETHER.sub("\u00a0", text)))


_FIGURE = re.compile(r'<img [^>]*src="([^"]*_images/\w+)\.svg"[^>]*>')


def _for_phones(app: Sphinx, page: str, template: str, context: dict[str, Any], _: object) -> None:
    """Name the narrow figure beside each figure."""
    source = r'<picture><source media="(max-width: 760px)" srcset="\1-narrow.svg">\g<0></picture>'
    if "body" in context:
        context["body"] = _FIGURE.sub(source, context["body"])


def _draw_narrow(app: Sphinx, error: Exception | None) -> None:
    """Draw the figures again for phones."""
    if error is None and app.builder.format == "html":
        for name in FIGURES:
            (app.outdir / f"_images/{name}-narrow.svg").write_text(svg(name, phone=True))


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("html-page-context", _for_phones)
    app.connect("build-finished", _draw_narrow)
    app.connect("doctree-resolved", _keep_together)
