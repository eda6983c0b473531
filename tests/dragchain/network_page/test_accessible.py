"""axe finds nothing on report, network page and networks: wide and narrow, light and dark."""

from pathlib import Path

import pytest
from browser import MISSING, Browser
from made_run import line
from network_run_files import accept, write_network_run
from paths import ROOT
from report_files import PICTURES, case_json, make_run, process_findings

from dragchain.network_page.page import write_page
from dragchain.report.page import render_page
from dragchain.report.study_report import write_study_report

AXE = ROOT / "web/node_modules/axe-core/axe.min.js"
ABSENT = [*MISSING, *([] if AXE.is_file() else ["what `./run web` installs"])]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(ABSENT), reason=f"not installed: {', '.join(ABSENT)}"),
]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    case = case_json("process", "run-1")
    run = make_run(folder / "results", case, process_findings(), PICTURES)
    write_study_report(folder, [run])  # removes pages of networks, so it comes first
    write_network_run(folder / "run", "mesh", motion=line(0.1, direction_deg=0.0))
    accept(folder / "run")
    write_page(folder / "run")
    (folder / "network.html").write_bytes((folder / "run/network.html").read_bytes())
    page = render_page("compare/networks.html.j2", shown=[("network.html", "one")])
    (folder / "networks.html").write_text(page, encoding="utf-8")
    return folder


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1366, 390])
@pytest.mark.parametrize("name", ["report", "network", "networks"])
def test_axe_finds_nothing(
    window: Browser, pages: Path, name: str, width: int, scheme: str
) -> None:
    command = window.driver.execute_cdp_cmd
    size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 600}
    command("Emulation.setDeviceMetricsOverride", size)
    feature = {"name": "prefers-color-scheme", "value": scheme}
    command("Emulation.setEmulatedMedia", {"features": [feature]})
    if name == "network":
        window.open(pages / "network.html")
    else:
        window.driver.get((pages / f"{name}.html").as_uri())
    window.run(AXE.read_text(encoding="utf-8"))
    violations = window.driver.execute_async_script(
        "const done = arguments[0]; axe.run(document, {iframes: false}).then(({violations}) => "
        "done(violations.map(rule => [rule.id, rule.nodes.map(node => node.html)])))"
    )
    assert violations == []
    assert window.run("return document.documentElement.scrollWidth") <= width
