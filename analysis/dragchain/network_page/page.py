"""``network.html``: the contact network of a run in the browser."""

from importlib.resources import files
from pathlib import Path

from dragchain.network_page.packed import ROUNDING
from dragchain.network_page.scene import PageScene, page_scene
from dragchain.quantities.basis import changed_settings, effects
from dragchain.report.page import NETWORK_PAGE, page_environment
from dragchain.run.case import with_changes
from dragchain.tables.run_folder import Run
from dragdeck.errors import RejectedRunError
from dragdeck.files import write_text
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import changed_in_words, read_accepted


def write_page(run_dir: Path) -> str:
    """Write ``network.html`` into the folder of a process run; what to say at the end.

    The run needs its tables and chains. Without ``dragchain loading`` the page has no load map.

    Raises
    ------
    TableError
        If the run wrote no contact network, or a table is missing or damaged.
    SeriesError
        If the run is too short to have peaks.
    """
    run = Run.open(run_dir)
    page = page_html(with_changes(run_dir, run.case), page_scene(run), _rejection(run_dir))
    file = run_dir / NETWORK_PAGE
    write_text(file, page)
    return f"{len(page.encode()) / 1e6:.1f} MB: {file}"


def page_html(case: CaseOfRun, scene: PageScene, rejection: str) -> str:
    """The page as HTML.

    Parameters
    ----------
    case : CaseOfRun
    scene : PageScene
    rejection : str
        Why the run is no result; empty if it is one.
    """
    template = page_environment().get_template("network_page/network.html.j2")
    return template.render(
        case=case,
        head=scene.head,
        data=scene.columns.text(),
        rejection=rejection,
        settings=list(changed_settings(case.fidelity)),
        effects=effects(case.fidelity),
        changed=changed_in_words(case.changed_scripts),
        place_um=1e3 * scene.head["frames"]["step"] / 2,
        rounding=ROUNDING,
        script=_own("network.js"),
        style=_own("network.css"),
    )


def _own(name: str) -> str:
    """A file of this package."""
    return (files("dragchain.network_page") / name).read_text(encoding="utf-8")


def _rejection(run_dir: Path) -> str:
    try:
        read_accepted(run_dir)
    except RejectedRunError as error:
        return str(error)
    return ""
