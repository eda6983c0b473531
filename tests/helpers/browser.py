"""A headless Chromium that opens pages from files, driven by Selenium."""

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

MISSING = [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
"""Programs that are not installed; without them no page can be opened."""

_SWITCHES = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--enable-unsafe-swiftshader",
)
HUNG_S = 3600.0
"""A browser that has not answered after this time never will, s: nothing else is timed."""


class Browser:
    """A window of 1366 x 900 pixels.

    Parameters
    ----------
    profile : Path
        An empty folder for what the browser stores.
    """

    def __init__(self, profile: Path) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        own = (f"--user-data-dir={profile}", "--window-size=1366,900")
        for switch in (*_SWITCHES, *own):
            options.add_argument(switch)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = Service(shutil.which("chromedriver"))
        self.driver: Any = webdriver.Chrome(options=options, service=service)
        self.driver.command_executor.client_config.timeout = HUNG_S
        self.driver.set_script_timeout(HUNG_S)
        self.driver.set_page_load_timeout(HUNG_S)

    def open(self, file: Path) -> "Browser":
        """Open a page and wait until it is ready, or says what its problem is."""
        self.driver.get(file.resolve().as_uri())
        ended = (
            'document.documentElement.dataset.ready || !document.getElementById("problem").hidden'
        )
        self.wait(lambda: self.run(f"return {ended}"), "the page to be ready")
        return self

    def wait(self, condition: Callable[[], object], what: str) -> None:
        """Wait until a condition is true."""
        end = time.monotonic() + HUNG_S
        while not condition():
            assert time.monotonic() < end, f"waited too long for {what}"
            time.sleep(0.05)

    def run(self, script: str, *values: Any) -> Any:
        """The value that a script returns."""
        return self.driver.execute_script(script, *values)

    def find(self, selector: str) -> Any:
        """An element."""
        return self.driver.find_element("css selector", selector)

    def text(self, selector: str) -> str:
        """The text of an element, spaces between digits left out."""
        return str(self.find(selector).text).replace("\u202f", "")

    def click(self, selector: str) -> None:
        """Click an element where a user would."""
        self.find(selector).click()

    def click_at(self, selector: str, x: float, y: float) -> None:
        """Click a point of an element, in pixels from its upper left corner."""
        from selenium.webdriver import ActionChains

        element = self.find(selector)
        off = round(x - element.size["width"] / 2), round(y - element.size["height"] / 2)
        ActionChains(self.driver).move_to_element_with_offset(element, *off).click().perform()

    def errors(self) -> list[str]:
        """What the page wrote to the console, but for notes of the graphics driver."""
        messages = [entry["message"] for entry in self.driver.get_log("browser")]
        return [text for text in messages if "GL Driver Message" not in text]

    def close(self) -> None:
        """End the browser."""
        self.driver.quit()
