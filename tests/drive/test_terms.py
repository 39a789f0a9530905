"""Optional terms of parts in smooth motion: the stepped drive against an adaptive solver of independent equations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from plant import Trajectory
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from twin import Bench

from friction_ocp.drive.dae_form import dae
from friction_ocp.drive.inputs import TIME
from friction_ocp.drive.parts import (
    Channel,
    Cogging,
    Disturbance,
    Drive,
    Eccentricity,
    Hysteresis,
    KinematicError,
    LoopSprings,
    Motor,
    SecondStage,
    Shaft,
    TorqueRipple,
    Transmission,
)
from friction_ocp.drive.stepping import SteppedDrive, stepped
from friction_ocp.drive.values import drive_leaves
from friction_ocp.errors import FrictionOcpError
from friction_ocp.friction.bristle import LuGre
from friction_ocp.friction.composite import Bristle, BristleSprings, with_bristle
from friction_ocp.friction.element import FrictionElement, LoadDependence
from friction_ocp.friction.modifiers import Ripple, WarmUp
from friction_ocp.friction.static import Coulomb, CoulombViscous, Polyline, Stribeck, Viscous
from friction_ocp.parameters import Free

DURATION = 0.4
STEP_ERROR = 3e-4
"""Relative error of the second-order step of 1 ms on these motions."""
ORDER = 1.8
"""Order 2 less what the third order contributes at 2 ms."""
J, BASE, RAMP, TEMPERATURE = 0.01, 0.35, 0.9, 35.0
INPUTS = {
    "torque": Trajectory(np.array([0.0, DURATION]), np.array([BASE, BASE + RAMP * DURATION]), "linear"),
    "temperature": TEMPERATURE,
}
Rates = Callable[[float, Sequence[float]], list[float]]


def command(t: float) -> float:
    return BASE + RAMP * t


def wave(amplitudes: Sequence[float], period: float, at: float, derivative: int = 0) -> float:
    """Return the wave of cosine and sine parts, order by order, or a derivative of it by its argument."""
    parts = [complex(cosine, -sine) for cosine, sine in zip(amplitudes[::2], amplitudes[1::2], strict=True)]
    rates = 2j * np.pi / period * np.arange(1, 1 + len(parts))
    return float(np.sum(np.real(parts * rates**derivative * np.exp(rates * at))))


@dataclass(frozen=True)
class Case:
    """A drive, its states at the start in their order, and the same motion as differential equations."""

    drive: Drive
    initial: dict[str, float]
    rates: Rates

    def exact(self) -> np.ndarray:
        """Return (states, samples) every 4 ms."""
        times = np.linspace(0.0, DURATION, 101)
        start = list(self.initial.values())
        return solve_ivp(self.rates, (0.0, DURATION), start, "DOP853", times, rtol=1e-12, atol=1e-13).y

    def errors(self, step: float) -> np.ndarray:
        """Return the root mean square error of every state over that of the state."""
        run = Bench(self.drive).run(DURATION, INPUTS, self.initial, step, every=4e-3)
        exact = self.exact()
        found = np.array([run[name] for name in self.initial])
        return np.sqrt(np.mean((found - exact) ** 2, axis=1) / np.mean(exact**2, axis=1))


def axis(friction: FrictionElement, motor: Motor | None = None, shaft: Shaft | None = None) -> Drive:
    """One mass under a torque."""
    shaft = replace(shaft or Shaft("axis", J), friction=friction)
    channels = (Channel("torque", "servo.torque", "input"), Channel("temperature", "temperature", "input"))
    return Drive((shaft,), (), (motor or Motor("servo", "axis"),), None, (*channels, Channel("theta", "axis.theta")))


MOVING = {"axis.theta": 0.3, "axis.omega": 8.0}
LAW = CoulombViscous(0.1, 0.02)
PLAIN = FrictionElement(LAW)
AMPLITUDES, PERIOD = (0.2, -0.3), 0.9
WARM = WarmUp(0.01, -0.3, 0.15, 20.0)


def one_mass(torque: Callable[[float, float, float], float]) -> Rates:
    """Return the equations of one mass under torque(t, theta, omega)."""
    return lambda t, x: [x[1], torque(t, x[0], x[1]) / J]


def risen(t: float) -> float:
    return 1 - float(np.exp(-t / 0.15))


def warmth(t: float) -> float:
    return 1 + 0.01 * (TEMPERATURE - 20) - 0.3 * risen(t)


def warmed(t: float, x: Sequence[float]) -> list[float]:
    _, omega, warm = x
    torque = 0.1 * (1 - 0.3 * warm) + 0.02 * omega * (1 - 0.7 * warm)
    return [omega, (command(t) - torque) / J, (0.4 + 0.6 * torque * omega / 5.0 - warm) / 0.15]


def bristle(t: float, x: Sequence[float]) -> list[float]:
    theta, omega, z = x
    level = (0.1 + 0.05 * np.exp(-((omega / 2.0) ** 2))) * (1 + wave(AMPLITUDES, PERIOD, theta)) * warmth(t)
    rate = omega - 1.0 * abs(omega) / level * z
    return [omega, (command(t) - 1.0 * z - 0.05 * rate - 0.01 * warmth(t) * omega) / J, rate]


def pair(joint: Transmission, motor: Motor | None = None) -> Drive:
    """Motor and load on an elastic gear of ratio 5, which vibrate at 49 rad/s."""
    shafts = (Shaft("axis", J, PLAIN), Shaft("load", 0.5, FrictionElement(Viscous(0.1))))
    channels = (Channel("torque", "servo.torque", "input"), Channel("theta", "axis.theta"))
    return Drive(shafts, (joint,), (motor or Motor("servo", "axis"),), None, channels)


RATIO, STIFFNESS, DAMPING = 5.0, 400.0, 0.5
ERROR, ERROR_PERIOD = (0.004, -0.003), 1.1
LOOP_TORQUE, LOOP_TWIST = 1.5, 0.02
SPRING = Transmission("axis", "load", RATIO, STIFFNESS, DAMPING)
PAIR_MOVING = {"axis.theta": 0.2, "load.theta": 0.01, "axis.omega": 15.0, "load.omega": 2.0}


STAGE, ROUND = (900.0, 0.02), 0.4


def staged(twist: float) -> float:
    """Return the torque of a second stage: a spring between twist and k (twist - 0.02), rounded over 0.4 of that."""
    stiffness, begin = STAGE
    sharp = begin * np.sqrt(1 - ROUND**2)
    soft = np.hypot(twist - sharp, ROUND * begin) - np.hypot(twist + sharp, ROUND * begin)
    return stiffness * (twist + soft / (2 * np.sqrt(1 - ROUND**2)))


def two_masses(
    cubic: float = 0.0, error: Sequence[float] = (0.0, 0.0), loop: float = 0.0, stage: float = 0.0
) -> Callable[[float, Sequence[float]], list[float]]:
    """Return the equations of the pair with a cubic spring, a kinematic error over the motor angle, and a loop."""

    def rates(t: float, x: Sequence[float]) -> list[float]:
        q, p, v, w = x[:4]
        z = x[4] if len(x) > 4 else 0.0
        transfer = 1 / RATIO + wave(error, ERROR_PERIOD, q, 1)
        twist, rate = q / RATIO + wave(error, ERROR_PERIOD, q) - p, transfer * v - w
        torque = STIFFNESS * twist + cubic * twist**3 + DAMPING * rate + loop * z / LOOP_TWIST + stage * staged(twist)
        motor = (command(t) - 0.1 - 0.02 * v - transfer * torque) / J
        slip = [rate - abs(rate) * z / LOOP_TWIST] if len(x) > 4 else []
        return [v, w, motor, (torque - 0.1 * w) / 0.5, *slip]

    return rates


RIGID_ERROR = (0.008, -0.006)
OVERTONES = (*RIGID_ERROR, 0.0, 0.001, -0.0005, 0.0)
LOADED_ERROR, RIGID_SHARE = (6e-4, -8e-4), 0.2
"""An error whose inertial torque does not turn the load of the joint, at which friction has a kink."""


def geared(error: Sequence[float] = RIGID_ERROR, share: float = 0.0) -> Drive:
    """Motor and load joined rigidly, the ratio rippling; the friction of the motor may grow with the load."""
    ripple = KinematicError(error[0], error[1], ERROR_PERIOD, *error[2:])
    joint = Transmission("axis", "load", RATIO, kinematic_error=ripple)
    load = None if share == 0.0 else LoadDependence(share)
    shafts = (Shaft("axis", J, FrictionElement(LAW, load)), Shaft("load", 0.5, FrictionElement(Viscous(0.1))))
    channels = (Channel("torque", "servo.torque", "input"), Channel("load", "load.theta"))
    return Drive(shafts, (joint,), (Motor("servo", "axis"),), None, channels)


def rigid(error: Sequence[float] = RIGID_ERROR, share: float = 0.0) -> Rates:
    """Return the equations of two masses whose angles are tied by load = motor / ratio + error(motor)."""

    def rates(t: float, x: Sequence[float]) -> list[float]:
        q, v = x
        slope, bend = 1 / RATIO + wave(error, ERROR_PERIOD, q, 1), wave(error, ERROR_PERIOD, q, 2)
        # the joint carries T = 0.5 (slope a + bend v^2) + 0.1 slope v, the motor slope T and the friction share |T| / 5
        known, per_a = 0.5 * bend * v**2 + 0.1 * slope * v, 0.5 * slope
        driving = command(t) - 0.1 - 0.02 * v
        for side in (1.0, -1.0):
            lever = slope + side * share / RATIO
            a = (driving - lever * known) / (J + lever * per_a)
            if side * (known + per_a * a) >= 0:
                return [v, a]
        raise AssertionError("the joint jams")

    return rates


LAG = 0.03
LAGGED = replace(
    axis(PLAIN, Motor("servo", "axis", 0.4, lag=LAG, saturation=0.2)),
    channels=(
        Channel("torque", "servo.current_command", "input"),
        Channel("temperature", "temperature", "input"),
        Channel("current", "servo.current"),
    ),
)


def lagged(t: float, x: Sequence[float]) -> list[float]:
    torque = 0.4 * x[2] / np.sqrt(1 + 0.2 * x[2] ** 2)
    return [x[1], (torque - 0.1 - 0.02 * x[1]) / J, (command(t) - x[2]) / LAG]


KT, OHMS, IRON = 0.4, 0.5, 0.3


def saturating(share: float) -> Case:
    """Return a motor under a voltage whose back-EMF lacks a share of the torque that its iron does."""
    motor = Motor("servo", "axis", KT, OHMS, saturation=IRON, saturation_in_emf=share)
    driven = Channel("torque", "servo.voltage", "input")
    drive = replace(axis(PLAIN, motor), channels=(driven, *axis(PLAIN, motor).channels[1:]))

    def rates(t: float, x: Sequence[float]) -> list[float]:
        def left(current: float) -> float:
            return 1.0 / np.sqrt(1.0 + IRON * current**2)

        def missing(current: float) -> float:
            return OHMS * current + KT * x[1] * (1.0 - share * (1.0 - left(current))) - command(t)

        current = float(brentq(missing, -50.0, 50.0, xtol=1e-13))
        return [x[1], (KT * current * left(current) - 0.1 - 0.02 * x[1]) / J]

    return Case(drive, MOVING, rates)


TAILS: dict[float, Callable[[float], float]] = {
    -1.0: lambda fall: 1.0 - fall,
    0.0: lambda fall: np.exp(-fall),
    1.0: lambda fall: 1.0 / (1.0 + fall),
    2.0: lambda fall: 1.0 / np.sqrt(1.0 + 2.0 * fall),
}
"""What is left of a saturating torque, by tail."""


CASES: dict[str, Case] = {
    "rigid kinematic error": Case(geared(), MOVING, rigid()),
    "loaded rigid kinematic error": Case(geared(LOADED_ERROR, RIGID_SHARE), MOVING, rigid(LOADED_ERROR, RIGID_SHARE)),
    "rigid kinematic error with overtones": Case(geared(OVERTONES), MOVING, rigid(OVERTONES)),
    "stiffening": Case(pair(replace(SPRING, stiffening=2e5)), PAIR_MOVING, two_masses(2e5)),
    "second stage": Case(
        pair(replace(SPRING, second_stage=SecondStage(*STAGE, ROUND))), PAIR_MOVING, two_masses(stage=1.0)
    ),
    "kinematic error": Case(
        pair(replace(SPRING, kinematic_error=KinematicError(*ERROR, ERROR_PERIOD))),
        PAIR_MOVING,
        two_masses(error=ERROR),
    ),
    "transmission hysteresis": Case(
        pair(replace(SPRING, hysteresis=Hysteresis(LOOP_TORQUE, LOOP_TWIST))),
        PAIR_MOVING | {"axis-load.hysteresis.z": 0.002},
        two_masses(loop=LOOP_TORQUE),
    ),
    "lag and saturation": Case(LAGGED, MOVING | {"servo.lagged": 0.2}, lagged),
    "saturation of a torque": Case(
        axis(PLAIN, Motor("servo", "axis", 0.5, saturation=0.8)),
        MOVING,
        one_mass(lambda t, q, v: command(t) / np.sqrt(1 + 0.8 * (command(t) / 0.5) ** 2) - 0.1 - 0.02 * v),
    ),
    **{
        f"saturation with a tail of {tail}": Case(
            axis(PLAIN, Motor("servo", "axis", 0.5, saturation=0.1, saturation_tail=tail)),
            MOVING,
            one_mass(lambda t, q, v, kept=kept: command(t) * kept(0.05 * (command(t) / 0.5) ** 2) - 0.1 - 0.02 * v),
        )
        for tail, kept in TAILS.items()
    },
    **{f"back-EMF that saturates by {share:g}": saturating(share) for share in (0.0, 0.5, 1.0)},
    "cogging": Case(
        axis(PLAIN, Motor("servo", "axis", cogging=Cogging(0.05, 0.08, PERIOD))),
        MOVING,
        one_mass(lambda t, q, v: command(t) + wave((0.05, 0.08), PERIOD, q) - 0.1 - 0.02 * v),
    ),
    "cogging with overtones": Case(
        axis(PLAIN, Motor("servo", "axis", cogging=Cogging(0.05, 0.08, PERIOD, 0.03, -0.02, None, 0.04))),
        MOVING,
        one_mass(
            lambda t, q, v: command(t) + wave((0.05, 0.08, 0.03, -0.02, 0, 0.04), PERIOD, q) - 0.1 - 0.02 * v,
        ),
    ),
    "torque ripple": Case(
        axis(PLAIN, Motor("servo", "axis", share=0.9, torque_ripple=TorqueRipple(*AMPLITUDES, PERIOD))),
        MOVING,
        one_mass(lambda t, q, v: 0.9 * command(t) * (1 + wave(AMPLITUDES, PERIOD, q)) - 0.1 - 0.02 * v),
    ),
    "disturbance": Case(
        axis(PLAIN, shaft=Shaft("axis", J, disturbance=Disturbance(0.1, -0.06, 0.07))),
        MOVING,
        one_mass(lambda t, q, v: command(t) + wave((0.1, -0.06), 0.07, t) - 0.1 - 0.02 * v),
    ),
    "friction ripple": Case(
        axis(FrictionElement(LAW, ripple=Ripple(*AMPLITUDES, PERIOD))),
        MOVING,
        one_mass(lambda t, q, v: command(t) - 0.1 * (1 + wave(AMPLITUDES, PERIOD, q)) - 0.02 * v),
    ),
    "friction ripple, stribeck": Case(
        axis(FrictionElement(Stribeck(0.1, 0.2, 6.0, 0.02), ripple=Ripple(*AMPLITUDES, PERIOD))),
        MOVING,
        one_mass(
            lambda t, q, v: (
                command(t) - (0.1 + 0.1 * np.exp(-((v / 6.0) ** 2))) * (1 + wave(AMPLITUDES, PERIOD, q)) - 0.02 * v
            )
        ),
    ),
    "warm-up": Case(
        axis(FrictionElement(LAW, warm_up=WARM)),
        MOVING,
        one_mass(lambda t, q, v: command(t) - (0.1 + 0.02 * v) * warmth(t)),
    ),
    "warm-up begun warm": Case(
        axis(FrictionElement(LAW, warm_up=replace(WARM, begun=0.4))),
        MOVING,
        one_mass(
            lambda t, q, v: (
                command(t) - (0.1 + 0.02 * v) * (1 + 0.01 * (TEMPERATURE - 20) - 0.3 * (0.4 + 0.6 * risen(t)))
            )
        ),
    ),
    "warm-up of viscous friction": Case(
        axis(FrictionElement(LAW, warm_up=replace(WARM, viscous_excess=-0.4))),
        MOVING,
        one_mass(lambda t, q, v: command(t) - 0.1 * warmth(t) - 0.02 * v * (warmth(t) - 0.4 * risen(t))),
    ),
    "warm-up by losses": Case(
        axis(FrictionElement(LAW, warm_up=WarmUp(0.0, -0.3, 0.15, 20.0, -0.4, 0.6, 5.0))),
        MOVING | {"axis.friction.warmth": 0.2},
        warmed,
    ),
    "warm-up and ripple, polyline": Case(
        axis(FrictionElement(Polyline(0.1, (0.02,)), ripple=Ripple(*AMPLITUDES, PERIOD), warm_up=WARM)),
        MOVING,
        one_mass(
            lambda t, q, v: command(t) - (0.1 * (1 + wave(AMPLITUDES, PERIOD, q)) + 0.02 * v) * warmth(t),
        ),
    ),
    "warm-up and ripple, lugre": Case(
        axis(FrictionElement(LuGre(0.1, 0.15, 2.0, 1.0, 0.05, 0.01), ripple=Ripple(*AMPLITUDES, PERIOD), warm_up=WARM)),
        {"axis.theta": 0.3, "axis.omega": 3.0, "axis.friction.z": 0.02},
        bristle,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_terms_follow_their_equations_to_second_order(name: str) -> None:
    """With every term the step has its equations as limit, and halving it quarters the error."""
    coarse, fine = (CASES[name].errors(step) for step in (2e-3, 1e-3))
    assert fine.max() < STEP_ERROR
    assert np.log2(coarse / fine).min() > ORDER


@pytest.mark.parametrize("name", CASES)
def test_the_continuous_form_has_the_same_equations(name: str) -> None:
    """In motion the rates of the differential-algebraic form are those of the independent equations."""
    case = CASES[name]
    model, at, width = dae(case.drive, 1e-9), 0.13, 1e-6
    if model.algebraic:
        pytest.skip("its torque through the joint is an unknown beside the rates")
    numbers = {leaf.path: leaf.value for leaf in drive_leaves(case.drive)}
    values = {**numbers, **case.initial, "torque": command(at), "temperature": TEMPERATURE, TIME: at}
    groups = (model.states, model.algebraic, model.inputs, model.parameters)
    ode, _, _ = model.function()(*(model.stack(group, values) for group in groups))
    names = [variable.name for variable in model.states]
    found = dict(zip(names, np.asarray(ode).ravel(), strict=True))
    wanted = dict(zip(case.initial, case.rates(at, list(case.initial.values())), strict=True))
    assert found == pytest.approx(wanted, rel=width)
    assert {item.name: item.unit for item in model.inputs}.get(TIME, "s") == "s"


def step_of(drive: Drive) -> tuple[SteppedDrive, np.ndarray]:
    made = stepped(drive)
    values = {leaf.path: leaf.value for leaf in drive_leaves(drive)}
    numbers = [getattr(values[name], "guess", values[name]) for name in made.parameter_names]
    return made, np.array(numbers, dtype=float)


ZERO_TERMS: dict[str, Callable[[Any], Drive]] = {
    "axis.friction.ripple": lambda off: axis(FrictionElement(LAW, ripple=Ripple(off, off, PERIOD))),
    "axis.friction.warm_up": lambda off: axis(FrictionElement(LAW, warm_up=WarmUp(off, off, 0.2))),
    "axis.friction.warm_up.loss_share": lambda off: axis(
        FrictionElement(LAW, warm_up=WarmUp(0.0, 0.3, 0.2, loss_share=off, power=0.5))
    ),
    "servo.cogging": lambda off: axis(PLAIN, Motor("servo", "axis", cogging=Cogging(off, off, PERIOD))),
    "servo.torque_ripple": lambda off: axis(PLAIN, Motor("servo", "axis", torque_ripple=TorqueRipple(off, off, 0.9))),
    "axis.disturbance": lambda off: axis(PLAIN, shaft=Shaft("axis", J, disturbance=Disturbance(off, off, 0.2))),
    "servo.lag": lambda off: axis(PLAIN, Motor("servo", "axis", lag=off)),
    "servo.saturation": lambda off: axis(PLAIN, Motor("servo", "axis", saturation=off)),
    "axis-load.stiffening": lambda off: pair(replace(SPRING, stiffening=off)),
    "axis-load.second_stage": lambda off: pair(replace(SPRING, second_stage=SecondStage(off, 0.02))),
    "axis-load.hysteresis": lambda off: pair(replace(SPRING, hysteresis=Hysteresis(off, LOOP_TWIST))),
    "axis-load.hysteresis.springs": lambda off: pair(
        replace(SPRING, hysteresis=Hysteresis(0.3, LOOP_TWIST, LoopSprings(off, 0.7, 1.2, LOOP_TWIST)))
    ),
    "axis.friction.bristle.springs": lambda off: axis(
        FrictionElement(with_bristle(LAW, Bristle(50.0, 0.1, BristleSprings(off, 0.7, 1.2, 20.0))))
    ),
    "axis-load.kinematic_error": lambda off: pair(replace(SPRING, kinematic_error=KinematicError(off, off, 0.9))),
    "theta.eccentricity": lambda off: sensed(Eccentricity(off, off)),
}
AMPLITUDE = (
    *("cosine", "sine", "per_kelvin", "amplitude", "loss_share", "lag", "saturation"),
    *("stiffening", "hysteresis.torque", "second_stage.stiffness", "springs.share"),
)


def sensed(eccentricity: Eccentricity | None) -> Drive:
    drive = axis(PLAIN)
    return replace(
        drive, channels=(*drive.channels[:-1], replace(drive.channels[-1], eccentricity=eccentricity, delay=1e-3))
    )


ABSENT = {
    "axis-load.hysteresis.springs": pair(replace(SPRING, hysteresis=Hysteresis(0.3, LOOP_TWIST))),
    "axis.friction.bristle.springs": axis(FrictionElement(with_bristle(LAW, Bristle(50.0, 0.1)))),
    "theta": sensed(None),
    "axis-load": pair(SPRING),
    "axis.friction.warm_up.loss_share": axis(FrictionElement(LAW, warm_up=WarmUp(0.0, 0.3, 0.2))),
}


@pytest.mark.parametrize("name", ZERO_TERMS)
def test_a_plain_zero_costs_nothing(name: str) -> None:
    """A term whose amplitudes are plain zeros leaves no number, input, state or instruction behind."""
    off, _ = step_of(ZERO_TERMS[name](0.0))
    absent, _ = step_of(ABSENT.get(name) or ABSENT.get(name.split(".")[0], axis(PLAIN)))
    for made in ("parameter_names", "input_names", "state_names"):
        assert getattr(off, made) == getattr(absent, made)
    assert off.step.n_instructions() == absent.step.n_instructions()
    assert off.output.n_instructions() == absent.output.n_instructions()


@pytest.mark.parametrize("omega", [0.0, 4.0])
@pytest.mark.parametrize("name", ZERO_TERMS)
def test_a_fitted_zero_can_be_scored(name: str, omega: float) -> None:
    """At a guess of 0 every amplitude has a finite derivative, in motion that of a difference quotient and not 0."""
    made, numbers = step_of(ZERO_TERMS[name](Free(0.0)))
    x, p = (ca.SX.sym(symbol, size) for symbol, size in (("x", len(made.state_names)), ("p", numbers.size)))
    inputs = [{"torque": 0.4, "temperature": 30.0, TIME: 0.13}[item] for item in made.input_names]
    width = np.zeros(len(made.mechanism.topology.roots) + 1)
    after = ca.vertcat(made.step(x, inputs, p, 1e-3, width), made.output(x, inputs, p, 1e-3, width))
    function = ca.Function("after", [x, p], [after, ca.jacobian(after, p)])
    moving = {"axis.theta": 0.4, "axis.omega": omega, "servo.lagged": 0.3, "axis-load.hysteresis.z": 2e-3}
    state = [moving.get(item, 0.0) for item in made.state_names]
    _, slope = function(state, numbers)
    slope = np.asarray(slope)
    assert np.all(np.isfinite(slope))
    for k in [k for k, path in enumerate(made.parameter_names) if path.startswith(name) and path.endswith(AMPLITUDE)]:
        beside, curvature = 1e-5, 1e-4
        more, less = (function(state, numbers + sign * beside * np.eye(numbers.size)[k])[0] for sign in (1, -1))
        quotient = np.asarray(more - less).ravel() / (2 * beside)
        assert omega == 0.0 or np.any(quotient != 0.0)
        assert slope[:, k] == pytest.approx(quotient, rel=curvature, abs=curvature * np.abs(quotient).max())


def test_a_bristle_starts_in_balance_with_a_motor_that_lags() -> None:
    """At rest the deflection carries the torque of the motor, whose lag is taken to be over."""
    law = LuGre(tau_c=1.0, tau_s=1.0, omega_s=0.1, sigma0=100.0, sigma1=0.0, sigma2=0.0)
    shaft = Shaft("axis", J, FrictionElement(law))
    channels = (Channel("torque", "servo.torque", "input"), Channel("angle", "axis.theta"))
    parts = Drive((shaft,), motors=(Motor("servo", "axis", lag=LAG),), channels=channels)
    drive, values = stepped(parts), {leaf.path: leaf.value for leaf in drive_leaves(parts)}
    numbers = [values[name] for name in drive.parameter_names]
    state = dict(zip(drive.state_names, np.asarray(drive.start(0.0, 0.0, 0.0, 0.3, numbers)).ravel(), strict=True))
    assert state["servo.lagged"] == pytest.approx(0.3)
    assert state["axis.friction.z"] == pytest.approx(0.3 / 100.0, rel=1e-6)


@pytest.mark.parametrize("lag", [0.0, 1e-6, 1e-4, 1e-3, 1e-2])
def test_a_lag_of_any_size_delays_a_ramp_by_itself(lag: float) -> None:
    """Behind a ramp of the command the current is late by the lag, for lags far below the step and far above it."""
    motor = Motor("servo", "axis", 0.4, lag=Free(lag))
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "linear")
    drive = replace(LAGGED, shafts=(Shaft("axis", J),), motors=(motor,))
    run = Bench(drive).run(0.3, {"torque": ramp, "temperature": 0.0})
    settled = run.time > 10 * lag + 2e-3
    assert run["current"][settled] == pytest.approx(run.time[settled] - lag, abs=1e-6)


def test_both_sides_of_a_rigid_joint_follow_its_error() -> None:
    """Angle, speed and acceleration of the load are those of motor / ratio + error(motor), whatever drives them."""
    signals = ("axis.theta", "axis.omega", "axis.alpha", "load.theta", "load.omega", "load.alpha")
    drive = replace(geared(), channels=(geared().channels[0], *(Channel(name, name) for name in signals)))
    run = Bench(drive).run(DURATION, INPUTS, MOVING)
    turn, (cosine, sine), q, v = 2 * np.pi / ERROR_PERIOD, RIGID_ERROR, run["axis.theta"], run["axis.omega"]
    slope = 1 / RATIO + turn * (sine * np.cos(turn * q) - cosine * np.sin(turn * q))
    error = cosine * np.cos(turn * q) + sine * np.sin(turn * q)
    rounding = 1e-9
    assert run["load.theta"] == pytest.approx(q / RATIO + error, rel=rounding)
    assert run["load.omega"] == pytest.approx(slope * v, rel=rounding)
    assert run["load.alpha"] == pytest.approx(slope * run["axis.alpha"] - turn**2 * error * v**2, rel=rounding)


def test_a_load_sensor_starts_the_motor_behind_a_rigid_error() -> None:
    """From the angle of the load alone the start finds the angle of the motor that the joint gives it."""
    bench, q, v = Bench(geared()), 0.7, 3.0
    turn, (cosine, sine) = 2 * np.pi / ERROR_PERIOD, RIGID_ERROR
    slope = 1 / RATIO + turn * (sine * np.cos(turn * q) - cosine * np.sin(turn * q))
    theta = q / RATIO + wave(RIGID_ERROR, ERROR_PERIOD, q)
    state = np.asarray(bench.stepped.start([theta], [slope * v], [0.0], [0.0], bench.numbers)).ravel()
    two_newton_steps = 2e-2
    assert state == pytest.approx([q, v], rel=two_newton_steps)


def test_a_rigid_error_leads_away_from_the_first_shaft() -> None:
    """Where the output side comes first, or is moved from outside, the error of a rigid joint is refused by name."""
    drive = geared()
    with pytest.raises(FrictionOcpError, match=r"axis-load\.kinematic_error: 'load' comes before 'axis'"):
        stepped(replace(drive, shafts=drive.shafts[::-1]))
    moved = Channel("load", "load.omega", "input")
    with pytest.raises(FrictionOcpError, match=r"channels\.load: load\.omega is prescribed behind a rigid joint"):
        stepped(replace(drive, motors=(), channels=(moved, Channel("theta", "axis.theta"))))


def test_a_shaft_sticks_up_to_the_friction_of_its_angle() -> None:
    """Under a slow ramp the speed is exactly 0 until the torque passes the Coulomb friction of that very angle."""
    ripple = Ripple(*AMPLITUDES, PERIOD)
    drive = axis(FrictionElement(Coulomb(0.1), ripple=ripple))
    for theta in (0.1, 0.4):
        level = 0.1 * (1 + wave(AMPLITUDES, PERIOD, theta))
        ramp = Trajectory(np.array([0.0, 1.0]), np.array([0.0, 0.2]), "linear")
        run = Bench(drive).run(1.0, {"torque": ramp, "temperature": TEMPERATURE}, {"axis.theta": theta})
        held = 0.2 * run.time < level - 1e-9
        assert np.all(run["axis.omega"][held] == 0.0) and np.all(run["axis.theta"][held] == theta)
        assert np.all(run["axis.omega"][0.2 * run.time > level + 1e-3] > 0.0)


def test_friction_that_vanishes_does_not_push() -> None:
    """Where a ripple takes more than all of the friction, the shaft turns freely."""
    drive = axis(FrictionElement(Coulomb(0.1), ripple=Ripple(-2.0, 0.0, 100.0)))
    run = Bench(drive).run(0.1, {"torque": 0.0, "temperature": 20.0}, {"axis.omega": 1.0})
    assert np.all(run["axis.omega"] == 1.0)


def test_what_a_term_needs_is_asked_for() -> None:
    """Friction that follows the temperature needs a channel; one that settles a time, and the losses that warm it."""
    drive = axis(FrictionElement(LAW, warm_up=WarmUp(0.01, 0.1, loss_share=0.5)))
    with pytest.raises(FrictionOcpError) as refusal:
        stepped(replace(drive, channels=(drive.channels[0], drive.channels[2])))
    assert [finding.where for finding in refusal.value.findings] == [
        "axis.friction.warm_up.per_kelvin",
        "axis.friction.warm_up.time_constant",
        "axis.friction.warm_up.power",
    ]


@pytest.mark.parametrize("omega", [0.0, 1e-9, 4.0])
def test_a_bristle_without_friction_holds_nothing(omega: float) -> None:
    """Fits end where one shaft has none; the step and its derivatives have values there, those of drag alone."""
    law = LuGre(tau_c=Free(0.0), tau_s=0.0, omega_s=0.1, sigma0=100.0, sigma1=0.0, sigma2=0.02)
    made, numbers = step_of(axis(FrictionElement(law)))
    plain, plain_numbers = step_of(axis(FrictionElement(CoulombViscous(0.0, 0.02))))
    x, p = (ca.SX.sym(symbol, size) for symbol, size in (("x", len(made.state_names)), ("p", numbers.size)))
    inputs = [{"torque": 0.4, "temperature": 30.0}[item] for item in made.input_names]
    width = np.zeros(len(made.mechanism.topology.roots) + 1)
    after = made.step(x, inputs, p, 1e-3, width)
    function = ca.Function("after", [x, p], [after, ca.jacobian(after, x), ca.jacobian(after, p)])
    end, *slopes = function([0.4, omega, 0.0], numbers)
    assert all(np.all(np.isfinite(np.asarray(slope))) for slope in slopes)
    wanted = plain.step([0.4, omega], inputs, plain_numbers, 1e-3, width)
    assert np.asarray(end).ravel()[:2] == pytest.approx(np.asarray(wanted).ravel(), rel=1e-6)
