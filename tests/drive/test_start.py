"""The state that measured motion suggests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plant import Plant, PlantController, PlantFriction, PlantMotor, PlantSensor, PlantShaft
from twin import Bench, drive_of

from friction_ocp.drive.parts import Channel, Drive, Shaft, Transmission

ROUNDING = 1e-12


def started(bench: Bench, measured: dict[str, float], rates: dict[str, float], inputs: list[float]) -> dict[str, float]:
    """Return the start state by name."""
    y, dy = ([values.get(name, 0.0) for name in bench.stepped.output_names] for values in (measured, rates))
    state = np.asarray(bench.stepped.start(y, dy, [0.0] * len(y), inputs, bench.numbers)).ravel()
    return dict(zip(bench.stepped.state_names, state, strict=True))


def test_one_channel_suggests_the_whole_chain() -> None:
    """An angle channel gives angle and speed of its shaft, and through the ratios, untwisted, of all others."""
    channel = Channel("encoder", "middle.theta", gain=2.0, offset=0.5)
    shafts = tuple(Shaft(name, 0.1) for name in ("motor", "middle", "load"))
    joints = (Transmission("motor", "middle", -4.0), Transmission("middle", "load", 3.0, 100.0))
    bench = Bench(Drive(shafts, joints, channels=(channel,)))
    state = started(bench, {"encoder": 2.5}, {"encoder": 6.0}, [])
    assert state == pytest.approx(
        {"motor.theta": -4.0, "load.theta": 1.0 / 3.0, "motor.omega": -12.0, "load.omega": 1.0}, rel=ROUNDING
    )


@pytest.mark.parametrize("omega", [30.0, -30.0])
def test_bristles_start_in_steady_motion(omega: float) -> None:
    """Well above the Stribeck speed a bristle starts at the deflection of its level in that direction."""
    friction = PlantFriction("lugre", (0.1, 0.12), 0.15, 1.0, sigma0=(200.0, 100.0))
    plant = Plant((PlantShaft("motor", 0.01, friction),), (), (PlantMotor("drive", "motor"),))
    state = started(Bench(drive_of(plant, {"drive.current": 0.0})), {}, {"motor.theta": omega}, [0.0])
    assert state["motor.friction.z"] == pytest.approx(0.1 / 200.0 if omega > 0 else -0.12 / 100.0, rel=ROUNDING)


@pytest.mark.parametrize("omega", [1e-3, -1e-3])
def test_a_bristle_of_slow_motion_starts_all_bent(omega: float) -> None:
    """Slow is what leaves an inertia time to swing on its bristle; a precise axis slides at speeds far below that of
    others' friction, and its law need not have a speed of its own."""
    friction = PlantFriction("dahl", 30.0, sigma0=3e6)
    plant = Plant((PlantShaft("axis", 900.0, friction),), (), (PlantMotor("drive", "axis"),))
    state = started(Bench(drive_of(plant, {"drive.current": 0.0})), {}, {"axis.theta": omega}, [0.0])
    assert state["axis.friction.z"] == pytest.approx(np.sign(omega) * 30.0 / 3e6, rel=ROUNDING)


@pytest.mark.parametrize("lag", [0.0, 0.02])
@pytest.mark.parametrize("torque, acceleration", [(0.05, 0.0), (-0.04, 0.0), (0.09, 3.0)])
def test_at_rest_a_bristle_holds_what_drives_the_shaft(torque: float, acceleration: float, lag: float) -> None:
    """Its deflection balances the torque that does not accelerate the shaft, with the stiffness of its side.

    A motor that lags behind its command has caught up with it.
    """
    friction = PlantFriction("lugre", (0.1, 0.12), 0.15, 1.0, sigma0=(200.0, 100.0))
    plant = Plant((PlantShaft("motor", 0.01, friction),), (), (PlantMotor("drive", "motor"),))
    drive = drive_of(plant, {"drive.current": 0.0})
    bench = Bench(replace(drive, motors=(replace(drive.motors[0], lag=lag),)))
    bend = [acceleration if name == "motor.theta" else 0.0 for name in bench.stepped.output_names]
    still = [0.0] * len(bend)
    state = np.asarray(bench.stepped.start(still, still, bend, [torque], bench.numbers)).ravel()
    deflection = state[bench.stepped.state_names.index("motor.friction.z")]
    held = torque - 0.01 * acceleration
    assert deflection == pytest.approx(held / (200.0 if held > 0 else 100.0), rel=1e-6)


def test_a_bristle_at_rest_holds_no_more_than_breakaway() -> None:
    """What noise of the acceleration asks for beyond its reach is cut off."""
    friction = PlantFriction("lugre", (0.1, 0.12), 0.15, 1.0, sigma0=(200.0, 100.0))
    plant = Plant((PlantShaft("motor", 0.01, friction),), (), (PlantMotor("drive", "motor"),))
    bench = Bench(drive_of(plant, {"drive.current": 0.0}))
    still = [0.0] * len(bench.stepped.output_names)
    state = np.asarray(bench.stepped.start(still, still, still, [5.0], bench.numbers)).ravel()
    assert state[bench.stepped.state_names.index("motor.friction.z")] == pytest.approx(0.15 / 200.0, rel=1e-3)


def test_a_sampled_controller_starts_with_the_samples_of_steady_motion() -> None:
    """The angles of the two ticks before are those of uniform motion, seen through the feedback channel."""
    loop = PlantController("loop", "pd", "seen", kp=2.0, kd=0.1, sample_time=0.01)
    motor = PlantMotor("drive", "motor", "torque", controller="loop")
    sensor = PlantSensor("seen", "motor.theta", gain=2.0, offset=0.5)
    plant = Plant((PlantShaft("motor", 0.01),), (), (motor,), (loop,), (sensor,))
    measured, rates = {"seen": 1.5, "motor.theta": 0.5, "motor.omega": 2.0}, {"seen": 4.0, "motor.theta": 2.0}
    state = started(Bench(drive_of(plant, {"reference.theta": 0.0})), measured, rates, [0.0])
    assert [state[f"controller.previous{k}"] for k in (1, 2)] == pytest.approx([1.46, 1.42], rel=ROUNDING)
