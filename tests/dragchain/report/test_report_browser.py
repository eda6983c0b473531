"""The report of a study in a real browser."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import MISSING, Browser
from report_files import PICTURES, case_json, make_run, process_findings

from dragchain.report.study_report import write_study_report

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]
pytest.importorskip("selenium")


@pytest.fixture
def window(tmp_path: Path) -> Iterator[Browser]:
    browser = Browser(tmp_path / "profile")
    yield browser
    browser.close()


def test_the_embedded_page_is_loaded_only_when_it_is_opened(
    window: Browser, tmp_path: Path
) -> None:
    run = make_run(
        tmp_path / "results", case_json("process", "workpiece-1"), process_findings(), PICTURES
    )
    (run / "network.html").write_text("<title>the scene</title>")
    write_study_report(tmp_path / "out", [run])
    page = (tmp_path / "out/network.html").as_uri()
    window.driver.get((tmp_path / "out/report.html").as_uri())

    def loaded() -> list[str]:
        return window.run("return [...document.querySelectorAll('iframe')].map(one => one.src)")

    assert loaded() == [""]
    window.click(".embedded summary")
    window.wait(lambda: loaded() == [page], "the page to be loaded")
    window.driver.switch_to.frame(window.find(".embedded iframe"))
    window.wait(lambda: window.run("return document.title") == "the scene", "the scene")
