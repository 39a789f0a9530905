"""The report is one safe file that says everything the result says."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from plotly.offline import get_plotlyjs
from report_example import Result, Series, identified, parameter

from friction_ocp.report import write_report
from friction_ocp.report.page import paragraphs
from friction_ocp.report.payload import embedded_json
from friction_ocp.report.section import StatisticTable, columns
from friction_ocp.report.tables import parameter_rows
from friction_ocp.report.text import summary

HOSTILE = (
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(2)>",
    "<!--<script>",
    "..",
    "a\u2028b $x$ %{y}",
)


class Elements(HTMLParser):
    """Collects tags with their attributes, and the text outside scripts and styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] not in ("script", "style"):
            self.text += data


def page_of(result: Result, series: Series, folder: Path) -> str:
    """Return the report without the bundled library."""
    write_report(result, series, folder / "report.html")
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count(get_plotlyjs()) == 1
    return page.replace(get_plotlyjs(), "")


@pytest.fixture
def page(tmp_path: Path) -> str:
    """Return the report of the example."""
    return page_of(*identified(6000), tmp_path)


def test_every_parameter_stands_there_with_value_unit_and_verdict(page: str) -> None:
    """The table holds what result.json holds."""
    result, _ = identified(200)
    rows = {row[0]: row for row in re.findall(r'<th scope="row" data-key="([^"]+)">(.*?)</tr>', page, flags=re.DOTALL)}
    assert list(rows) == list(result["parameters"])
    for name, item in result["parameters"].items():
        assert f'data-key="{item["value"]}"' in rows[name][1]
        assert f'data-key="{item["unit"]}"' in rows[name][1]
        assert item["verdict"].replace("_", " ") in rows[name][1]
        assert all(f'data-key="{other}"' in rows[name][1] for other in item["traded_with"])


def test_torque_noise_stands_below_the_parameters(tmp_path: Path) -> None:
    """An estimated level is shown with its interval; without one there is no such table."""
    result, series = identified(600)
    assert "Torque noise" not in Elements(page_of(result, series, tmp_path)).text
    noise = {"motor": parameter(1.04e-3, "N m/sqrt(Hz)", 6.0e-5, 1.0e-3)}
    text = Elements(page_of({**result, "process_noise": noise}, series, tmp_path)).text
    assert "Torque noise by maximum likelihood" in text and "0.00104" in text and "[0.000922, 0.001158]" in text


def test_the_sections_come_in_the_order_of_a_readers_questions(page: str) -> None:
    """What is wrong stands above the answer, and the solver's facts at the end."""
    sections = [attributes["id"] for tag, attributes in Elements(page).tags if tag == "section"]
    assert sections == [
        "warnings",
        "question",
        "parameters",
        "fit",
        "traces",
        "coherence",
        "friction",
        "residuals",
        "correlation",
        "provenance",
    ]


def test_nothing_is_loaded_from_anywhere(page: str) -> None:
    """No element names an address outside the file, and the policy forbids the scripts to."""
    for tag, attributes in Elements(page).tags:
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            assert re.fullmatch(r"(#.*|data:.*)?", attributes.get(name) or ""), (tag, attributes)
    assert "http://" not in page
    assert "https://" not in page
    assert "@import" not in page
    assert "url(" not in page
    policies = [attributes for _, attributes in Elements(page).tags if "http-equiv" in attributes]
    assert "default-src 'none'; script-src 'sha256-" in str(policies[0]["content"])


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    """No name of a recording, channel, parameter or unit becomes markup, in the page or in its data."""
    result, series = identified(600)
    harmless = page_of(result, series, tmp_path)
    for name in HOSTILE:
        evil = json.loads(json.dumps(result).replace("stop.h5", "RENAMED"), object_pairs_hook=lambda pairs: dict(pairs))
        evil = json.loads(json.dumps(evil).replace("RENAMED", json.dumps(name)[1:-1]))
        evil |= {"title": name, "question": name, "warnings": [*result["warnings"][1:], name], "problem": name}
        evil["parameters"][name] = evil["parameters"].pop("motor.friction.tau_c") | {
            "unit": name,
            "traded_with": [name],
        }
        evil["friction_curves"][0] |= {"shaft": name, "law": name, "load_unit": name, "speed_unit": name}
        evil["correlation"]["names"][0] = name
        evil["channel_units"]["motor_position"] = name
        renamed = {name if key == "stop.h5" else key: channels for key, channels in series.items()}
        renamed[name][name] = renamed[name].pop("motor_position")
        written = Elements(page_of(evil, renamed, tmp_path))
        expected = [tag for tag, _ in Elements(harmless).tags if tag != "wbr"]
        assert [tag for tag, _ in written.tags if tag != "wbr"] == expected
        assert name in written.text
        renamed[name]["motor_position"] = renamed[name].pop(name)


def test_embedded_data_is_json_that_cannot_end_its_script() -> None:
    """What comes out of the page is what went in; what is not finite is null."""
    text = embedded_json({"names": HOSTILE, "values": [1.5, float("nan"), float("inf")]})
    assert json.loads(text) == {"names": list(HOSTILE), "values": [1.5, None, None]}
    assert not set(text) & {"<", ">", "&", "\u2028", "\u2029"}


def test_every_recording_is_in_the_page_thinned(page: str) -> None:
    """The selector offers all recordings, and each has its traces in the file."""
    found = re.findall(r'<script type="application/json" data-traces="(\d+)">(.*?)</script>', page)
    assert [int(index) for index, _ in found] == [0, 1, 2]
    for _, text in found:
        channels = json.loads(text)
        assert [channel["name"] for channel in channels] == ["motor_position", "load_acceleration"]
        for channel in channels:
            lengths = {len(channel[key]) for key in ("time", "measured", "simulated", "residual")}
            assert lengths == {channel["shown"]}
            assert channel["shown"] <= 4000
    assert re.findall(r'<option value="(\d)"[^>]*>([^<]*)</option>', page)[:3] == [
        ("0", "staircase.h5"),
        ("1", "stop.h5"),
        ("2", "reversals.h5"),
    ]


def test_a_result_that_did_not_converge_says_so_above_the_numbers(tmp_path: Path) -> None:
    """Status and reason come before the table, and the table repeats them."""
    result, series = identified(600)
    result |= {"status": "not_converged", "message": "iteration limit reached"}
    page = page_of(result, series, tmp_path)
    assert 0 < page.index("Not converged: iteration limit reached") < page.index("<table")
    assert page.index("<table") < page.index("Not converged: the last iterate, not an answer") < page.index("<tbody>")


def test_a_bare_result_makes_a_page(tmp_path: Path) -> None:
    """Sections without content are left out, and states are not drawn as channels."""
    series = {"a": {"states": {"time": np.zeros(2), "motor.omega": np.zeros(2)}}}
    page = page_of({"status": "converged"}, series, tmp_path)
    assert [attributes["id"] for tag, attributes in Elements(page).tags if tag == "section"] == ["traces", "provenance"]
    assert 'data-traces="0">[]<' in page


def test_missing_numbers_are_dashes(tmp_path: Path) -> None:
    """A null in result.json breaks nothing and shows no number."""
    result, series = identified(600)
    result["parameters"]["motor.friction.tau_c"] |= {"value": None, "interval95": [0.1, None], "guess": None}
    result["fit"]["train"]["motor_position"] |= {"noise_ratio": None, "relative": None, "by_recording": {"a": 0.5}}
    result["correlation"]["matrix"][0][1] = None
    page = page_of(result, series, tmp_path)
    assert "[0.1000, ∞]" in page
    assert "None" not in Elements(page).text


def test_a_failed_write_leaves_the_old_report(tmp_path: Path) -> None:
    """Nothing half written and no draft stays behind."""
    (tmp_path / "report.html").mkdir()
    result, series = identified(600)
    with pytest.raises(OSError, match=r"report\.html"):
        write_report(result, series, tmp_path / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_importing_draws_in_no_plotting_library() -> None:
    """matplotlib and plotly are imported when something is drawn, not before."""
    code = "import sys, friction_ocp.plots, friction_ocp.report; print({'matplotlib', 'plotly'} & set(sys.modules))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "set()"


def test_the_summary_in_the_terminal_has_the_digits_of_the_page() -> None:
    """Values, intervals, units and verdicts stand in columns, as the parameter table writes them."""
    result, _ = identified(600)
    lines = summary(result).splitlines()
    row = parameter_rows(result["parameters"])[0]
    line = next(line for line in lines if line.startswith(f"{row.name} "))
    low, high = result["parameters"][row.name]["interval95"]
    share = 0.5 * (high - low) / result["parameters"][row.name]["value"]
    assert row.relative.text == f"± {100 * share:.2g} %"
    for text in (row.value.text, row.interval.text, row.relative.text, row.unit, row.verdict):
        assert text in line
    assert next(line for line in lines if line.startswith("parameter")).split() == [
        *("parameter", "value", "95", "%", "interval", "relative", "unit", "verdict")
    ]


def test_a_question_is_not_asked_twice() -> None:
    """The word that opens a problem file's comment is the heading of the page."""
    assert paragraphs("Asked: how far\nit goes.\n\nKnown: all.") == ["How far it goes.", "Known: all."]
    assert paragraphs("") == []


def test_columns_that_say_nothing_are_left_out() -> None:
    """Of a statistic's table, on the page as in the terminal."""
    table = StatisticTable("c", columns("Name | Remark", "Value"), (("a", "", "1"), ("b", "", "2")))
    assert [column.head for column in table.filled.columns] == ["Name", "Value"]
    assert table.filled.rows == (("a", "1"), ("b", "2"))
