"""Segments are cut where small differences grow; the motion that they stand for stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axes import INERTIA, RATE, axis, problem, still_recording

from friction_ocp.drive.parts import Gravity
from friction_ocp.estimation.division import GROWTH, divided
from friction_ocp.estimation.drive_noise import TorqueNoise
from friction_ocp.estimation.first_nodes import suggested_nodes, suggested_point
from friction_ocp.estimation.gap import gap_covariance
from friction_ocp.estimation.model import Model, prepare
from friction_ocp.estimation.node_gaps import NodeGaps
from friction_ocp.estimation.program import Point, Program
from friction_ocp.estimation.stages import relaxed
from friction_ocp.parameters import Free
from friction_ocp.simulation.losses import Squares

SAMPLES, RATE_OF_GROWTH = 60, 40.0
"""Samples of a segment; 1/s, of an axis that gravity pulls off its unstable balance."""


def model_with(phase: float) -> Model:
    """Return an axis without current that gravity holds (phase 0) or pulls away (pi), at small angles."""
    gravity, recording = Gravity(INERTIA * RATE_OF_GROWTH**2, phase), still_recording()
    time = recording.channels["current"].time
    quiet = replace(recording.channels["current"], values=np.zeros(time.size))
    recording = replace(recording, channels={**recording.channels, "current": quiet})
    return prepare(
        problem(
            axis(inertia=Free(INERTIA), gravity=gravity),
            recording,
            segment=SAMPLES,
            process_noise={"motor": 1e-3},
        )
    )


def start_of(model: Model) -> tuple[Program, Point]:
    """Return relaxed segments, all of which start in the balance."""
    program = relaxed(model, model.train, 0.0, Squares())
    return program, Point(
        model.space.guess, tuple(np.zeros_like(part) for part in suggested_nodes(program, model.space.guess))
    )


def test_a_stable_motion_is_left_alone() -> None:
    """A pendulum that hangs: the same program comes back."""
    program, point = start_of(model_with(0.0))
    assert divided(model_with(0.0), program, point) == (program, point)


def test_parts_are_as_short_as_the_growth_asks() -> None:
    """An inverted pendulum: differences grow by exp(rate x time), and each part is allowed the same share of it."""
    model = model_with(np.pi)
    program, point = start_of(model)
    cut, _ = divided(model, program, point)
    longest = RATE * np.log(GROWTH) / RATE_OF_GROWTH
    assert np.max(np.diff(cut.segments[0].first)) <= longest + 1.0
    assert np.min(np.diff(cut.segments[0].first)) > 0.5 * longest
    assert set(program.segments[0].first) <= set(cut.segments[0].first)


def test_the_motion_goes_through_the_new_nodes() -> None:
    """Gaps appear nowhere: what the parts simulate is what the whole segments did."""
    model = model_with(np.pi)
    program, _ = start_of(model)
    point = suggested_point(program, model.space.guess)
    cut, start = divided(model, program, point)
    before, after = program.simulate(0, point), cut.simulate(0, start)
    assert after.y == pytest.approx(before.y, abs=1e-9 * np.max(np.abs(before.y)))
    inner = ~np.isin(cut.segments[0].first[1:-1], program.segments[0].first)
    jumps = np.abs(after.end[:-1] - start.nodes[0][1:])[inner]
    assert np.max(jumps) <= 1e-9 * np.max(np.abs(start.nodes[0]))


def test_a_cut_allows_no_more_noise() -> None:
    """Gaps of the parts add up to the gap of the whole in what no noise enters."""
    model = model_with(0.0)
    item, none = model.train[0], np.zeros(1)
    whole = gap_covariance(model, item, none)[0]
    parts = gap_covariance(model, item, np.zeros(4), np.array([0.1, 0.2, 0.3, 0.4])).sum(axis=0)
    assert parts == pytest.approx(whole)


def test_a_cut_of_segments_that_noise_joins_allows_no_more() -> None:
    """The same where gaps hold what a drive makes of its noise."""
    model = model_with(0.0)
    item, numbers = model.train[0], model.space.numbers_by_path(model.space.guess, model.train[0].name)
    whole = np.arange(0, 8 * SAMPLES, SAMPLES)
    cut = np.sort([*whole, whole[4] + SAMPLES // 4, whole[4] + SAMPLES // 2])

    def jumps(first: np.ndarray) -> np.ndarray:
        gaps = NodeGaps(model, TorqueNoise({}, {item.name: numbers}), item, first, {})
        roots = np.linalg.inv(gaps.roots())
        return roots @ roots.transpose(0, 2, 1)

    assert jumps(cut)[4:7].sum(axis=0) == pytest.approx(jumps(whole)[4])
