"""Size, loading time and frame rate of network.html in headless Chromium without a graphics card.

The time to the first picture is counted from the start of loading the page. The frame rate is that
of 3 s in which every picture shows another frame of the run from another direction: as much work
as playing and turning at once. Each round has a browser of its own; medians are reported. A page
that is drawn too slowly takes fewer pixels while it moves; the fraction, along an edge, is given
then.

    PYTHONPATH=tests/helpers python benchmarks/network_page.py RUN_DIR... [--rounds 5]

Each RUN_DIR has a ``network.html``.
"""

import argparse
import sys
import tempfile
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "helpers"))

from browser import MISSING, Browser
from machine import machine

SIZES = ("1366,900", "1920,1200")
"""Windows, pixels; the browser's own bars take about 140 of the height."""

FIRST = "return performance.getEntriesByName('first-picture')[0].startTime"
PLAY = """
const done = arguments[1], page = networkPage, size = document.getElementById("size");
if (arguments[0] === "media in full") size.value = 100;
if (arguments[0] === "contacts above the mean") document.getElementById("mean").click();
const start = performance.now(), before = page.view.drawn;
const next = (now) => {
  page.show((page.number + 1) % page.frames.count);
  page.view.turn(0.02, 0);
  if (now - start < 3000) requestAnimationFrame(next);
  else done([(1000 * (page.view.drawn - before)) / (now - start), page.view.pace.ratio]);
};
requestAnimationFrame(next);
"""
LOOKS = ("as opened", "contacts above the mean", "media in full")


Rates = dict[str, tuple[float, float]]
"""Of each look: pictures per second, and pixels drawn per pixel of the page along an edge."""


def one_round(page: Path, size: str) -> tuple[float, Rates]:
    """Time to the first picture in s, and the rate of each look."""
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(Path(profile), size=size)
        try:
            first = browser.open(page).run(FIRST) / 1e3
            return first, {look: browser.driver.execute_async_script(PLAY, look) for look in LOOKS}
        finally:
            browser.close()


def _words(rates: list[tuple[float, float]]) -> str:
    rate, ratio = (median(values) for values in zip(*rates, strict=True))
    return f"{rate:.0f}" if ratio == 1 else f"{rate:.0f} (at {100 * ratio:.0f} % of the pixels)"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run_dirs", type=Path, nargs="+", metavar="RUN_DIR")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    if MISSING:
        raise SystemExit(f"not installed: {', '.join(MISSING)}")
    titles = ["run", "MB", "window", "first picture, s", *(f"{look}, 1/s" for look in LOOKS)]
    print(f"| {' | '.join(titles)} |\n|{' --- |' * len(titles)}")
    for run_dir in options.run_dirs:
        page = run_dir / "network.html"
        for size in SIZES:
            rounds = [one_round(page, size) for _ in range(options.rounds)]
            rates = [_words([rates[look] for _, rates in rounds]) for look in LOOKS]
            first = f"{median(first for first, _ in rounds):.2f}"
            size_mb = f"{page.stat().st_size / 1e6:.1f}"
            row = [run_dir.name, size_mb, size.replace(",", " x "), first, *rates]
            print(f"| {' | '.join(row)} |", flush=True)
    print(f"\n{machine('selenium')}")


if __name__ == "__main__":
    main()
