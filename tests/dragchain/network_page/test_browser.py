"""network.html in a real browser: what it shows is what the tables say."""

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from browser import MISSING, NO_WEBGL, Browser
from figure_files import case_json
from matplotlib.colors import to_hex
from network_run_files import PEAK_N, PEAKS_S, accept, draw, write_network_run
from PIL import Image
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.support.ui import Select

from dragchain.figures.style import COLOURS
from dragchain.network_page.page import write_page
from dragchain.report.notation import MINUS, TIMES

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}"),
]

MEDIA_RADIUS_MM = 3.0
HOSTILE = '</script><script>document.title="taken"</script>'


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_network_run(tmp_path_factory.mktemp("made") / "run")
    accept(folder)
    draw(folder)
    write_page(folder)
    return folder


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    browser = Browser(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture
def page(window: Browser, run: Path) -> Iterator[Browser]:
    """The page, opened anew; nothing may go wrong in its console."""
    yield window.open(run / "network.html")
    assert window.errors() == []


class Clicks:
    """Counts the clicks of a task: it may take three."""

    def __init__(self, page: Browser) -> None:
        self.page, self.left = page, 3

    def click(self, selector: str) -> None:
        assert self.left > 0, "a task takes three clicks at most"
        self.left -= 1
        self.page.click(selector)


@pytest.fixture
def clicks(page: Browser) -> Clicks:
    return Clicks(page)


def rows(run: Path, name: str, step: int) -> pd.DataFrame:
    table = pd.read_parquet(run / f"tables/{name}.parquet")
    return table[table["step"] == step].reset_index(drop=True)


def step_at(page: Browser) -> int:
    """The step of the frame that is shown."""
    return int(page.run("return networkPage.head.steps[networkPage.number]"))


def shown(page: Browser) -> dict[str, str]:
    """The table of what was chosen."""
    lines = page.run("""return [...document.querySelectorAll("#chosen tr")]
        .map(row => [...row.cells].map(cell => cell.textContent))""")
    return dict(lines)


def number(text: str) -> float:
    """The first number of a text."""
    found = re.search(r"-?[\d.]+(e-?\d+)?", plain(text))
    assert found, text
    return float(found[0])


def plain(text: str) -> str:
    """A text whose numbers are written as Python does."""
    raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    return text.replace(MINUS, "-").replace(f" {TIMES} 10", "e").translate(raised)


def four_digits(value: float) -> object:
    return pytest.approx(value, rel=6e-4)


# --- the five tasks ------------------------------------------------------------------------------


def test_the_strongest_chain_at_the_highest_peak(clicks: Clicks, run: Path) -> None:
    page = clicks.page
    clicks.click("#peaks li:first-child button")
    chains = rows(run, "chains", step_at(page))
    dominant = chains[chains["dominant"]].iloc[0]
    said = re.search(r"bottleneck ([\d.]+) N, mean ([\d.]+) N, (\d+) particles, .* to (\w+)",
                     page.text("#status"))  # fmt: skip
    assert said is not None
    assert float(said[1]) == four_digits(dominant["bottleneck_n"])
    assert float(said[2]) == four_digits(dominant["mean_force_n"])
    assert (int(said[3]), said[4]) == (dominant["n_particles"], dominant["end_kind"])
    drawn = page.run("return networkPage.contacts.halos.count")
    assert drawn == dominant["n_particles"] + 1


def test_the_force_of_a_given_contact(clicks: Clicks, run: Path) -> None:
    page = clicks.page
    contacts = rows(run, "contacts", step_at(page))
    inner = contacts[contacts["b_id"] > 0].iloc[17]
    clicks.click("#find")
    page.find("#find").send_keys(f"{inner['a_id']} {inner['b_id']}")
    clicks.click("#find-button")
    found = shown(page)
    assert number(found["normal force"]) == four_digits(inner["normal_force_n"])
    assert number(found["tangential force"]) == four_digits(inner["tangential_force_n"])


def test_the_facet_with_the_highest_load(clicks: Clicks, run: Path) -> None:
    page = clicks.page
    clicks.click("#highest-facet")
    facets = pd.read_parquet(run / "tables/facets.parquet")
    highest = facets.loc[facets["force_slide_pa"].idxmax()]
    assert page.text("#chosen h3") == f"Facet {highest['facet_id']:.0f} of the workpiece"
    found = shown(page)
    assert number(found["sliding load"]) == four_digits(highest["force_slide_pa"])
    assert number(found["mean pressure"]) == four_digits(highest["mean_pressure_pa"])


def test_contacts_above_a_threshold_at_a_time(clicks: Clicks, run: Path) -> None:
    page = clicks.page
    clicks.click("#peaks li:nth-child(3) button")
    page.run("document.getElementById('threshold').select()")
    page.find("#threshold").send_keys("0.25")
    contacts = rows(run, "contacts", step_at(page))
    strong = contacts[contacts["normal_force_n"] > 0.25]
    assert page.text("#status").startswith(f"{len(strong)} of {len(contacts)} contacts shown")
    kinds = strong["kind"].value_counts()
    bowl = kinds.get("particle-floor", 0) + kinds.get("particle-side", 0)
    expected = [kinds["particle-particle"], kinds.get("particle-workpiece", 0), bowl]
    assert [int(page.text(f"#count-{kind}")) for kind in range(3)] == expected


def test_the_time_of_the_second_highest_peak(clicks: Clicks) -> None:
    page = clicks.page
    assert number(page.text("#peaks li:nth-child(2)")) == pytest.approx(PEAKS_S[1], abs=5e-4)
    clicks.click("#peaks li:nth-child(2) button")
    said = re.search(r"Drag force ([\d.]+) N at ([\d.]+) s", page.text("#status"))
    assert said is not None
    assert float(said[1]) == four_digits(PEAK_N[1])
    assert float(said[2]) == pytest.approx(PEAKS_S[1], abs=5e-4)


# --- time and curve ------------------------------------------------------------------------------


def test_it_plays_pauses_and_ends(page: Browser) -> None:
    def now() -> int:
        return int(page.run("return networkPage.number"))

    speed = "networkPage.player.speed = arguments[0]"
    page.run(f"networkPage.show(0); {speed}", 0.02)  # so slow that no machine comes to the end
    page.click("#play")
    assert page.text("#play") == "Pause"
    page.wait(lambda: now() > 0, "the second frame")
    page.click("#play")
    assert page.text("#play") == "Play"
    paused = now()
    page.run(
        f"{speed}; return new Promise(done => requestAnimationFrame("
        "() => requestAnimationFrame(done)))",
        1e6,
    )  # it would be at the end now
    assert now() == paused
    page.click("#play")
    page.wait(lambda: page.text("#play") == "Play", "the end")
    assert page.run("return networkPage.frames.count") == now() + 1
    page.click("#previous")
    assert page.run("return networkPage.frames.count") == now() + 2


def test_the_slider_moves_the_cursor_and_the_profiles(page: Browser) -> None:
    def cursor() -> float:
        return float(page.run("return document.querySelector('#curve .cursor').offsetLeft"))

    def profiles() -> list[list[float]]:
        return page.run("return networkPage.profiles.bars.map(({plot}) => [...plot.data[2]])")

    page.find("#time").send_keys(Keys.HOME)
    first = cursor(), profiles()
    page.find("#time").send_keys(Keys.END)
    assert cursor() > first[0] + 100
    assert all(one != other for one, other in zip(first[1], profiles(), strict=True))
    time_s = page.run("return networkPage.frames.times.at(-1)")
    assert number(page.text("#now")) == pytest.approx(time_s, abs=5e-4)
    assert f"at {time_s:.3f} s" in page.find("#profile-depth").get_attribute("aria-label")


def test_the_curve_is_read_zoomed_and_clicked(page: Browser, run: Path) -> None:
    def span() -> list[float]:
        return page.run("const {min, max} = networkPage.curve.plot.scales.x; return [min, max]")

    page.drag("#curve", (200, 60), (400, 60))
    page.wait(lambda: span()[1] < 0.3, "the part of the curve")
    assert span()[0] > 0.05
    said = re.fullmatch(r"([\d.]+) s: raw ([\d.]+) N, filtered ([\d.]+) N", page.text("#hovered"))
    assert said is not None
    force = pd.read_parquet(run / "tables/workpiece_force.parquet")
    near = force[(force["time_s"] - 0.1 - float(said[1])).abs() < 6e-4]
    assert any(float(said[2]) == four_digits(-drag) for drag in near["drag_n"])
    page.click("#whole")
    page.wait(lambda: span() == pytest.approx([0.001, 0.4], abs=1e-6), "the whole curve")
    page.run("networkPage.show(0); document.getElementById('path').click()")
    page.click("#curve .peak")
    network = pd.read_parquet(run / "tables/network.parquet")
    since = network["time_s"] - 0.1
    assert step_at(page) == network["step"][np.abs(since - PEAKS_S[0]).argmin()]
    assert "Dominant path" in page.text("#status")
    page.click_at("#curve .u-over", 1, 60)
    assert page.run("return networkPage.number") == 0


# --- the scene -----------------------------------------------------------------------------------


def test_a_click_on_a_particle_tells_its_numbers(page: Browser, run: Path) -> None:
    """Some particle that nothing hides is clicked; what is told is of the one that was hit."""
    page.run("document.getElementById('size').value = 100; networkPage.redraw()")
    page.click("#presets [data-preset=above]")
    particles = rows(run, "particles", step_at(page))
    top = particles.loc[particles["z_m"].idxmax()]
    place = page.run("return networkPage.view.onCanvas(arguments[0])",
                     [1e3 * float(top[f"{axis}_m"]) for axis in "xyz"])  # fmt: skip
    page.click_at("#canvas", *place)
    assert page.text("#chosen h3") == f"Particle {top['particle_id']:.0f}"
    found = shown(page)
    speed = 1e3 * float(np.linalg.norm(top[["vx_m_s", "vy_m_s", "vz_m_s"]].to_numpy(float)))
    assert number(found["speed"]) == four_digits(speed)
    assert number(found["diameter"]) == four_digits(2 * MEDIA_RADIUS_MM)
    contacts = rows(run, "contacts", step_at(page))
    touching = (contacts[["a_id", "b_id"]] == top["particle_id"]).any(axis=1)
    assert int(found["contacts"]) == touching.sum()
    largest = contacts["normal_force_n"][touching].max()
    assert number(found["largest normal force"]) == four_digits(largest)


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
    assert number(shown(page)["normal force"]) == four_digits(largest["normal_force_n"])
    assert str(largest["a_id"]) in page.text("#chosen h3").split()


def test_classes_and_chains_are_chosen(page: Browser, run: Path) -> None:
    def drawn() -> tuple[int, int, int]:
        """Cylinders, halos, counted contacts."""
        counted = sum(int(page.text(f"#count-{kind}")) for kind in range(3))
        cylinders, halos = page.run("const {rows, halos} = networkPage.contacts;"
                                    "return [rows.length, halos.count]")  # fmt: skip
        return cylinders, halos, counted

    contacts, chains = (rows(run, name, step_at(page)) for name in ("contacts", "chains"))
    path = chains[chains["dominant"]]["n_particles"].iloc[0] + 1
    assert drawn() == (len(contacts), path, len(contacts))
    choose(page, "others", "hidden")
    assert drawn() == (path, path, path)
    assert page.text("#status").startswith(
        f"{path} of {len(contacts)} contacts shown, those of chains only"
    )
    page.click("#path")
    page.click("#chains")
    links = (chains[chains["definition"] == "peters"]["n_particles"] - 1).sum()
    assert drawn() == (links, links, links)
    page.click("#chains")
    choose(page, "others", "faded")
    page.click("#class-0")
    page.click("#class-2")
    on_workpiece = (contacts["b_id"] == 0).sum()
    assert drawn() == (on_workpiece, 0, on_workpiece)
    page.run("networkPage.setThreshold(1e6)")
    page.click("#path")
    assert drawn() == (path, path, path)
    assert "N, or on the dominant path." in page.text("#status")


def test_a_section_plane_hides_what_is_beyond_it(page: Browser, run: Path) -> None:
    choose(page, "section-axis", "y")
    at = page.run("""const slider = document.getElementById("section-at");
        slider.value = 0.4 * slider.min + 0.6 * slider.max;
        slider.dispatchEvent(new Event("input"));
        return Number(slider.value)""")
    assert page.text("#section-shown") == f"{at:.1f} mm".replace("-", MINUS)
    particles, contacts = (rows(run, name, step_at(page)) for name in ("particles", "contacts"))
    beyond = 1e3 * particles["y_m"] > at
    for _ in range(2):
        larger = page.find("#section-side").is_selected()
        kept = set(particles["particle_id"][beyond == larger])
        assert 0 < len(kept) < len(particles)
        ids = page.run("const {media, frames, number} = networkPage;"
                       "return media.rows.map(row => frames.at(number).id[row])")  # fmt: skip
        assert set(ids) == kept
        other = contacts["b_id"].isin(kept) | (contacts["b_id"] <= 0)
        inside = (contacts["a_id"].isin(kept) & other).sum()
        assert page.text("#status").startswith(f"{inside} of {len(contacts)} contacts shown")
        page.click("#section-side")


def choose(page: Browser, name: str, text: str) -> None:
    """Choose an option by what it says."""
    Select(page.find(f"#{name}")).select_by_visible_text(text)


def test_distances_are_measured_over_time(page: Browser, run: Path) -> None:
    def measure(text: str) -> None:
        page.find("#find").clear()
        page.find("#find").send_keys(text + Keys.ENTER)

    def places() -> pd.DataFrame:
        table = rows(run, "particles", step_at(page)).set_index("particle_id")
        return 1e3 * table[["x_m", "y_m", "z_m"]]

    page.find("#measure").send_keys(Keys.SPACE)
    assert page.text("#distance") == "Distance: choose two particles or contacts"
    measure("3")
    measure("200")
    for frame in (7, 2):
        page.run("networkPage.go(arguments[0])", frame)
        apart = float(np.linalg.norm(places().loc[3] - places().loc[200]))
        assert number(page.text("#distance")) == pytest.approx(apart, abs=0.01)
    contacts = rows(run, "contacts", step_at(page))
    outer = contacts[contacts["b_id"] == 0].iloc[0]
    inner = contacts[contacts["b_id"] > 0].iloc[5]
    between = places().loc[[inner["a_id"], inner["b_id"]]].mean().to_numpy(float)  # of equal radii
    point = 1e3 * outer[["point_x_m", "point_y_m", "point_z_m"]].to_numpy(float)
    measure(f"{outer['a_id']} workpiece")
    measure(f"{inner['a_id']} {inner['b_id']}")
    apart = float(np.linalg.norm(between - point))
    assert number(page.text("#distance")) == pytest.approx(apart, abs=0.01)
    measure("99999")
    assert page.text("#distance") == "Distance: not in this frame"


def test_what_the_figures_show_too_has_their_colour(page: Browser) -> None:
    drawn = {"peak": ".peak", "transient": ".transient", "chain": ".check .chain",
             "drag": ".check .smooth", "dominant_path": ".check .path"}  # fmt: skip
    look = """const {borderTopColor, borderTopWidth, backgroundColor} =
        getComputedStyle(document.querySelector(arguments[0]));
        return parseFloat(borderTopWidth) ? borderTopColor : backgroundColor"""
    for name, place in drawn.items():
        channels = map(int, re.findall(r"\d+", page.run(look, place)))
        assert "#{:02x}{:02x}{:02x}".format(*channels) == COLOURS[name].lower(), name
    assert page.run("return networkPage.curve.plot.series[2].stroke()") == COLOURS["drag"]
    page.run("document.getElementById('load').value = 'plain'; networkPage.redraw()")
    tint = page.run("return [...networkPage.workpiece.tints.slice(0, 3)]")
    assert to_hex(tint) == COLOURS["workpiece"]


def test_every_colour_has_a_legend_and_a_picture(page: Browser) -> None:
    page.run("document.getElementById('size').value = 60; networkPage.redraw()")
    pictures = set()
    for colour, title in {"normal force": "Normal force", "class of contact": "Class of a contact",
                          "speed": "Speed", "displacement": "Displacement"}.items():  # fmt: skip
        choose(page, "colour", colour)
        assert title in page.text("#legend")
        pictures.add(page.run(
            "networkPage.view.draw(1); return networkPage.view.renderer.domElement.toDataURL()"
        ))  # fmt: skip
    assert len(pictures) == 4


def test_views_and_keys_turn_the_camera(page: Browser) -> None:
    def camera() -> list[float]:
        page.run("networkPage.view.draw()")
        return page.run("return networkPage.view.camera.matrixWorld.elements.slice(0, 11)")

    seen = []
    for name in ("above", "along", "side", "overview", "follow"):
        page.click(f"#presets [data-preset={name}]")
        assert page.find(f"[data-preset={name}]").get_attribute("aria-pressed") == "true"
        seen.append(camera())
    assert np.unique(np.round(seen, 6), axis=0).shape[0] == 5
    page.find("#canvas").send_keys(Keys.ARROW_LEFT)
    assert camera() != seen[-1]
    now = page.run("return networkPage.number")
    page.find("#canvas").send_keys(",")
    assert page.run("return networkPage.number") == now - 1
    target, (x, y) = page.run("""const {view, workpiece, number} = networkPage;
        const {x, y} = workpiece.pose(number); return [view.controls.target.toArray(), [x, y]]""")
    assert target[:2] == pytest.approx([x, y])  # it follows


def test_a_phone_shows_all_of_the_page(window: Browser, run: Path) -> None:
    try:
        window.phone()
        window.open(run / "network.html")
        assert window.run("return document.documentElement.scrollWidth") == 390
        beyond = window.run("""return [...document.querySelectorAll("main *")]
            .filter(one => one.getBoundingClientRect().right > 390.5).map(one => one.outerHTML)""")
        assert beyond == []
        assert window.find("#time").size["width"] > 300
        heights = window.run("return [...document.querySelectorAll('.transport button')]"
                             ".map(one => one.offsetHeight)")  # fmt: skip
        assert min(heights) > 30
        top, bottom, below = window.run("""
            const at = name => document.getElementById(name).getBoundingClientRect();
            document.getElementById("section-axis").scrollIntoView({block: "center"});
            return [at("canvas").top, at("canvas").bottom, at("section-axis").top]""")
        assert 0 <= top < bottom < below < 844
    finally:
        window.desktop()
    assert window.errors() == []


def test_all_controls_have_names(page: Browser) -> None:
    nameless = page.run("""
        const controls = "input, select, button, #canvas, [role=img], [role=slider]";
        const named = one => one.getAttribute("aria-label") || one.textContent.trim();
        return [...document.querySelectorAll(controls)]
            .filter(one => !one.labels?.length && !named(one)).map(one => one.outerHTML)
    """)
    assert nameless == []


# --- saving --------------------------------------------------------------------------------------


def test_a_saved_picture_is_the_view_at_twice_its_size(page: Browser, tmp_path: Path) -> None:
    size = page.run("const {clientWidth, clientHeight} = document.getElementById('canvas');"
                    "return [clientWidth, clientHeight]")  # fmt: skip
    box = page.run("""
        const at = selector => document.querySelector(selector).getBoundingClientRect();
        const from = at("#canvas"), box = ({left, top, right, bottom}) =>
            [left - from.left, top - from.top, right - from.left, bottom - from.top];
        return {bar: box(at("#legend .bar")), title: box(at("#legend div")),
            scale: box(at("#scale-bar")), time: box(at("#caption-time"))}""")  # fmt: skip
    time_s = page.run("return networkPage.frames.times[networkPage.number]")
    file = page.saved(tmp_path, "#save-picture")
    assert file.name == f"made-process_{time_s:.3f}s.png"
    with Image.open(file) as image:
        assert image.size == (2 * size[0], 2 * size[1])
        seen = np.asarray(image.convert("RGB")).astype(int)

    def part(name: str) -> np.ndarray:
        left, top, right, bottom = (round(2 * edge) for edge in box[name])
        return seen[top:bottom, left:right]

    height, width = seen.shape[:2]
    middle = seen[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
    assert len(np.unique(middle.reshape(-1, 3), axis=0)) > 100
    assert part("bar")[6, 6].sum() > part("bar")[6, -6].sum() + 300  # from light to dark
    assert part("title").min() < 100 and part("time").min() < 100  # letters
    dark = (part("scale").max(axis=2) < 100).mean(axis=1)
    assert dark[-2] == 1.0 and dark[2] < 0.2  # a line with two ticks


def test_a_film_shows_all_frames(page: Browser, tmp_path: Path) -> None:
    size = page.run("const {clientWidth, clientHeight} = document.getElementById('canvas');"
                    "return [clientWidth, clientHeight].map(one => one - one % 2)")  # fmt: skip
    file = page.saved(tmp_path, "#save-video")
    assert page.run("return networkPage.number + 1 === networkPage.frames.count")
    assert page.text("#save-video") == "Save video"
    seen, differ = page.run("""return new Promise((done, failed) => {
        const film = document.createElement("video"), pictures = [];
        const look = () => {
          const {videoWidth: width, videoHeight: height} = film;
          const context = Object.assign(document.createElement("canvas"), {width, height})
            .getContext("2d");
          context.drawImage(film, 0, 0);
          pictures.push(context.getImageData(0, 0, width, height).data);
        };
        film.onerror = () => failed(film.error.message);
        film.onloadeddata = () => { look(); film.currentTime = 1e6; };  // to the end
        film.onseeked = () => {
          look();
          const [first, last] = pictures;
          done([[film.videoWidth, film.videoHeight],
            first.filter((value, k) => Math.abs(value - last[k]) > 60).length]);
        };
        film.src = "data:video/webm;base64," + arguments[0];
    })""", base64.b64encode(file.read_bytes()).decode())  # fmt: skip
    assert seen == size
    assert differ > 100


# --- without a scene -----------------------------------------------------------------------------


def test_without_webgl_a_picture_stands_for_the_scene(run: Path, tmp_path: Path) -> None:
    page = Browser(tmp_path / "profile", NO_WEBGL)
    try:
        page.open(run / "network.html")
        assert "WebGL" in page.text("#problem")
        assert page.find("#static-scene img").is_displayed()
        assert not page.find("#canvas").is_displayed()
        assert not page.find("#static-curve").is_displayed()
        page.click("#peaks li:first-child button")
        assert page.run("return document.querySelector('#curve .cursor').offsetLeft") > 100
    finally:
        page.close()


@pytest.mark.parametrize(
    ("command", "static", "live"),
    [("setEmulatedMedia", {"media": "print"}, {"media": ""}),
     ("setScriptExecutionDisabled", {"value": True}, {"value": False})],
)  # fmt: skip
def test_printed_or_without_scripts_it_shows_static_pictures(
    window: Browser, run: Path, command: str, static: dict[str, object], live: dict[str, object]
) -> None:
    window.driver.execute_cdp_cmd(f"Emulation.{command}", static)
    window.driver.get((run / "network.html").resolve().as_uri())
    assert window.find("#static-scene img").is_displayed()
    assert window.find("#static-curve img").is_displayed()
    assert not window.find("#canvas").is_displayed()
    window.driver.execute_cdp_cmd(f"Emulation.{command}", live)


def test_data_that_are_damaged_are_told(window: Browser, run: Path, tmp_path: Path) -> None:
    text = (run / "network.html").read_text(encoding="utf-8")
    at = text.index('id="data">') + 2000
    broken = tmp_path / "broken.html"
    broken.write_text(text[:at] + text[at + 400 :], encoding="utf-8")
    window.open(broken)
    assert "could not be shown" in window.text("#problem")
    assert window.find("#static-scene img").is_displayed()
    window.errors()


# --- profiles ------------------------------------------------------------------------------------


def on_workpiece(run: Path, step: int) -> pd.DataFrame:
    """The contacts on the workpiece: azimuth in degrees, depth in mm."""
    contacts, force = rows(run, "contacts", step), rows(run, "workpiece_force", step).iloc[0]
    found = contacts[contacts["kind"] == "particle-workpiece"]
    x, y = found["point_x_m"] - force["ref_x_m"], found["point_y_m"] - force["ref_y_m"]
    azimuth = np.arctan2(y, x) - force["direction_rad"]
    surface_m = json.loads((run / "case.json").read_text())["surface_m"]
    return found.assign(azimuth=np.degrees(np.arctan2(np.sin(azimuth), np.cos(azimuth))),
                        depth=1e3 * (surface_m - found["point_z_m"]))  # fmt: skip


def told(page: Browser, plot: str) -> dict[tuple[float, float], list[float]]:
    """The values told for each bar of a profile, which the arrow keys choose, by its limits."""
    page.find(f"#profile-{plot}").send_keys(Keys.HOME)
    found = {}
    for _ in range(int(page.find(f"#profile-{plot}").get_attribute("aria-valuemax")) + 1):
        text = page.text("#profile-told")
        assert text == page.find(f"#profile-{plot}").get_attribute("aria-valuetext").replace(
            "\u202f", ""
        )
        low, high, *values = (float(one) for one in re.findall(r"-?[\d.]+(?:e-\d+)?", plain(text)))
        found[low, high] = values
        page.find(f"#profile-{plot}").send_keys(Keys.ARROW_RIGHT)
    return found


def test_profiles_are_those_of_the_tables(page: Browser, run: Path) -> None:
    page.run("networkPage.go(7)")
    contacts = on_workpiece(run, step_at(page))
    assert len(contacts) == 6
    force = contacts["normal_force_n"]
    steps = page.run("return networkPage.head.steps")
    every = pd.concat([on_workpiece(run, step) for step in steps])
    azimuth = told(page, "azimuth")
    assert next(iter(azimuth))[0] == -180 and len(azimuth) == 24
    for (low, high), (now, mean) in azimuth.items():
        inside, ever = (one["azimuth"].between(low, high) for one in (contacts, every))
        assert now == pytest.approx(force[inside].sum(), rel=1e-3)
        assert mean == pytest.approx(every["normal_force_n"][ever].sum() / len(steps), rel=1e-3)
    for (low, high), (now, _) in told(page, "depth").items():
        inside = (contacts["depth"] > low) & (contacts["depth"] <= high + 2e-3)
        assert now == pytest.approx(force[inside].sum() / (high - low), rel=1e-3)
    said = page.find("#profile-azimuth").get_attribute("aria-label")
    assert number(said.split(" s: ")[1]) == four_digits(force.sum())
    cells = page.run("return Array.from(networkPage.profiles.profiles.map.values)")
    assert sum(cells) == pytest.approx(every["normal_force_n"].sum() / len(steps), rel=1e-4)
    largest = page.find("#profile-map").get_attribute("aria-valuetext")
    assert float(largest.split("mean ")[1].split()[0]) == four_digits(max(cells))
    ActionChains(page.driver).move_to_element(page.find("#profile-map")).perform()
    assert re.fullmatch(r"azimuth .*°, depth .* mm: mean .* N", page.text("#profile-told"))


def test_azimuth_is_counted_from_the_motion_and_an_end_face_is_in_the_last_level(
    window: Browser, tmp_path: Path
) -> None:
    """Of a workpiece from an STL file, in a study with a hostile name."""
    motion = {"direction_rad": 2.5, "start_direction_rad": 2.5}
    folder = write_network_run(
        tmp_path / "run", "mesh", motion=case_json("process")["motion"] | motion, study=HOSTILE
    )
    file = folder / "tables/contacts.parquet"
    table = pd.read_parquet(file)
    table.loc[table["kind"] == "particle-workpiece", "point_z_m"] = 0.03 - 0.02
    table.to_parquet(file)
    write_page(folder)
    window.open(folder / "network.html")
    contacts = on_workpiece(folder, step_at(window))
    force = contacts["normal_force_n"]
    for (low, high), (now, _) in told(window, "azimuth").items():
        inside = contacts["azimuth"].between(low, high)
        assert now == pytest.approx(force[inside].sum(), rel=1e-3)
    levels = told(window, "depth")
    assert max(levels) == (18, 20)
    assert 2 * levels[18, 20][0] == pytest.approx(force.sum(), rel=1e-3)
    assert window.driver.title == f"{HOSTILE}: contact network"
    assert window.run("return networkPage.workpiece.group.visible")
    assert window.errors() == []


def test_the_distribution_counts_all_contacts(page: Browser, run: Path) -> None:
    force = rows(run, "contacts", step_at(page))["normal_force_n"]
    bars = told(page, "size")
    counts = {low: now for (low, _), (now, _) in bars.items()}
    assert (force >= min(counts)).sum() == pytest.approx(sum(counts.values()), abs=2)
    for low, high in list(bars)[::5]:
        assert abs(counts[low] - force.between(low, high).sum()) <= 2  # limits have three digits
    said = page.find("#profile-size").get_attribute("aria-label")
    assert number(said.split("mean ")[1]) == four_digits(force.mean())
