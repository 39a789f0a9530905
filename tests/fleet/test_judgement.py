"""Flags of a fleet come at the rate that is stated, and what moves is found."""

from __future__ import annotations

import numpy as np
import pytest

from friction_ocp.fleet.drift import FEWEST, drift_test, shapes_of
from friction_ocp.fleet.judgement import Series, judge
from friction_ocp.fleet.scatter import level_of

RATE, FLEETS = 0.2, 60
SURE = 4.0
"""Standard deviations of a count beyond which chance is no excuse."""


def series(
    rng: np.random.Generator, machine: str, nights: int = 12, scatter: float = 1.0, errors: tuple[float, float] = (0, 1)
) -> Series:
    """Return estimates about 100 whose errors are of all sizes between the two."""
    std_error = rng.uniform(*errors, nights) + 1e-6
    value = 100.0 + scatter * rng.standard_normal(nights) + std_error * rng.standard_normal(nights)
    return Series(machine, "friction", "N m", tuple(range(nights)), np.arange(float(nights)), value, std_error)


def moved(item: Series, by: np.ndarray) -> Series:
    """Return a series with something added."""
    return Series(item.machine, item.parameter, item.unit, item.fits, item.time, item.value + by, item.std_error)


@pytest.mark.parametrize(
    ("scatter", "errors"), [(1.0, (0.2, 1.5)), (1.0, (0.0, 1e-6)), (0.0, (0.2, 1.5))], ids=["both", "nights", "fits"]
)
def test_quiet_fleets_are_flagged_no_more_often_than_stated(scatter: float, errors: tuple[float, float]) -> None:
    """Whether nights or fits scatter, at most the stated share of fleets without change has any flag."""
    rng = np.random.default_rng(11)
    flags = 0
    for seed in range(FLEETS):
        found = judge([series(rng, f"m{k}", scatter=scatter, errors=errors) for k in range(4)], RATE, seed)
        flags += bool(found.flagged or found.outliers)
    assert flags <= RATE * FLEETS + SURE * np.sqrt(RATE * (1.0 - RATE) * FLEETS)


@pytest.mark.parametrize("kind", ["step", "ramp"])
def test_a_change_is_found_with_its_size_and_its_machine(kind: str) -> None:
    """A jump and a steady growth are told apart, and the interval holds the true size."""
    rng = np.random.default_rng(3)
    fleet = [series(rng, f"m{k}", nights=20) for k in range(5)]
    order = np.arange(20.0)
    change = 8.0 * (order > 9) if kind == "step" else 8.0 * order / 19.0
    fleet[2] = moved(fleet[2], change)
    found = judge(fleet, 0.05)
    (drift,) = found.flagged
    assert drift.series.machine == "m2" and drift.test.shape.kind == kind
    assert found.outliers == ()
    low, high = drift.test.level.interval95(1) or (0.0, 0.0)
    assert low < 8.0 < high


def test_an_outlier_hides_no_drift_and_is_none() -> None:
    """One night far off is named, and the growth behind it is found all the same."""
    rng = np.random.default_rng(5)
    fleet = [series(rng, f"m{k}", nights=20) for k in range(5)]
    fleet[1] = moved(fleet[1], 10.0 * np.arange(20.0) / 19.0 - 60.0 * (np.arange(20) == 17))
    found = judge(fleet, 0.05)
    assert [item.series.machine for item in found.flagged] == ["m1"]
    assert [(item.series.machine, item.place) for item in found.outliers] == [("m1", 17)]
    assert found.outliers[0].expected == pytest.approx(100.0 + 10.0 * 17 / 19, abs=2.0)


def test_a_judgement_does_not_depend_on_units_or_order() -> None:
    """The same fleet in micro-units, machines the other way round, has the same p-values."""
    rng = np.random.default_rng(7)
    fleet = [series(rng, f"m{k}") for k in range(3)]
    small = [
        Series(item.machine, item.parameter, "", item.fits, item.time, 1e-9 * item.value, 1e-9 * item.std_error)
        for item in reversed(fleet)
    ]
    ours, theirs = (
        {item.series.machine: item.test.p_value for item in judge(one, 0.05).drifts} for one in (fleet, small)
    )
    assert ours == theirs


def test_random_orders_give_a_uniform_p_value() -> None:
    """Below any level lies at most its share of p-values, however uneven the standard errors and heavy the tails."""
    rng = np.random.default_rng(2)
    std_error = np.exp(rng.standard_normal((150, 9)))
    values = std_error * rng.standard_t(2.0, (150, 9))
    p_values = np.array(
        [drift_test(np.arange(9.0), y, s, 0.05, rng).p_value for y, s in zip(values, std_error, strict=True)]
    )
    for level in (0.05, 0.2, 0.5):
        assert np.mean(p_values <= level) <= level + SURE * np.sqrt(level * (1.0 - level) / p_values.size)


def test_the_scatter_of_nights_is_found_beside_that_of_fits() -> None:
    """Over many nights the extra variance is the one put in, and none where fits explain everything."""
    rng = np.random.default_rng(4)
    item = series(rng, "m", nights=4000, scatter=0.7, errors=(0.2, 1.5))
    assert level_of(np.ones((4000, 1)), item.value, item.std_error).night_scatter == pytest.approx(0.7, rel=0.1)
    still = series(rng, "m", nights=4000, scatter=0.0, errors=(0.2, 1.5))
    assert level_of(np.ones((4000, 1)), still.value, still.std_error).night_scatter < 0.2


def test_few_nights_are_not_judged() -> None:
    """There is nothing to put in random order; levels are told all the same."""
    rng = np.random.default_rng(1)
    found = judge([series(rng, "m", nights=FEWEST - 1), series(rng, "n", nights=1)], 0.05)
    assert found.drifts == () and found.outliers == ()
    assert found.levels["n", "friction"].interval95(0) is None
    assert len(found.levels) == 2


def test_shapes_reach_from_nothing_to_one() -> None:
    """Each shape is 0 before its change and 1 at the last night, also where nights are uneven or share a time."""
    for time in (np.arange(7.0), np.array([0.0, 1.0, 1.0, 5.0, 5.0, 5.0])):
        for shape in shapes_of(time):
            assert shape.column[0] == 0.0 and shape.column[-1] == 1.0
            assert np.all(np.diff(shape.column) >= 0.0)
