"""A report's files: all are made before the first is written, and each appears only whole."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from dragchain.tables.parquet import write_parquet
from dragdeck.documents import Document
from dragdeck.files import write_bytes, write_text


def write_bundle(
    out_dir: Path,
    *,
    tables: Mapping[str, pd.DataFrame] | None = None,
    workbooks: Mapping[str, bytes] | None = None,
    figures: Mapping[str, bytes] | None = None,
    documents: Mapping[str, Document] | None = None,
    pages: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write a report.

    Parameters
    ----------
    out_dir : Path
        Made if need be.
    tables : mapping of str to DataFrame, optional
        Written as ``<name>.parquet`` and ``<name>.csv``.
    workbooks : mapping of str to bytes, optional
        Spreadsheets, written as ``<name>.xlsx``.
    figures : mapping of str to bytes, optional
        PNG pictures, written as ``figures/<name>.png``.
    documents : mapping of str to Document, optional
        Written as ``<name>.json``.
    pages : mapping of str to str, optional
        HTML, written as ``<name>.html``, after all that they show.

    Returns
    -------
    list of Path
        The files.
    """
    files = []
    for name, table in (tables or {}).items():
        write_parquet(table, out_dir / f"{name}.parquet")
        write_text(out_dir / f"{name}.csv", table.to_csv(index=False, lineterminator="\n"))
        files += [out_dir / f"{name}.parquet", out_dir / f"{name}.csv"]
    for name, book in (workbooks or {}).items():
        files.append(out_dir / f"{name}.xlsx")
        write_bytes(files[-1], book)
    for name, picture in (figures or {}).items():
        files.append(out_dir / "figures" / f"{name}.png")
        write_bytes(files[-1], picture)
    for name, document in (documents or {}).items():
        files.append(out_dir / f"{name}.json")
        document.write(files[-1])
    for name, page in (pages or {}).items():
        files.append(out_dir / f"{name}.html")
        write_text(files[-1], page)
    return files
