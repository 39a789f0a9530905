"""Figures are written for whatever a result has."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from report_example import identified

from friction_ocp.plots import write_figures
from friction_ocp.plots.curves import curve_label
from friction_ocp.plots.figures import file_stem
from friction_ocp.plots.style import new_figure, save


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the figures of the example."""
    return write_figures(*identified(500), tmp_path_factory.mktemp("run") / "figures")


def test_every_figure_is_written_as_png_and_svg(written: list[Path]) -> None:
    """One pair a recording, a shaft and a table, none of them empty."""
    stems = ["parameters", "traces-staircase", "traces-stop", "traces-reversals", "friction-motor", "friction-load"]
    stems += ["residual-autocorrelation", "coherence", "correlation"]
    assert [path.name for path in written] == [f"{stem}.{ending}" for stem in stems for ending in ("png", "svg")]
    for path in written:
        content = path.read_bytes()
        assert len(content) > 5000
        if path.suffix == ".png":
            assert content.startswith(b"\x89PNG")
        else:
            assert ElementTree.fromstring(content).tag.endswith("svg")
            assert b"mathdefault" not in content, "a tick of a logarithmic axis shows its formula"


def test_names_cannot_leave_the_folder_nor_meet_in_one_file() -> None:
    """A file name has no separator and no parent, and is never given twice."""
    names = ("../../etc/x", "..", "a/b", "a?b", "A?B", "a\\b", "", "x" * 999, "run.h5", "run", "con\0")
    taken: set[str] = set()
    stems = [file_stem(f"traces-{name}", taken) for name in names]
    assert len({stem.lower() for stem in stems}) == len(names)
    for stem in stems:
        assert re.fullmatch(r"traces-[\w.-]{0,100}", stem)
        assert ".." not in stem


def test_text_is_taken_literally(tmp_path: Path) -> None:
    """Dollars start no formula, and a script that the font lacks warns nobody."""
    _, series = identified(50)
    channels = {"方位 $\\frac$": series["stop.h5"]["motor_position"]}
    assert len(write_figures({"channel_units": {"方位 $\\frac$": "$x_"}}, {"$\\x": channels}, tmp_path)) == 2


def test_gaps_nulls_and_zeros_are_drawn_around(tmp_path: Path) -> None:
    """A guess of zero, a null interval, a null in the matrix and a channel without data stop nothing."""
    result, _ = identified(50)
    result["parameters"]["motor.friction.tau_c"] |= {"guess": 0.0, "interval95": [None, None]}
    result["parameters"]["motor.friction.tau_s"] |= {"value": None, "guess": None}
    result["correlation"]["matrix"][0][1] = None
    del result["residuals"]["stop.h5"]["motor_position"]
    result["friction_curves"][0] |= {"lower": None, "upper": None}
    empty = {name: np.full(5, np.nan) for name in ("measured", "simulated")} | {"time": np.arange(5.0)}
    assert len(write_figures(result, {"a": {"b": empty}}, tmp_path)) == 14


def test_a_curve_is_named_by_what_tells_it_from_the_others() -> None:
    """Loads are named where they differ, laws where they differ."""
    light, heavy = {"law": "lugre", "load": 0.0, "load_unit": "N m"}, {"law": "lugre", "load": 20.0, "load_unit": "N m"}
    other = {"law": "coulomb", "load": 0.0, "load_unit": "N m"}
    assert [curve_label(curve, [light, heavy]) for curve in (light, heavy)] == ["load 0 N m", "load 20 N m"]
    assert [curve_label(curve, [light, other]) for curve in (light, other)] == ["lugre", "coulomb"]
    assert curve_label(light, [light]) == "fitted"


def test_a_figure_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    """Whoever is interrupted while drawing leaves the old file, or none."""
    figure = new_figure(2.0)
    whole = save(figure, tmp_path / "curve")

    def interrupted(path: Path, **options: object) -> None:
        path.write_bytes(b"<svg")
        raise KeyboardInterrupt

    before = [path.read_bytes() for path in whole]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure, "savefig", interrupted)
        with pytest.raises(KeyboardInterrupt):
            save(figure, tmp_path / "curve")
    assert [path.read_bytes() for path in whole] == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["curve.png", "curve.svg"]
