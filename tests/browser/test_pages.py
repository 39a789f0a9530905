"""Reports in a real browser: they load nothing, complain about nothing, and do what their buttons say."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from diagnosis_cases import axis, write_case
from playwright.sync_api import Page, expect
from report_example import SPIKE, identified, write_long_report
from simulated_fleet import write_axis, write_fleet

from friction_ocp.cli import main
from friction_ocp.report import write_report

COMMANDS: dict[str, list[str]] = {
    "simulate": [],
    "multistart": ["--starts", "2", "--workers", "1"],
    "profile": ["--parameter", "motor.inertia", "--workers", "1"],
    "bootstrap": ["--draws", "20", "--workers", "1"],
    "compare": ["--workers", "1"],
    "batch": ["--workers", "1"],
    "diagnose": ["--workers", "1"],
    "design": [],
}
MOST_BYTES = 15_000_000

pytestmark = pytest.mark.usefixtures("without_figures")


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the address of an identification with everything that one can have."""
    path = tmp_path_factory.mktemp("identify") / "report.html"
    write_report(*identified(6000), path)
    return path.as_uri()


class Reports:
    """Reports of every other kind, each made by its command when it is first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        files = write_fleet(folder / "nights", 2, 2)
        problem = write_axis(folder / "axis.yaml", files[0])
        other = folder / "other.yaml"
        other.write_text(problem.read_text(encoding="utf-8").replace("guess: 0.003", "guess: 0.002"), encoding="utf-8")
        (folder / "lacking").mkdir()
        plant = axis(law="stribeck", tau_s=0.15, omega_s=6.0)
        lacking = write_case(folder / "lacking", plant, effects=("stribeck", "quadratic_drag"))
        self.asked = {name: [str(problem)] for name in COMMANDS}
        self.asked["compare"] = [str(problem), str(other)]
        self.asked["batch"] = [str(problem), str(folder / "nights")]
        self.asked["diagnose"] = self.asked["design"] = [str(lacking)]

    def __getitem__(self, kind: str) -> str:
        """Return the address of a report."""
        return (self.made(kind) / "report.html").as_uri()

    def made(self, kind: str) -> Path:
        """Return the folder of a result; "results" is a comparison of two results."""
        out = self.folder / kind
        if not out.exists():
            if kind == "results":
                command = ["compare", *(str(self.made(name)) for name in ("bootstrap", "profile"))]
            else:
                command = [kind, *self.asked[kind], *COMMANDS[kind]]
            assert main([*command, "--out", str(out)]) == 0
        return out


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Reports:
    """Return the reports of this module."""
    return Reports(tmp_path_factory.mktemp("reports"))


def assert_accessible(page: Page) -> None:
    """Whatever can be operated or looked at has a name, headings skip no level, and there is one main part."""
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("main button, main select, main a[href], main img, [role=img], "
            + "[role=region]")].filter((element) => {
                const by = element.getAttribute("aria-labelledby");
                const label = element.id && document.querySelector(`label[for="${element.id}"]`);
                return !(element.getAttribute("aria-label") || element.getAttribute("alt") || element.title
                    || element.dataset.title || element.textContent.trim() || (label && label.textContent)
                    || (by && document.getElementById(by)?.textContent.trim()));
            }).map((element) => element.outerHTML.slice(0, 120))"""
    )
    assert nameless == []
    levels = page.evaluate("() => [...document.querySelectorAll('h1, h2, h3')].map((item) => Number(item.tagName[1]))")
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    assert page.locator("main").count() == 1 and page.locator("html").get_attribute("lang") == "en"
    ids = page.evaluate("() => [...document.querySelectorAll('[id]')].map((item) => item.id)")
    doubled = {name for name in ids if ids.count(name) > 1}
    assert [name for name in doubled if not name.startswith(("clip", "topdefs", "defs", "legend"))] == []


def assert_fits(page: Page) -> None:
    """Nothing but what scrolls by itself is wider than the window."""
    assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth + 1")


@pytest.mark.parametrize("width", [1200, 390], ids=["desktop", "phone"])
@pytest.mark.parametrize("kind", [*COMMANDS, "results"])
def test_every_kind_of_report_opens(kind: str, width: int, reports: Reports, page: Page) -> None:
    """Without network or complaint, accessible, on a desktop and on a phone."""
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(reports[kind])
    expect(page.locator("h1")).to_be_visible()
    assert_accessible(page)
    assert_fits(page)
    broken = page.evaluate("() => [...document.images].filter((image) => !image.naturalWidth).length")
    assert broken == 0


@pytest.mark.parametrize("width", [1200, 390], ids=["desktop", "phone"])
def test_an_identification_opens(width: int, example: str, page: Page) -> None:
    """The same, with all plots drawn."""
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(example)
    expect(page.locator(".plot .main-svg").first).to_be_visible()
    assert page.locator(".plot").count() == page.locator(".plot:has(.main-svg)").count() > 3
    assert_accessible(page)
    assert_fits(page)


def test_a_table_wider_than_a_phone_becomes_cards(example: str, page: Page) -> None:
    """Nothing of it is beyond the edge, every cell stands beside its header, and it remains a table to be read out."""
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto(example)
    table = page.locator("table.parameters").first
    assert "cards" in (table.get_attribute("class") or "")
    assert page.evaluate("() => document.querySelector('table.parameters').getBoundingClientRect().right") <= 390
    cells = page.evaluate(
        "() => [...document.querySelectorAll('table.parameters tbody tr')[0].cells].map((cell) => [cell.dataset.label, "
        "cell.getBoundingClientRect().right <= innerWidth])"
    )
    assert [label.split()[0] for label, _ in cells][:4] == ["Parameter", "Value", "Unit", "95"]
    assert all(inside for _, inside in cells)
    assert page.get_by_role("table").first.get_by_role("cell").count() > 3
    page.set_viewport_size({"width": 1200, "height": 800})
    page.wait_for_function("() => !document.querySelector('table.parameters').classList.contains('cards')")


SHOWN = "() => ((range) => range[1] - range[0])(document.querySelectorAll('.plot')[1].layout.xaxis.range)"
"""Seconds that the second plot shows."""


def span(page: Page, plot: int) -> float:
    """Return how many seconds a plot shows."""
    low, high = page.evaluate(f"() => document.querySelectorAll('.plot')[{plot}].layout.xaxis.range")
    return high - low


def test_dragging_zooms_every_channel_of_the_recording(example: str, page: Page) -> None:
    """The dragged part of the time is what all channels show then; a double click shows everything again."""
    page.goto(example)
    plots = page.locator('[data-plots="traces"] .plot')
    plots.first.scroll_into_view_if_needed()
    whole = span(page, 0)
    area = plots.first.locator(".nsewdrag").first.bounding_box()
    assert area is not None
    height = area["y"] + area["height"] / 2
    page.mouse.move(area["x"] + 0.3 * area["width"], height)
    page.mouse.down()
    page.mouse.move(area["x"] + 0.4 * area["width"], height, steps=5)
    page.mouse.move(area["x"] + 0.6 * area["width"], height, steps=5)
    page.mouse.up()
    page.wait_for_function(SHOWN + f" < {0.5 * whole}")
    assert span(page, 0) == pytest.approx(0.3 * whole, rel=0.05)
    assert span(page, 1) == pytest.approx(span(page, 0), rel=1e-6)
    page.mouse.dblclick(area["x"] + 0.5 * area["width"], height)
    page.wait_for_function(SHOWN + f" > {0.9 * whole}")


def column(page: Page, table: str, number: int) -> list[str]:
    """Return the keys of a column in the order shown."""
    return page.evaluate(
        f"() => [...document.querySelectorAll('{table} tbody tr')].map((row) => row.cells[{number}].dataset.key || '')"
    )


def test_the_parameter_table_sorts_by_mouse_and_keyboard(example: str, page: Page) -> None:
    """A header sorts by its column, up and down, and says so to a screen reader."""
    page.goto(example)
    before = column(page, "table.parameters", 0)
    header = page.get_by_role("columnheader", name="Value")
    header.get_by_role("button").click()
    assert header.get_attribute("aria-sort") == "ascending"
    values = [float(key) for key in column(page, "table.parameters", 1) if key]
    assert values == sorted(values)
    header.get_by_role("button").press("Enter")
    assert header.get_attribute("aria-sort") == "descending"
    assert [float(key) for key in column(page, "table.parameters", 1) if key] == values[::-1]
    page.get_by_role("columnheader", name="Parameter").get_by_role("button").press("Space")
    assert column(page, "table.parameters", 0) == sorted(before, key=str.casefold)


def test_a_fleet_sorts_too(reports: Reports, page: Page) -> None:
    """Its tables need no plots for that."""
    page.goto(reports["batch"])
    levels = page.get_by_role("region", name="Levels, before the change").get_by_role("columnheader", name="Level")
    levels.first.get_by_role("button").click()
    assert levels.first.get_attribute("aria-sort") == "ascending"


def test_recordings_are_toggled_by_list_button_and_keyboard(example: str, page: Page) -> None:
    """The chosen recording is what is drawn; at the ends the buttons stop."""
    page.goto(example)
    chooser = page.locator("#choose-traces")
    first = page.evaluate("() => document.querySelector('.plot').data[0].x.length")
    assert first > 0
    previous, following = (
        page.locator("#traces").get_by_role("button", name=f"{word} recording") for word in ("Previous", "Next")
    )
    assert previous.is_disabled()
    following.click()
    assert chooser.input_value() == "1"
    page.get_by_role("combobox", name="Recording").first.focus()
    page.keyboard.press("ArrowDown")
    assert chooser.input_value() == "2"
    assert following.is_disabled() and previous.is_enabled()
    chooser.select_option("0")
    assert page.evaluate("() => document.querySelector('.plot').data[0].x.length") == first


def test_a_curve_is_switched_off_in_the_legend(example: str, page: Page) -> None:
    """A click on its name hides it, another shows it again."""
    page.goto(example)
    legend = page.locator('[data-plots="traces"] .plot').first.locator(".legendtoggle").first
    legend.scroll_into_view_if_needed()
    legend.click()
    page.wait_for_function("() => document.querySelector('.plot').data[0].visible === 'legendonly'")
    page.wait_for_timeout(400)  # a second click within 300 ms is a double click, which means something else
    legend.click()
    page.wait_for_function("() => document.querySelector('.plot').data[0].visible !== 'legendonly'")


def test_the_keyboard_gets_everywhere(example: str, page: Page) -> None:
    """Tab reaches the link past the head first, then the sections, the tables that scroll and the choosers."""
    page.goto(example)
    page.keyboard.press("Tab")
    assert page.evaluate("() => document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.url.endswith("#main")
    reached: set[str] = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.tagName + '.' + document.activeElement.className"))
    assert {"DIV.scroll", "BUTTON."} <= reached and any(name.startswith("SELECT") for name in reached)


@pytest.mark.parametrize("kind", ["identify", "batch", "diagnose"])
def test_a_report_is_printed(kind: str, example: str, reports: Reports, page: Page, tmp_path: Path) -> None:
    """As a PDF of several pages, without what only a screen can do."""
    page.goto(example if kind == "identify" else reports[kind])
    path = tmp_path / "report.pdf"
    page.pdf(path=path, prefer_css_page_size=True)
    content = path.read_bytes()
    assert content.startswith(b"%PDF") and content.count(b"/Type /Page\n") + content.count(b"/Type /Page ") > 1
    page.emulate_media(media="print")
    assert page.locator(".screen:visible").count() == 0
    assert page.locator("nav").is_visible() is False


def test_a_long_recording_keeps_its_peaks(tmp_path: Path, page: Page) -> None:
    """10^6 samples: a file under 15 MB, and the sample that stands out is drawn."""
    path = write_long_report(tmp_path)
    assert path.stat().st_size < MOST_BYTES
    page.goto(path.as_uri())
    expect(page.locator(".plot .main-svg").first).to_be_visible()
    drawn = page.evaluate("() => Math.max(...document.querySelector('.plot').data[0].y)")
    assert drawn == pytest.approx(SPIKE)
    assert page.evaluate("() => document.querySelector('.plot').data[0].x.length") <= 4000
