"""The makers of blind cases: honest machines, effects that vanish with their size, seeds that repeat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind.cases import Case, Planted, case_of, read_answer, write_fresh, write_quiet
from blind.catalogue import CATALOGUE
from blind.document import truth, with_true
from blind.draw import BLOCK, clash, cycled, draw, drawn_kind, make
from blind.folder import write_problem
from blind.machines import MACHINES, Machine, plant_of
from blind.motions import KINDS
from blind.outside import OUTSIDE
from blind.recording import Hidden, gone_on, run, silent
from blind.scales import measure
from blind.site import Site
from blind.visibility import Excited, View, size_for
from plant import PlantRipple

import friction_ocp as fo
from friction_ocp.estimation.first_nodes import suggested_nodes
from friction_ocp.estimation.model import prepare
from friction_ocp.estimation.program import Point
from friction_ocp.estimation.stages import free_run
from friction_ocp.recording.hdf5 import read_recording
from friction_ocp.simulation.losses import Squares

SEED = 5
EFFECTS = CATALOGUE | OUTSIDE
STIFF = {"compliance": 1e-3, "presliding": 1e-4}
"""Effects that get stiff as they vanish, and the sizes that the step of the plant can follow."""


def short(name: str, samples: int = 1500) -> Machine:
    """Return a machine with short recordings."""
    return replace(MACHINES[name](), samples=samples)


def free_run_ratios(path: Path) -> np.ndarray:
    """Return the noise ratio of each channel, free running from rest."""
    model = prepare(fo.load_problem(path))
    program = free_run(model, model.train, 0.0, Squares(), None)
    nodes = suggested_nodes(program, model.space.guess)
    point = Point(model.space.guess, tuple(np.zeros_like(item) for item in nodes))
    error = program.simulate(0, point).y - model.train[0].measured
    return np.sqrt(np.nanmean(error**2, axis=0)) / model.noise


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", MACHINES)
def test_the_true_model_leaves_the_noise(name: str, kind: str, tmp_path: Path) -> None:
    """Without anything hidden, plant and model with the true numbers differ by the stated noise in every channel."""
    machine = short(name, 1000)
    channels, _ = run(machine, Hidden(machine.plant()), kind, (SEED,))
    path = write_problem(tmp_path, machine, truth(machine.document), {"a": channels}, {})
    sampling_and_step = 4 / np.sqrt(2 * 1000) + 0.06
    assert free_run_ratios(path) == pytest.approx(1.0, abs=sampling_and_step)


def difference(machine: Machine, hidden: Hidden) -> float:
    """Return how far the response lies from the one with nothing hidden, over the noise."""
    view = View(machine, (Excited("steps", (SEED, 1)),))
    return float(np.sqrt(np.mean(view.difference(hidden, view.runs[0]) ** 2)))


@pytest.mark.parametrize("name", ["telescope", "servo", "feed"])
def test_effects_vanish_with_their_size(name: str) -> None:
    """Every effect, at every place, changes the response less as it gets smaller, down to nothing."""
    machine = short(name, 800)
    scales = measure(machine, "steps", (SEED, 1))
    grave = {}
    for effect in EFFECTS.values():
        for place in effect.places(machine):

            def at(size: float, effect=effect, place=place) -> float:
                site = Site(machine, scales, Hidden(machine.plant()), place, size)
                return difference(machine, effect.inject(site, np.random.default_rng(SEED)))

            smallest = STIFF.get(effect.name, 1e-6)
            grave[effect.name, place] = at(0.3)
            assert at(smallest) < 0.05 * grave[effect.name, place] + 1e-3, (effect.name, place)
    assert np.mean([value > 1.0 for value in grave.values()]) > 0.8


@pytest.mark.parametrize("name", ["telescope", "robot"])
def test_a_fitted_number_hides_no_gap(name: str) -> None:
    """Fitted numbers that are a little off show nothing once they are fitted; a known one that is off does."""
    machine = short(name)
    view = View(machine, (Excited("steps", (SEED, 2)), Excited("moves", (SEED, 3))))
    shafts = ("drive", "shafts", 0)
    fitted, known = (*shafts, "friction", "tau_c"), ("drive", "motor", "torque_constant")
    for keys, factor, seen in ((fitted, 1.01, False), (known, 1.1, True)):
        changed = plant_of(truth(with_true(machine.document, keys, factor)), machine)
        assert view.ratio(Hidden(machine.plant())) == pytest.approx(1.0, abs=1e-6)
        assert (view.ratio(Hidden(changed)) > 1.3) == seen


def test_sizes_follow_the_wanted_visibility() -> None:
    """The size is found at which a gap of the wanted noise ratio is left."""
    machine = short("servo")
    view, scales = View(machine, (Excited("steps", (SEED, 4)),)), measure(machine, "steps", (SEED, 4))

    def build(size: float) -> Hidden:
        site = Site(machine, scales, Hidden(machine.plant()), "motor", size)
        return CATALOGUE["cogging"].inject(site, np.random.default_rng(SEED))

    (small, low), (large, high) = (size_for(view, build, target) for target in (3.0, 10.0))
    assert low == pytest.approx(3.0, rel=0.25) and high == pytest.approx(10.0, rel=0.25) and small < large


def test_a_third_of_all_cases_has_no_effect() -> None:
    """Kinds come in fixed shares, in an order of the seed, and are counted rightly."""
    drawn = [drawn_kind(SEED, index) for index in range(4 * len(BLOCK))]
    kinds = [kind for kind, _ in drawn]
    assert kinds.count("none") >= len(kinds) / 3 and set(kinds) == set(BLOCK)
    for kind in set(BLOCK):
        assert [count for name, count in drawn if name == kind] == list(range(kinds.count(kind)))
    assert kinds != [drawn_kind(SEED + 1, index)[0] for index in range(len(kinds))]


def test_every_effect_takes_its_turn() -> None:
    """In as many cases as there are effects every one is drawn once."""
    names = list(CATALOGUE)
    for turn in (0, 1):
        drawn = [cycled(names, SEED, turn * len(names) + k) for k in range(len(names))]
        assert sorted(drawn) == sorted(names)


def test_two_effects_do_not_undo_each_other() -> None:
    """Effects that rewrite the same numbers of one part are never planted together."""

    def item(effect: str, component: str) -> Planted:
        return Planted(effect, component, 0.1, 0, 5.0)

    assert clash(item("stribeck", "motor"), item("asymmetry", "motor"))
    assert not clash(item("stribeck", "motor"), item("asymmetry", "load"))
    assert not clash(item("stribeck", "motor"), item("cogging", "motor"))
    assert clash(item("cogging", "motor"), item("cogging", "motor"))


def test_what_cannot_be_told_apart_is_an_equivalent_answer() -> None:
    """On rigidly joined shafts a constant torque is one, and on the motor an offset of the current that drives it."""
    case = Case(SEED, 0, "one", "mount")
    assert case.equivalents(Planted("constant_torque", "gear", 0.1, 0, 5.0)) == [
        ("constant_torque", "gear"),
        ("constant_torque", "motor"),
        ("sensor_offset", "current"),
    ]
    assert case.equivalents(Planted("unbalance", "gear", 0.1, 0, 5.0)) == [("unbalance", "gear")]
    assert case.equivalents(Planted("parameter_error", "drive", 0.1, 0, 5.0)) == [
        ("parameter_error", "drive"),
        ("parameter_error", "motor"),
        ("sensor_gain", "current"),
    ]
    assert case.equivalents(Planted("stribeck", "axis", 0.1, 0, 5.0)) == [("stribeck", "axis")]


def index_of(kind: str) -> int:
    """Return the first case of a kind."""
    return next(index for index in range(200) if drawn_kind(SEED, index)[0] == kind)


@pytest.mark.parametrize("kind", ["none", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("one", "outside"))])
def test_cases_load_and_repeat(kind: str, tmp_path: Path) -> None:
    """A written case passes the check, its answer makes the same plant again, and the seed the same case."""
    index = index_of(kind)
    case = make(SEED, index, tmp_path)
    folder = tmp_path / "cases" / case.name
    problem = fo.load_problem(folder / "problem.yaml")
    assert not fo.check(problem)
    assert len(problem.train) == 3 and len(problem.validation) == 2 and len(problem.drive.channels) <= 4
    again = case_of(read_answer(tmp_path, case.name))
    assert again == case == make(SEED, index, tmp_path)
    assert (kind == "none") == (not case.planted)
    quiet = read_recording(write_quiet(again, tmp_path / "quiet")[0])
    noisy = read_recording(folder / "train0.h5")
    for channel in problem.drive.channels:
        values, true = (item.channels[channel.name].values for item in (noisy, quiet))
        floor = channel.noise_std or (channel.resolution or 0.0) / np.sqrt(12)
        assert np.std(values - true) == pytest.approx(floor, rel=0.05, abs=1e-9), channel.name
    fresh = read_recording(write_fresh(again, tmp_path / "fresh")[0])
    assert set(fresh.channels) == set(noisy.channels)
    assert not np.array_equal(fresh.channels["motor_position"].values, noisy.channels["motor_position"].values)


def test_the_name_of_a_case_says_nothing() -> None:
    """Neither the folder nor the text of a problem file depends on what is hidden, only on seed and number."""
    one = Case(SEED, 3, "one", "servo", (Planted("cogging", "motor", 0.1, 0, 5.0),))
    assert one.name == Case(SEED, 3, "none", "servo").name
    assert one.make_machine().document == Case(SEED, 3, "none", "servo").make_machine().document


@pytest.mark.slow
def test_all_cases_of_a_block_can_be_drawn() -> None:
    """A block holds what it promises, every effect within the bounds of visibility."""
    for index in range(len(BLOCK)):
        case = draw(SEED, index)
        assert len(case.planted) == {"none": 0, "two": 2}.get(case.kind, 1)
        hidden = case.hidden()
        channels, _ = run(case.make_machine(), replace(hidden, plant=silent(hidden.plant)), "moves", (SEED, index))
        assert all(np.all(np.isfinite(values)) for values in channels.values())


def test_a_periodic_torque_begins_anywhere() -> None:
    """The same wave, later: as if the recording had begun after a share of its period."""
    wave, share = PlantRipple(0.5, (1.0, 0.3), (-0.4, 0.2)), 0.3
    later = gone_on(wave, share)
    time = np.linspace(0.0, 1.0, 50)

    def at(ripple: PlantRipple, when: np.ndarray) -> np.ndarray:
        return sum(cosine * np.cos(rate * when) + sine * np.sin(rate * when) for cosine, sine, rate in ripple.rows())

    assert at(later, time) == pytest.approx(at(wave, time + share * wave.period))
