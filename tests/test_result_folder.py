"""What is written: every file whole or not at all, and its content as the interface states it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml
from servo_problem import servo_document, write_problem, write_servo

from friction_ocp.estimation.estimate import Estimate, Simulation, identify, simulate
from friction_ocp.problem_file.load import load_problem
from friction_ocp.recording.hdf5 import write_result_series
from friction_ocp.result_document import estimate_document, simulation_document, simulation_series
from friction_ocp.result_folder import fitted_problem, plain_arrays
from friction_ocp.whole_file import whole_file

QUESTION = "how stiff the grease is."
RESULT: dict[str, Any] = {
    "format": str,
    "status": str,
    "message": str,
    "title": str,
    "warnings": list,
    "parameters": {
        "servo.friction.tau_c": {
            "value": float,
            "unit": str,
            "std_error": (float, type(None)),
            "interval95": (list, type(None)),
            "guess": float,
            "verdict": str,
            "traded_with": list,
        }
    },
    "fit": {
        "horizon_s": (float, type(None)),
        "train": {
            "position": {
                "rms": float,
                "mae": float,
                "unit": str,
                "relative": float,
                "relative_norm": float,
                "noise_ratio": float,
                "noise_source": str,
                "by_recording": {"sin_sin-kp100": {"rms": float}},
            }
        },
        "validation": {"position": {"rms": float, "by_recording": {"sin_sin-kp400": {"rms": float}}}},
    },
    "solver": {
        "name": str,
        "iterations": int,
        "seconds": float,
        "build_seconds": float,
        "objective": float,
        "starts": int,
    },
}
"""Keys of result.json that others rely on, and the kinds of their values."""


def assert_has(document: Mapping[str, Any], wanted: Mapping[str, Any], where: str = "result") -> None:
    """Compare keys and kinds of values, level by level."""
    for key, kind in wanted.items():
        assert key in document, f"{where} has no {key}"
        if isinstance(kind, Mapping):
            assert_has(document[key], kind, f"{where}.{key}")
        else:
            assert isinstance(document[key], kind), f"{where}.{key} is {document[key]!r}"


@pytest.fixture(scope="module")
def estimate(tmp_path_factory: pytest.TempPathFactory) -> Estimate:
    """The servo, with a bound that the viscous friction runs into."""
    folder = tmp_path_factory.mktemp("problem")
    document = servo_document()
    document["drive"]["shafts"][0]["friction"]["viscous"] = {"guess": 0.05, "min": 0.04, "max": 0.2, "prior_std": 1.0}
    path = write_problem(folder / "servo.yaml", document)
    path.write_text(f"# Asked: {QUESTION}\n\n{path.read_text(encoding='utf-8')}", encoding="utf-8")
    return identify(load_problem(path))


@pytest.fixture(scope="module")
def simulation(tmp_path_factory: pytest.TempPathFactory) -> Simulation:
    """The servo simulated with its guesses."""
    return simulate(load_problem(write_servo(tmp_path_factory.mktemp("problem"))))


def test_a_result_has_every_key_that_others_rely_on(estimate: Estimate) -> None:
    """Keys and kinds of values."""
    document = estimate_document(estimate)
    assert_has(document, RESULT)
    assert document["format"] == "friction-ocp-result/1"
    assert document["status"] in ("converged", "not_converged")
    assert list(document["parameters"]) == [item.name for item in estimate.parameters]


def test_a_result_is_strict_json(estimate: Estimate) -> None:
    """Where there is no number there is null: a parameter at its bound has no standard error and no interval."""
    document = json.loads(json.dumps(estimate_document(estimate), allow_nan=False))
    bounded = document["parameters"]["servo.friction.viscous"]
    assert (bounded["verdict"], bounded["std_error"], bounded["interval95"]) == ("at_bound", None, None)
    low, high = document["parameters"]["servo.inertia"]["interval95"]
    assert low < document["parameters"]["servo.inertia"]["value"] < high


def test_a_simulation_has_the_same_errors_and_no_parameters(simulation: Simulation) -> None:
    """Its document is strict JSON of its own format."""
    document = json.loads(json.dumps(simulation_document(simulation), allow_nan=False))
    assert document["format"] == "friction-ocp-simulation/1"
    assert_has(document["fit"], RESULT["fit"])
    assert document["parameters"] == {}


def test_the_fitted_problem_is_the_problem_with_its_answer(estimate: Estimate, tmp_path: Path) -> None:
    """Guesses are the fitted values; bounds, prior and opening comment stay; recordings are found from its folder."""
    text = fitted_problem(estimate, tmp_path)
    assert text is not None
    content = yaml.safe_load(text)
    viscous = content["drive"]["shafts"][0]["friction"]["viscous"]
    value = estimate.values["servo.friction.viscous"]
    assert viscous == {"guess": value, "min": 0.04, "max": 0.2, "prior_std": 1.0, "prior_mean": 0.05}
    (tmp_path / "fitted.yaml").write_text(text, encoding="utf-8")
    again = load_problem(tmp_path / "fitted.yaml")
    assert again.question == estimate.problem.question
    assert QUESTION in again.question
    assert [use.recording.sha256 for use in again.recordings] == [
        use.recording.sha256 for use in estimate.problem.recordings
    ]


def test_the_fitted_problem_is_judged_over_the_windows_of_the_fit(estimate: Estimate, tmp_path: Path) -> None:
    """Other guesses make other periods: the windows of the fit are written out, unless the file states its own."""
    windows = replace(estimate, simulation=replace(estimate.simulation, horizon_s=1.9))
    text = fitted_problem(windows, tmp_path)
    assert text is not None
    assert yaml.safe_load(text)["estimation"]["horizon_s"] == 1.9
    stated = windows.problem.text.replace("estimation:", "estimation:\n  horizon_s: 3.0")
    text = fitted_problem(replace(windows, problem=replace(windows.problem, text=stated)), tmp_path)
    assert text is not None
    assert yaml.safe_load(text)["estimation"]["horizon_s"] == 3.0


def test_a_problem_that_its_file_does_not_describe_has_no_fitted_file(estimate: Estimate, tmp_path: Path) -> None:
    """Built from parts, or given further parameters in Python: the result is written without fitted.yaml."""
    assert fitted_problem(replace(estimate, problem=replace(estimate.problem, path=None)), tmp_path) is None
    added = replace(estimate.parameters[0], name="servo.friction.load.coulomb")
    assert fitted_problem(replace(estimate, parameters=(*estimate.parameters, added)), tmp_path) is None


@pytest.mark.parametrize("left", [0, 1])
def test_a_run_that_broke_down_has_no_coherence(simulation: Simulation, left: int) -> None:
    """What is simulated at the first node alone, or nowhere, is a result without coherence."""
    whole = simulation.train[0]
    run = replace(whole, simulated=np.where(np.arange(whole.time.size)[:, None] < left, whole.simulated, np.nan))
    document = simulation_document(replace(simulation, train=(run,)))
    assert document["coherence"][run.name] == {}


def test_the_series_are_measurement_and_simulation_on_one_clock(simulation: Simulation, tmp_path: Path) -> None:
    """result.h5 holds /<recording>/<channel>/{time, measured, simulated}, whose difference has the reported rms."""
    write_result_series(tmp_path / "result.h5", simulation_series(simulation))
    with h5py.File(tmp_path / "result.h5") as file:
        for name, errors in simulation.train_errors["position"][1].items():
            group = file[f"{name}/position"]
            time, measured, simulated = (np.asarray(group[key]) for key in ("time", "measured", "simulated"))
            assert time.shape == measured.shape == simulated.shape
            assert np.all(np.diff(time) > 0)
            assert np.sqrt(np.nanmean((simulated - measured) ** 2)) == pytest.approx(errors.rms)


def test_reports_get_plain_arrays(simulation: Simulation) -> None:
    """Recording, channel, then three arrays."""
    arrays = plain_arrays(simulation_series(simulation))
    assert list(arrays) == ["sin_sin-kp100", "sin_sin-kp400"]
    assert set(arrays["sin_sin-kp100"]["position"]) == {"time", "measured", "simulated"}


def test_a_file_is_renamed_into_place_when_it_is_complete(tmp_path: Path) -> None:
    """Until the writer is done the old content stands."""
    path = tmp_path / "result.json"
    path.write_text("old", encoding="utf-8")

    with whole_file(path) as staged:
        staged.write_text("new", encoding="utf-8")
        assert path.read_text(encoding="utf-8") == "old"
        assert staged.parent == path.parent
    assert path.read_text(encoding="utf-8") == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_could_not_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    """An error or an interrupt in the middle leaves nothing behind."""
    path = tmp_path / "result.json"
    path.write_text("old", encoding="utf-8")

    with pytest.raises(KeyboardInterrupt), whole_file(path) as staged:
        staged.write_text("ha", encoding="utf-8")
        raise KeyboardInterrupt
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]
