"""A drive linearised about an operating point: state space, modes and frequency response."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import scipy.signal as _signal  # pyright: ignore[reportMissingTypeStubs]

from friction_ocp.dae import Dae, Linearisation
from friction_ocp.drive.dae_form import dae
from friction_ocp.drive.mechanism import deflection_names
from friction_ocp.drive.parts import Drive, Shaft
from friction_ocp.drive.steady import steady_speeds
from friction_ocp.drive.values import drive_leaves
from friction_ocp.friction.element import FrictionElement
from friction_ocp.friction.static import NoFriction

signal: Any = _signal  # its own types are incomplete

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

WIDTH = 1e-9
"""rad/s over which dry friction turns at standstill: there it holds like a very stiff damper, elsewhere it is flat."""
REST = 1e-9
"""Size of an eigenvalue, relative to the largest, below which it is a rigid-body motion."""


@dataclass(frozen=True)
class Mode:
    """One real eigenvalue or a pair of complex ones."""

    pole: complex
    """1/s, with imaginary part >= 0."""
    frequency: float
    """Natural frequency, Hz."""
    damping: float
    """Damping ratio; negative where the motion grows."""


@dataclass(frozen=True)
class LinearDrive:
    """Small motions about an operating point, every state, input and output by name."""

    matrices: Linearisation
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    at: Mapping[str, float]
    """The operating point."""

    @property
    def poles(self) -> ComplexArray:
        """(states,) eigenvalues, 1/s."""
        return np.linalg.eigvals(self.matrices.a).astype(np.complex128)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Poles with their frequency and damping, slowest first; rigid-body motion left out."""
        poles = self.poles
        moving = poles[(np.abs(poles) > REST * np.max(np.abs(poles), initial=0.0)) & (poles.imag >= 0)]
        ordered = moving[np.argsort(np.abs(moving))]
        return tuple(
            Mode(complex(pole), float(abs(pole) / (2.0 * np.pi)), float(-pole.real / abs(pole))) for pole in ordered
        )

    def state_space(self) -> Any:
        """Return a `scipy.signal.StateSpace` of all inputs and outputs."""
        m = self.matrices
        return signal.StateSpace(m.a, m.b, m.c, m.d)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Return (frequencies, outputs, inputs) the frequency response at frequencies in Hz."""
        m, still = self.matrices, np.eye(len(self.state_names))
        s = 2j * np.pi * frequency[:, None, None]
        return (m.c @ np.linalg.solve(s * still - m.a, m.b[None]) + m.d).astype(np.complex128)

    def between(self, source: str, target: str, frequency: FloatArray) -> ComplexArray:
        """Return (frequencies,) the response of one output to one input."""
        return self.response(frequency)[:, self.output_names.index(target), self.input_names.index(source)]


def linearise(drive: Drive, speed: float = 0.0, at: Mapping[str, float] | None = None) -> LinearDrive:
    """Linearise a drive with plain numbers while its motor's shaft turns at `speed`, its bristles bent accordingly.

    `at` gives states, inputs and torques through rigid joints by name where they are something else; springs are not
    stretched and inputs zero unless it says so.
    """
    model = dae(drive, WIDTH)
    numbers = {leaf.path: float(leaf.value) for leaf in drive_leaves(drive)}
    values = numbers | dict.fromkeys((item.name for item in (*model.inputs, *model.algebraic)), 0.0)
    values |= dict.fromkeys((item.name for item in model.states), 0.0) | _steady_motion(drive, speed) | dict(at or {})
    values |= _transmitted(model, values, at or {})
    return LinearDrive(
        model.linearise(values),
        tuple(item.name for item in model.states),
        tuple(item.name for item in model.inputs),
        tuple(item.name for item in model.outputs),
        {name: value for name, value in values.items() if name not in numbers},
    )


def without_friction(drive: Drive) -> Drive:
    """Return the drive with every shaft turning freely, to show what friction contributes."""
    free = FrictionElement(NoFriction())
    return replace(drive, shafts=tuple(replace(shaft, friction=free) for shaft in drive.shafts))


def _steady_motion(drive: Drive, speed: float) -> dict[str, float]:
    """Return the states of a drive that turns evenly."""
    states: dict[str, float] = {}
    for name, ratio in steady_speeds(drive).items():
        states[f"{name}.omega"] = speed * ratio
        states |= zip(deflection_names(drive.shaft(name)), _deflections(drive.shaft(name), speed * ratio), strict=True)
    return states


def _deflections(shaft: Shaft, omega: float) -> list[float]:
    if not shaft.friction.law.has_bristle:
        return []
    if omega == 0.0:
        return [0.0] * len(shaft.friction.law.deflections)
    bent = np.asarray(ca.DM(ca.SX(shaft.friction.steady_deflection(ca.SX(omega)))), dtype=float)
    return [float(one) for one in bent.ravel()]


def _transmitted(model: Dae, values: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Solve for the torques through rigid joints that friction depends on."""
    if not model.algebraic or all(item.name in given for item in model.algebraic):
        return {}
    groups = (model.states, model.inputs, model.parameters)
    known = np.concatenate([model.stack(group, values) for group in groups])
    problem = {"x": model.z, "p": ca.vertcat(model.x, model.u, model.p), "g": model.alg}
    found = ca.rootfinder("transmitted", "newton", problem)(x0=np.ones(len(model.algebraic)), p=known)["x"]
    return {item.name: float(value) for item, value in zip(model.algebraic, np.asarray(found).ravel(), strict=True)}
