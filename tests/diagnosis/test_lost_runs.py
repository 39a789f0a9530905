"""Free runs that have gone astray: loosely joined segments tell what is missing, and lead refits near it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import yaml
from diagnosis_cases import ENCODER_STEP, STEP, axis, write_case
from plant import PlantController, Trajectory, reversing_steps

from friction_ocp.diagnosis import refit
from friction_ocp.diagnosis.bench import Bench, open_bench
from friction_ocp.diagnosis.contenders import OF_LOST, beginning_at, displaced, to_refit
from friction_ocp.diagnosis.crew import Crew
from friction_ocp.diagnosis.polishing import loosely
from friction_ocp.diagnosis.refit import NUDGES, best_nudged, completed, nudged, quick_refit
from friction_ocp.diagnosis.screen import Screened, Start
from friction_ocp.effects.effect import Augmentation, Key, Trial
from friction_ocp.estimation.model import Model
from friction_ocp.execution.executor import InProcess
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_recording
from friction_ocp.recording.recording import Channel, Recording
from friction_ocp.simulation.grid import FloatArray
from friction_ocp.statistics.execution import Execution

HERE = Execution(InProcess())
SECONDS, GAIN, UNBALANCE = 4.0, 0.4, 0.25
"""s, N m/rad, N m: the unbalance pulls the arm over as the reference turns it round."""
NAMES = (("unbalance", "motor"), ("stribeck", "motor"), ("quadratic_drag", "motor"), ("asymmetry", "motor"))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Return the bench of a servo whose model lacks a large unbalance."""
    folder = tmp_path_factory.mktemp("lost")
    plain = axis()
    plant = replace(
        plain,
        shafts=(replace(plain.shafts[0], gravity=(UNBALANCE, 0.4)),),
        motors=(replace(plain.motors[0], drive="torque", controller="loop"),),
        controllers=(PlantController("loop", "p", "position", kp=GAIN, sample_time=STEP),),
        sensors=plain.sensors[:1],
    )
    path = write_case(folder, plain)
    time = STEP * np.arange(round(SECONDS / STEP) + 2)
    for k, name in enumerate("abc"):
        rng = np.random.default_rng(k)
        steps = reversing_steps(np.array([0.5, 2.0, 5.0]), (0.3, 0.8), SECONDS, rng)
        wanted = np.interp(time, np.asarray(steps.time), np.asarray(steps.value))
        run = plant.simulate(SECONDS, {"reference.theta": Trajectory(time, wanted, "zero")}, rng)
        channels = {"position": Channel("position", *run.channels["position"], "rad")}
        seen = channels["position"].time
        channels["wanted"] = Channel("wanted", seen, wanted[: seen.size], "rad")
        write_recording(Recording(name, channels), folder / f"{name}.h5")
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    document["controller"] = {"type": "p", "feedback": "position", "kp": GAIN, "output": "torque", "sample_time": STEP}
    document["channels"] = {
        "wanted": {"measures": "reference.theta", "role": "input", "hold": "zero"},
        "position": {"measures": "motor.theta", "resolution": ENCODER_STEP},
    }
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return open_bench(load_problem(path), HERE)


def crew_of(bench: Bench) -> Crew:
    return Crew(bench, HERE, 1, lambda what, share: None)


def test_loosely_joined_segments_tell_what_lost_free_runs_lack(bench: Bench) -> None:
    """The effect that is missing comes first, its size near the truth, wherever the free run has ended."""
    assert bench.current.lost and bench.loose is not None
    first, *others = crew_of(bench).screened_loosely(NAMES)
    assert first.key == ("unbalance", "motor") and first.gain > 2.0 * others[0].gain
    assert first.values["motor.gravity.torque"] == pytest.approx(UNBALANCE, rel=0.3)


def test_a_refit_of_lost_runs_begins_where_loosely_joined_segments_lead(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a tenth of the size and the wrong way round; what is beside the end is no better than what is returned."""
    begun = list[dict[str, float]]()

    def spied(model: Model, values: Mapping[str, float]) -> FloatArray:
        begun.append(dict(values))
        return loosely(model, values)

    monkeypatch.setattr(refit, "loosely", spied)
    (item,) = crew_of(bench).screened_loosely(NAMES[:1])
    known = item.starts[0]
    start = replace(known, sizes=tuple(-0.1 * size for size in known.sizes), shift=dict.fromkeys(known.shift, 0.0))
    found = completed(quick_refit(bench.current, replace(item, starts=(start,))))
    wrong = -0.1 * item.values["motor.gravity.torque"]
    assert [values["motor.gravity.torque"] for values in begun] == [pytest.approx(wrong)]
    assert not found.astray
    assert found.values["motor.gravity.torque"] == pytest.approx(UNBALANCE, rel=0.05)
    best = best_nudged(found, 0)
    assert best.objective == min(found.objective, *(nudged(found, k).objective for k in range(NUDGES)))


def test_the_segments_of_a_footing_need_no_looser_ones(tmp_path: Path) -> None:
    """Where gaps are as wide as noise makes them predictions hold already."""
    bench = open_bench(load_problem(write_case(tmp_path, axis())), HERE)
    assert bench.loose is None and not bench.current.lost
    assert crew_of(bench).screened_loosely(NAMES) == []


def candidate(effect: str, *sizes: float, gain: float = 1.0) -> Screened:
    starts = tuple(Start(Trial(({"size": 1.0},)), (size,), {}) for size in sizes)
    return Screened(effect, "motor", gain, 0.0, starts, Augmentation(cast(Any, None), {"size": 0.0}, ()))


@pytest.mark.parametrize(
    ("gains", "kept"),
    [
        ([5.0, 9.0, 1.0, 8.0, 2.0, 0.0, 0.0], [1, 3, 0]),
        ([0.1, 9.0, 0.2, 0.3, 0.0, 0.0, 0.4], [1, 6, 0]),
        ([0.0, -9.0, 5.0, 0.3, 0.4, 0.0, 9.0], [6, 2, 1, 0]),
        ([1.0, 0.0, 3.0, -np.inf, 0.5, 0.0, 0.0], [0, 1, 2, 3, 4, 5, 6]),
    ],
)
def test_fits_of_loosely_joined_segments_choose_what_lost_runs_are_refitted_with(
    gains: list[float], kept: list[int]
) -> None:
    """What either prediction promises is fitted there; the best two, and what gains half as much, are refitted.

    All are where what is gained there may be chance: less than half the logarithm of a thousand samples. What loses
    more than that was not fitted to its end, and is refitted, too; and what promises most of free runs.
    """
    large, small = candidate("cogging", 1.0, gain=3.0), candidate("load_dependence", 1.0)
    last = [candidate("warm_up", 1.0, gain=0.5 - 0.1 * k) for k in range(OF_LOST)]
    loose = candidate("position_ripple", 1.0, gain=5.0)
    linear = SimpleNamespace(rows=SimpleNamespace(channel=np.zeros(1000), residual=np.ones(1000)))
    bench = SimpleNamespace(current=SimpleNamespace(lost=True, leads_loosely=True, astray=True, linear=linear))
    tried = [large, small, *last[: OF_LOST - 2], loose]
    assert len(tried) == len(gains)

    def screened_loosely(keys: list[Key]) -> list[Screened]:
        return [loose]

    def fitted_loosely(candidates: list[Screened]) -> list[float]:
        assert candidates == tried
        return gains

    crew = SimpleNamespace(bench=bench, screened_loosely=screened_loosely, fitted_loosely=fitted_loosely)
    chosen, unfitted = to_refit(cast(Any, crew), [large, small, *last], [large, small])
    assert [tried.index(item) for item in chosen] == kept
    assert unfitted == []


def test_what_a_more_general_effect_has_is_refitted_beside_it() -> None:
    """An offset beside the eccentricity that has one, however its fit of loosely joined segments ended."""
    offset = candidate("sensor_offset", 1.0, gain=8.0)
    whole = candidate("sensor_eccentricity", 1.0, gain=9.0)
    whole = replace(whole, augmentation=replace(whole.augmentation, off={"size": 0.0, "cosine": 0.0}))
    others = [candidate("cogging", 1.0), candidate("unbalance", 1.0)]
    others = [replace(item, augmentation=replace(item.augmentation, off={item.effect: 0.0})) for item in others]
    linear = SimpleNamespace(rows=SimpleNamespace(channel=np.zeros(1000), residual=np.ones(1000)))
    bench = SimpleNamespace(current=SimpleNamespace(lost=True, leads_loosely=True, astray=True, linear=linear))
    gains = {"sensor_eccentricity": 10.0, "cogging": 90.0, "unbalance": 80.0, "sensor_offset": 20.0}

    def screened_loosely(keys: list[Key]) -> list[Screened]:
        return []

    def fitted_loosely(candidates: list[Screened]) -> list[float]:
        return [gains[item.effect] for item in candidates]

    crew = SimpleNamespace(bench=bench, screened_loosely=screened_loosely, fitted_loosely=fitted_loosely)
    tried = [whole, offset, *others]
    chosen, _ = to_refit(cast(Any, crew), tried, tried)
    assert {item.effect for item in chosen} == {*gains}
    kept, _ = to_refit(cast(Any, crew), tried[2:] + tried[1:2], tried)
    assert {item.effect for item in kept} == {"cogging", "unbalance"}


def test_what_promises_nothing_while_small_is_tried_where_a_model_has_gone_astray() -> None:
    """From where the parameters are and from the guesses; not where the model is near the recordings.

    There others begin at the guesses where the fit is at odds with priors.
    """
    stiffening, play = candidate("stiffening", 1.0, gain=9.0), candidate("backlash", gain=0.0)
    play = replace(play, augmentation=replace(play.augmentation, outright=({"size": 1.0},)))
    guessed = candidate("asymmetry", 1.0)

    def screened_unfitted(keys: list[Key]) -> list[Screened]:
        return [guessed]

    for astray, at_odds, also, begun in (
        (True, False, [play], [guessed, play]),
        (False, True, [], [guessed]),
        (False, False, [], []),
    ):
        current = SimpleNamespace(lost=False, leads_loosely=False, astray=astray, at_odds=at_odds)
        crew = SimpleNamespace(bench=SimpleNamespace(current=current), screened_unfitted=screened_unfitted)
        chosen, unfitted = to_refit(cast(Any, crew), [stiffening], [stiffening, play])
        assert chosen == [stiffening, *also]
        assert unfitted == begun


def test_a_fit_of_loosely_joined_segments_tells_what_is_missing(bench: Bench) -> None:
    """Predictions are straight lines; fits gain most with what is missing, more than twice what others do."""
    crew = crew_of(bench)
    found = {item.key: item for item in crew.screened_loosely(NAMES)}
    first, *others = crew.fitted_loosely([found[key] for key in NAMES])
    assert first > 2.0 * max(others)


def test_a_refit_begins_where_either_prediction_says() -> None:
    """What both ask for begins at both sizes, the looser one's first; what one asks for is tried as well."""
    both = beginning_at(
        [candidate("stribeck", 1.0), candidate("cogging", 2.0)], [candidate("cogging", 3.0, 4.0), candidate("lag", 5.0)]
    )
    sizes = {item.effect: [start.sizes[0] for start in item.starts] for item in both}
    assert sizes == {"stribeck": [1.0], "cogging": [3.0, 2.0], "lag": [5.0]}


@pytest.mark.parametrize("reshaped", [True, False])
def test_what_a_shape_displaced_is_tried_again(reshaped: bool) -> None:
    """Overtones take the place of what was as likely; an effect of its own does not bring its rivals back."""
    stiffening, ripple = candidate("stiffening", 1.0), candidate("torque_ripple", 1.0)
    done = [ripple] * 2 if reshaped else [candidate("cogging", 1.0), ripple]
    rounds = [
        SimpleNamespace(accepted=SimpleNamespace(key=item.key), choice=SimpleNamespace(aliases=(ripple, stiffening)))
        for item in done
    ]
    chosen, known = [candidate("backlash", 1.0)], {stiffening.key: stiffening}
    assert displaced(cast(Any, rounds), known, chosen) == ([stiffening] if reshaped else [])
