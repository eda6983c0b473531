"""The shape of every campaign, and the report that each ends with.

Trade-off, stability map, verification, validation, calibration, scalings and costs are campaigns:

1. **A design of runs**, in YAML: `dragdeck.sweep.design`.
2. **Runs.** Those of a study are jobs of their own (``workflow/rules/runs.smk``); many short ones
   are a batch (`dragdeck.engine.batch.Batch.each`), which the same command judges and reports on.
   One that fails is a finding.
3. **Measures:** a function that makes of a finished run one row, whose uncertain numbers are of
   type `dragchain.statistics.estimate.Estimate`.
4. **A judgement:** rows against a reference become a `Document`, whose verdicts come from whole
   intervals (`Estimate.agrees_with`, `Estimate.exceeds`).
5. **A report:** `write_report` writes document, tables and figures, and a page from one template
   that extends ``report/page.html.j2``, with the tables that the macro `listing` of
   ``report/macros.html.j2`` makes of rows and columns.

A campaign is one package with a module for each of its scenes, measures, judgement and figures,
a command that calls `write_report`, and a rule that calls the command.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from dragchain.figures.style import drawing, png
from dragchain.report.page import Filters, data_uri, render_page, write_bundle
from dragdeck.documents import Document


def write_report(
    out_dir: Path,
    template: str,
    *,
    draw: Callable[[], Mapping[str, Figure]],
    tables: Mapping[str, pd.DataFrame] | None = None,
    documents: Mapping[str, Document] | None = None,
    name: str = "report",
    package: str = "dragchain",
    filters: Filters | None = None,
    **content: object,
) -> None:
    """Write the report of a campaign.

    Parameters
    ----------
    out_dir : Path
        Gets the files of `dragchain.report.page.write_bundle`.
    template : str
        Of the page, see `dragchain.report.page.render_page`.
    draw : callable
        Makes the figures, by name.
    tables, documents : mapping, optional
        By name.
    name : str
        Of the page.
    package, filters
        See `dragchain.report.page.render_page`.
    **content
        What the page shows beside ``pictures``, the data URI of each figure by its name.
    """
    with drawing():
        drawn = {key: png(figure) for key, figure in draw().items()}
    uris = {key: data_uri(picture) for key, picture in drawn.items()}
    page = render_page(template, filters, package, pictures=uris, **content)
    files = {f"figures/{key}.png": picture for key, picture in drawn.items()}
    write_bundle(out_dir, tables=tables, files=files, documents=documents, pages={name: page})
