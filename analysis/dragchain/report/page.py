"""Pages: each one HTML file that needs no other file and no network.

All pages extend ``page.html.j2``, which has the head, the style and the frame, and share the
macros of ``macros.html.j2`` and the filters below. A report is written as a bundle of files.
"""

import base64
import io
import math
import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

import jinja2
import pandas as pd
from PIL import Image

from dragchain.errors import TableError
from dragchain.statistics.estimate import Estimate
from dragchain.tables.parquet import write_parquet
from dragdeck.documents import Document
from dragdeck.files import write_bytes, write_text

DASH, MINUS, TIMES = "\N{EN DASH}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"
_GROUPS = "\N{NARROW NO-BREAK SPACE}"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: object, digits: int = 3) -> str:
    """A number with that many significant digits, a dash for none, text as it is."""
    if value is None:
        return DASH
    if isinstance(value, bool | str) or not isinstance(value, int | float):
        return str(value)
    if not math.isfinite(value):
        return DASH
    text = str(value) if isinstance(value, int) else f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e7:
        text = f"{value:.0f}"
    return _typeset(text)


def _typeset(text: str) -> str:
    """A number in Python's notation with a minus sign, groups of digits and a power of ten."""
    mantissa, _, power = text.partition("e")
    whole, point, part = mantissa.partition(".")
    if len(whole.lstrip("+-")) > 4:
        whole = f"{int(whole):,}".replace(",", _GROUPS)
    shown = f"{whole}{point}{part}".replace("-", MINUS)
    return f"{shown} {TIMES} 10{str(int(power)).translate(_RAISED)}" if power else shown


def measured(value: object, digits: int = 3) -> str:
    """A number as `number` does, with its zeros at the end."""
    if not isinstance(value, float) or value == 0.0 or not 1e-4 <= abs(value) < 10**digits:
        return number(value, digits)
    text = f"{value:#.{digits}g}".rstrip(".")
    return number(value, digits) if "e" in text else _typeset(text)


def fixed(value: float | None, decimals: int, sign: bool = False) -> str:
    """A number with that many decimals, a dash for none."""
    if value is None:
        return DASH
    return _typeset(f"{value:{'+' if sign else ''}.{decimals}f}")


def fraction(value: float | None) -> str:
    """A fraction of 1 as a signed percentage, a dash for none."""
    return DASH if value is None else f"{fixed(100 * value, 1, sign=True)} %"


def in_percent(value: float | None, digits: int = 3) -> str:
    """A fraction of 1 as a number of hundredths without its sign of percent, a dash for none."""
    return DASH if value is None else number(100 * value, digits)


def with_interval(estimate: Estimate | None, unit: str = "") -> str:
    """A value with its 95 % interval, all to the second digit of the half-width; else a dash."""
    if estimate is None:
        return DASH
    after = f" {unit}" if unit else ""
    if not estimate.known or estimate.ci95_high == estimate.ci95_low:
        return f"{measured(estimate.value)}{after}"
    (value, low, high), times = _alike(estimate)
    if times:
        return f"{value} ({low} to {high}){times}{after}"
    return f"{value}{after} ({low} to {high})"


def ends(estimate: Estimate) -> str:
    """The ends of a 95 % interval, to the second digit of its half-width."""
    if not estimate.known or estimate.ci95_high == estimate.ci95_low:
        return f"{measured(estimate.ci95_low)} to {measured(estimate.ci95_high)}"
    (_, low, high), times = _alike(estimate)
    return f"{low} to {high}{times}"


def _alike(estimate: Estimate) -> tuple[list[str], str]:
    """Value and ends with the same decimals, four digits at most, and their power of ten."""
    numbers = (estimate.value, estimate.ci95_low, estimate.ci95_high)
    power = math.floor(math.log10(max(map(abs, numbers))))
    shift = power if power < -3 else 0
    decimals = max(0, min(1 - math.floor(math.log10(estimate.half_width)), 3 - power) + shift)
    times = f" {TIMES} 10{str(shift).translate(_RAISED)}" if shift else ""
    return [fixed(value / 10.0**shift, decimals) for value in numbers], times


# --- pages ---------------------------------------------------------------------------------------


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
        *(number, measured, fixed, fraction, with_interval, ends),
        *(in_percent, heading_key, sections, cell),
    )
    environment.filters |= {call.__name__: call for call in shared} | dict(filters or {})
    return environment


@jinja2.pass_environment
def cell(environment: jinja2.Environment, row: object, key: str, form: str = "") -> object:
    """A value of a row by its dotted key, written by a filter: ``number``, ``measured:2``."""
    value = row
    for part in filter(None, key.split(".")):
        value = environment.getitem(value, int(part) if part.isdigit() else part)
    name, _, digits = form.partition(":")
    return environment.filters[name](value, *map(int, digits.split())) if name else value


def heading_key(title: str) -> str:
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


# --- files ---------------------------------------------------------------------------------------


def remove_earlier(folder: Path, *patterns: str, kept: Collection[Path | None] = ()) -> None:
    """Remove files of an earlier report that the next one does not always write."""
    earlier = {file.resolve() for pattern in patterns for file in folder.glob(pattern)}
    for file in earlier.difference(kept):
        file.unlink()


def write_bundle(
    out_dir: Path,
    *,
    tables: Mapping[str, pd.DataFrame] | None = None,
    files: Mapping[str, bytes] | None = None,
    documents: Mapping[str, Document] | None = None,
    pages: Mapping[str, str] | None = None,
) -> None:
    """Write a report.

    Parameters
    ----------
    out_dir : Path
        Made if need be.
    tables : mapping of str to DataFrame, optional
        Written as ``<name>.parquet`` and ``<name>.csv``.
    files : mapping of str to bytes, optional
        Figures and spreadsheets, by the names of their files.
    documents : mapping of str to Document, optional
        Written as ``<name>.json``.
    pages : mapping of str to str, optional
        HTML, written as ``<name>.html``, after all that they show.
    """
    for name, table in (tables or {}).items():
        write_parquet(table, out_dir / f"{name}.parquet")
        write_text(out_dir / f"{name}.csv", table.to_csv(index=False, lineterminator="\n"))
    for name, content in (files or {}).items():
        write_bytes(out_dir / name, content)
    for name, document in (documents or {}).items():
        document.write(out_dir / f"{name}.json")
    for name, page in (pages or {}).items():
        write_text(out_dir / f"{name}.html", page)
