"""How soon a report answers whose recordings are long: a table of the growth with the samples.

python problems/benchmarks/pages.py [--openings 5]

Headless Chromium opens the page of an identification as often as `--openings` says; the seconds, a median, are those
that the page's own thread worked until its first trace stood, so that other work on the machine does not count. The
exit status is 1 where 10^6 samples need 15 MB or 2 s.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from checks import print_rows
from playwright.sync_api import Browser, expect, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "report"))
from report_example import write_long_report

SAMPLES = (10_000, 100_000, 1_000_000)
MOST_BYTES, MOST_SECONDS = 15_000_000, 2.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row a length; 1 where the longest is too large or too slow."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--openings", type=int, default=5)
    openings = parser.parse_args(arguments).openings
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        parser.error("there is no Chromium: apt-get install chromium")
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox", "--disable-gpu"])
        sizes: list[int] = []
        seconds: list[float] = []
        for samples in SAMPLES:
            page = write_long_report(Path(place), samples)
            sizes.append(page.stat().st_size)
            seconds.append(statistics.median(opened(browser, page) for _ in range(openings)))
        browser.close()
    rows = zip(SAMPLES, sizes, seconds, strict=True)
    print_rows(
        ("samples", "MB", "s", "ratio of s"),
        [(f"{many:,}", f"{size / 1e6:.1f}", f"{took:.2f}", f"{took / seconds[0]:.2f}") for many, size, took in rows],
    )
    return int(sizes[-1] >= MOST_BYTES or seconds[-1] >= MOST_SECONDS)


def opened(browser: Browser, path: Path) -> float:
    """Open a report in a page of its own; return the seconds that its thread worked."""
    context = browser.new_context(viewport={"width": 1200, "height": 900})
    page = context.new_page()
    session = context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(path.as_uri())
    expect(page.locator(".plot .main-svg").first).to_be_visible(timeout=60_000)
    metrics = {item["name"]: item["value"] for item in session.send("Performance.getMetrics")["metrics"]}
    context.close()
    return metrics["TaskDuration"]


if __name__ == "__main__":
    raise SystemExit(main())
