"""network.html in a real browser: what it shows is what the tables say."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from browser import MISSING, Browser
from made_run import line
from network_run_files import PEAK_N, PEAKS_S, accept, write_network_run
from selenium.webdriver import Keys
from selenium.webdriver.support.ui import Select

from dragchain.network_page.page import write_page
from dragchain.report.page import MINUS, TIMES, render_page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]

MEDIA_RADIUS_MM = 3.0
HOSTILE = '</script><script>document.title="taken"</script>'


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workpiece from an STL file; the study has a hostile name."""
    folder = tmp_path_factory.mktemp("made") / "run"
    motion = line(0.1, start_m=[-0.01, 0.0], direction_deg=math.degrees(2.5))
    write_network_run(folder, "mesh", motion=motion, study_name=HOSTILE)
    accept(folder)
    write_page(folder)
    return folder


@pytest.fixture
def page(window: Browser, run: Path) -> Iterator[Browser]:
    """The page, opened anew; nothing may go wrong in its console."""
    yield window.open(run / "network.html")
    assert window.errors() == []


def rows(run: Path, name: str, step: int) -> pd.DataFrame:
    table = pd.read_parquet(run / f"tables/{name}.parquet")
    return table[table["step"] == step].reset_index(drop=True)


def step_at(page: Browser) -> int:
    """The step of the frame that is shown."""
    return int(page.run("return networkPage.head.steps[networkPage.number]"))


def chosen(page: Browser) -> dict[str, float]:
    """The table of what was chosen, the first number of each row."""
    lines = page.run("""return [...document.querySelectorAll("#chosen tr")]
        .map(row => [...row.cells].map(cell => cell.textContent))""")
    return {name: (numbers(value) or [np.nan])[0] for name, value in lines}


def numbers(text: str) -> list[float]:
    """The numbers of a text."""
    raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    text = text.replace(MINUS, "-").replace(f" {TIMES} 10", "e").translate(raised)
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text)]


def four_digits(value: object) -> object:
    return pytest.approx(value, rel=6e-4)


def choose(page: Browser, name: str, text: str) -> None:
    """Choose an option by what it says."""
    Select(page.find(f"#{name}")).select_by_visible_text(text)


def find(page: Browser, text: str) -> None:
    """Choose a particle or a contact by its numbers."""
    page.find("#find").clear()
    page.find("#find").send_keys(text + Keys.ENTER)


# --- peaks and time ------------------------------------------------------------------------------


@pytest.mark.parametrize("rank", [0, 1])
def test_a_peak_shows_its_force_and_the_strongest_chain(
    page: Browser, run: Path, rank: int
) -> None:
    page.click(f"#peaks li:nth-child({rank + 1}) button")
    chains = rows(run, "chains", step_at(page))
    path = chains[chains["dominant"]].iloc[0]
    said = page.text("#status")
    assert numbers(said)[3:5] == four_digits([PEAK_N[rank], PEAKS_S[rank]])
    assert numbers(said)[5:] == four_digits(
        [path["bottleneck_n"], path["mean_force_n"], path["n_particles"]]
    )
    assert said.endswith(f"to {path['end_kind']}.")
    assert page.run("return networkPage.contacts.halos.count") == path["n_particles"] + 1


# --- contacts and particles ----------------------------------------------------------------------


def test_a_click_on_a_particle_tells_its_numbers(page: Browser, run: Path) -> None:
    page.run("document.getElementById('size').value = 100; networkPage.redraw()")
    page.click("#presets [data-preset=above]")
    particles, contacts = (rows(run, name, step_at(page)) for name in ("particles", "contacts"))
    top = particles.loc[particles["z_m"].idxmax()]  # nothing hides it
    place = page.run("return networkPage.view.onCanvas(arguments[0])",
                     [1e3 * float(top[f"{axis}_m"]) for axis in "xyz"])  # fmt: skip
    page.click_at("#canvas", *place)
    assert page.text("#chosen h3") == f"Particle {top['particle_id']:.0f}"
    speed = 1e3 * float(np.linalg.norm(top[["vx_m_s", "vy_m_s", "vz_m_s"]].to_numpy(float)))
    forces = contacts["normal_force_n"][
        (contacts[["a_id", "b_id"]] == top["particle_id"]).any(axis=1)
    ]
    shown = chosen(page)
    assert shown["speed"] == four_digits(speed)
    assert shown["diameter"] == four_digits(2 * MEDIA_RADIUS_MM)
    assert shown["contacts"] == forces.size
    assert shown["largest normal force"] == four_digits(forces.max())


def test_a_click_on_a_contact_tells_its_forces(page: Browser, run: Path) -> None:
    page.run("document.getElementById('size').value = 0; document.getElementById('path').click();"
             "document.getElementById('load').value = 'hidden'; networkPage.redraw()")  # fmt: skip
    contacts = rows(run, "contacts", step_at(page))
    largest = contacts.loc[contacts["normal_force_n"].idxmax()]
    page.run("networkPage.setThreshold(arguments[0])", 0.99 * largest["normal_force_n"])
    assert page.text("#status").startswith("1 of ")
    place = page.run("""const [from, to] = networkPage.contacts.cylinders.at(0);
        return networkPage.view.onCanvas([0, 1, 2].map(k => (from[k] + to[k]) / 2))""")
    page.click_at("#canvas", *place)
    assert chosen(page)["normal force"] == four_digits(largest["normal_force_n"])
    assert str(largest["a_id"]) in page.text("#chosen h3").split()
    inner = contacts[contacts["b_id"] > 0].iloc[17]
    find(page, f"{inner['a_id']} {inner['b_id']}")
    assert chosen(page)["tangential force"] == four_digits(inner["tangential_force_n"])


def test_contacts_are_shown_by_force_class_and_chain(page: Browser, run: Path) -> None:
    def drawn() -> tuple[int, int, list[int]]:
        """Cylinders, halos, and counted contacts of each class."""
        cylinders, halos = page.run("const {cylinders, halos} = networkPage.contacts;"
                                    "return [cylinders.count, halos.count]")  # fmt: skip
        counts = [int(page.text(f"#count-{kind}")) for kind in range(3)]
        assert sum(counts) == cylinders
        return cylinders, halos, counts

    contacts, chains = (rows(run, name, step_at(page)) for name in ("contacts", "chains"))
    path = chains[chains["dominant"]]["n_particles"].iloc[0] + 1
    links = (chains[chains["definition"] == "peters"]["n_particles"] - 1).sum()
    choose(page, "others", "hidden")
    assert drawn()[:2] == (path, path)
    assert page.text("#status").startswith(
        f"{path} of {len(contacts)} contacts shown, those of chains only"
    )
    page.click("#path")
    page.click("#chains")
    assert drawn()[:2] == (links, links)
    page.click("#chains")
    choose(page, "others", "faded")
    page.run("document.getElementById('threshold').select()")
    page.find("#threshold").send_keys("0.25")
    b_id = contacts["b_id"][contacts["normal_force_n"] > 0.25]
    expected = [(b_id > 0).sum(), (b_id == 0).sum(), (b_id < 0).sum()]
    assert drawn() == (b_id.size, 0, expected)
    page.click("#class-0")
    assert drawn() == (sum(expected[1:]), 0, [0, *expected[1:]])


# --- beside other networks -----------------------------------------------------------------------


def test_networks_side_by_side_have_one_scale_unless_each_is_to_have_its_own(
    window: Browser, run: Path, tmp_path: Path
) -> None:
    """The second has half of the forces and three times the load and speed of the first."""
    text = (run / "network.html").read_text(encoding="utf-8")
    before, after = re.split(r"(?<=application/json\" id=\"head\">).*?(?=</script>)", text)
    head = json.loads(text[len(before) : -len(after)])
    factors = {"force": 0.5, "largest": 0.5, "speed": 3.0, "mean": 0.5}
    own = [head["scales"], {k: factors.get(k, 1.0) * v for k, v in head["scales"].items()}]
    loads = head["workpieces"][0]["loads"]
    tops = [{load["name"]: load["top"] for load in loads}]
    tops.append({name: 3.0 * top for name, top in tops[0].items()})
    for load in loads:
        load["top"] = tops[1][load["name"]]
    other = (
        f"{before}{json.dumps(head | {'scales': own[1]}).replace('<', chr(92) + 'u003c')}{after}"
    )
    (tmp_path / "network-1.html").write_text(text, encoding="utf-8")
    (tmp_path / "network-2.html").write_text(other, encoding="utf-8")
    shown = [("network-1.html", "one"), ("network-2.html", "other")]
    page = render_page("compare/networks.html.j2", shown=shown)
    (tmp_path / "networks.html").write_text(page, encoding="utf-8")
    window.driver.get((tmp_path / "networks.html").as_uri())

    def scales(number: int) -> dict[str, Any]:
        window.driver.switch_to.frame(number)
        window.wait(lambda: window.run("return document.documentElement.dataset.ready"), "a page")
        shown_now = window.run("return {...networkPage.head.scales, ...networkPage.tops}")
        shown_now["said"] = window.text("#legend")
        window.driver.switch_to.default_content()
        return dict(shown_now)

    def expected(number: int, common: bool) -> dict[str, float]:
        of_pages = [{**own[k], **tops[k]} for k in range(2)]
        if common:
            largest = {name: max(of[name] for of in of_pages) for name in of_pages[0]}
            return {**largest, "mean": own[number]["mean"]}
        return {**of_pages[number], "mean": own[number]["mean"]}

    for common in (True, False, True):
        for number in range(2):
            wanted = expected(number, common)
            window.wait(
                lambda number=number, wanted=wanted: wanted.items() <= scales(number).items(),  # type: ignore[misc]
                f"the scales of network {number + 1}, common: {common}",
            )
        said = [scales(number)["said"] for number in range(2)]
        assert (said[0] == said[1]) == common
        window.driver.find_element("id", "one-scale").click()
    assert window.errors() == []
