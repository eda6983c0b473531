"""Pages: each one HTML file that needs no other file and no network.

All pages extend ``page.html.j2``, which has the head, the style and the frame, and share the
macros of ``macros.html.j2`` and the filters of `dragchain.report.notation`.
"""

import base64
import io
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import jinja2
from PIL import Image

from dragchain.errors import TableError
from dragchain.report import notation

LARGE_PICTURE = 200_000
"""Bytes above which a page holds a picture as WebP; ``figures/`` keeps the PNG."""

NETWORK_PAGE = "network.html"
"""The interactive page on the contact network of a process run, in its folder."""

_HEADING = re.compile(r'<h2 id="([^"]+)">(.*?)</h2>')

Filters = Mapping[str, Callable[..., object]]


def render_page(
    template: str, filters: Filters | None = None, package: str = "dragchain", /, **content: object
) -> str:
    """A page as text.

    Parameters
    ----------
    template : str
        Path below this package or the given one, for example ``tradeoff/tradeoff.html.j2``.
    filters : mapping, optional
        Filters of this page alone, by name.
    package : str
        The package that the template is in.
    **content
        What the template shows. A name that it uses and that is not given is an error.
    """
    page = page_environment(filters, package).get_template(template).render(**content)
    return page.replace(" %", "\N{NO-BREAK SPACE}%")


def page_environment(
    filters: Filters | None = None, package: str = "dragchain"
) -> jinja2.Environment:
    """The environment of all pages, with further filters if need be."""
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader(name, "") for name in ("dragchain", package)]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    shared = (
        *("number", "measured", "fixed", "percent", "fraction", "interval"),
        *("with_interval", "mean_interval", "ends", "in_percent"),
    )
    environment.filters |= {name: getattr(notation, name) for name in shared}
    environment.filters |= {"slug": slug, "sections": sections, "cell": cell, **(filters or {})}
    return environment


@jinja2.pass_environment
def cell(environment: jinja2.Environment, row: object, key: str, form: str = "") -> object:
    """A value of a row by its dotted key, written by a filter: ``number``, ``measured:2``."""
    value = row
    for part in key.split("."):
        value = environment.getitem(value, part)
    name, _, digits = form.partition(":")
    return environment.filters[name](value, *map(int, digits.split())) if name else value


def slug(title: str) -> str:
    """A title as the name of an anchor: small letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def sections(body: str) -> list[tuple[str, str]]:
    """Return anchor and title, as HTML, of every section of a page's body."""
    return _HEADING.findall(body)


def data_uri(picture: bytes, kind: str = "png") -> str:
    """A picture as a data URI, a large PNG as the smaller WebP."""
    if kind == "png" and len(picture) > LARGE_PICTURE:
        small = io.BytesIO()
        with Image.open(io.BytesIO(picture)) as image:
            image.save(small, format="webp", quality=90)
        kind, picture = "webp", small.getvalue()
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode('ascii')}"


def file_uri(picture: Path) -> str | None:
    """A PNG or GIF file as a data URI, None if there is no such file.

    Raises
    ------
    TableError
        If it is damaged.
    """
    if not picture.is_file():
        return None
    try:
        return data_uri(picture.read_bytes(), picture.suffix.removeprefix("."))
    except (OSError, ValueError) as error:
        raise TableError(f"{picture} is damaged ({error}); draw the figures again") from error
