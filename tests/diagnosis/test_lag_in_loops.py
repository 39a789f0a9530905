"""A motor that follows its controller late, and a log that shows what it does or what it was told to."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from diagnosis_cases import STEP, diagnosed
from looped_axis import written

from friction_ocp.estimation.model import late_of, prepare, with_drive
from friction_ocp.problem_file.load import load_problem

LAG, DEAD = 3.0 * STEP, 2.5 * STEP


@pytest.mark.slow
@pytest.mark.parametrize(("shown", "hidden"), [("command", 1.0), ("current", 0.0)])
def test_the_lag_is_found_whichever_is_logged(tmp_path: Path, shown: str, hidden: float) -> None:
    """The motor is named, not its sensors, and its time constant is that of the plant."""
    path = written(tmp_path, feedback="quiet", lag=LAG, shown=shown, effects=("drive_lag", "sensor_delay", "stribeck"))
    result = diagnosed(path)
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"]) == ("drive_lag", "motor")
    assert accepted["parameters"]["motor.lag"]["value"] == pytest.approx(LAG, rel=0.05)
    assert accepted["parameters"]["motor.lag_hidden"]["value"] == pytest.approx(hidden, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["command", "current"])
def test_a_dead_time_before_the_lag_is_the_motors(tmp_path: Path, shown: str) -> None:
    """What begins late to follow is the motor's, in its more general shape, and no late sensor beside it."""
    effects = ("drive_lag", "sensor_delay", "stribeck")
    result = diagnosed(written(tmp_path, feedback="quiet", lag=LAG, shown=shown, effects=effects, dead_time=DEAD))
    (accepted,) = result["accepted"]
    assert (accepted["effect"], accepted["component"], result["verdict"]) == ("drive_lag", "motor", "explained")
    found = {name: item["value"] for name, item in accepted["parameters"].items()}
    assert found["motor.lag"] == pytest.approx(LAG, rel=0.1)
    assert found["motor.dead_time"] == pytest.approx(DEAD, rel=0.1)


def test_a_dead_time_in_a_loop_leaves_the_sensors_their_own_delays(tmp_path: Path) -> None:
    """Whole samples of a stated delay are read earlier, be the dead time of the motor fitted beside it."""
    path = written(tmp_path)
    model = prepare(load_problem(path))
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["channels"]["position"]["delay"] = 2.25 * STEP
    document["drive"]["motor"] |= {"dead_time": {"guess": DEAD, "min": 0.0, "max": 0.1}}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    late = late_of(with_drive(model, load_problem(path).drive))
    assert sorted(late) == ["a", "b", "c"]
    for seconds in late.values():
        assert seconds == pytest.approx({"position": 2 * STEP})
