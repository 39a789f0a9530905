"""The exported mechanism in MuJoCo, driven as in the recordings: motors and controller are those of this package.

At every step the angles and speeds of MuJoCo go into the state of the drive, whose motors say the command; what is
neither mechanics nor friction (windings, integrals, lags, sampled controllers) advances by the drive's own step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from friction_ocp.drive.mechanism import Mechanism, column
from friction_ocp.drive.motors import motor_command, motor_torque
from friction_ocp.drive.stepping import recorded, state_symbols
from friction_ocp.errors import Finding, FrictionOcpError
from friction_ocp.optional_library import optional_library
from friction_ocp.simulation.grid import APPLY, COMPUTE, FloatArray
from friction_ocp.targets.fitted import Fitted, Run, flat
from friction_ocp.targets.joints import JointDrive

STRAY = 1e6
"""Angle, rad or m, beyond which a run has failed."""


def mujoco_library(where: str) -> Any:
    """Import MuJoCo; raises FrictionOcpError with the install command where it is missing."""
    return optional_library("mujoco", "mujoco", "mujoco", where, "measuring what the export costs")


@dataclass(frozen=True)
class _Functions:
    """The parts of the drive that MuJoCo does not know, as functions of its state, inputs and numbers."""

    drives: ca.Function
    """(x, u, p) -> command, enable and torque of each motor."""
    output: ca.Function
    """(x, u, p, accelerations) -> recorded outputs."""


class MuJoCoRun:
    """A loaded model of an exported drive."""

    def __init__(self, fitted: Fitted, drive: JointDrive, text: str, by_torque: bool) -> None:
        self._mujoco = mujoco_library(str(fitted.source))
        self._model = self._loaded(fitted, text)
        self._fitted, self._drive, self._by_torque = fitted, drive, by_torque
        self._mech = fitted.model.drive.mechanism
        self._functions = _functions(self._mech)
        self._address = [int(self._model.joint(joint.name).qposadr[0]) for joint in drive.joints]
        self._dof = [int(self._model.joint(joint.name).dofadr[0]) for joint in drive.joints]
        self._own = bool(self._mech.extra_names or self._mech.following or self._mech.memory_names)

    def _loaded(self, fitted: Fitted, text: str) -> Any:
        try:
            return self._mujoco.MjModel.from_xml_string(text)
        except ValueError as error:
            what = f"MuJoCo refuses the model ({' '.join(str(error).split())})"
            raise FrictionOcpError(
                Finding(str(fitted.source), what, remedy="correct the numbers of the fit")
            ) from error

    @property
    def model(self) -> Any:
        """The model, whose options may be set before a run."""
        return self._model

    def simulate(self, run: Run) -> FloatArray:
        """Return (n, outputs) at the nodes of a recording, each window begun from the state of the free run."""
        y = np.full_like(run.free.simulated, np.nan)
        for begin, stop in zip(run.first[:-1], run.first[1:], strict=True):
            self._window(run, int(begin), int(stop), stop == run.first[-1], y)
        return y

    def _window(self, run: Run, begin: int, stop: int, closes: bool, y: FloatArray) -> None:
        data = self._mujoco.MjData(self._model)
        x = run.free.states[begin].copy()
        self._put(data, x)
        grid, drive = run.item.grid, self._fitted.model.drive
        for k in range(begin, stop + closes):
            for kind in (APPLY, COMPUTE):
                if drive.tick is not None and grid.ticks[k] & kind and k > begin:  # the first state is after its ticks
                    x = flat(drive.tick(x, grid.at_node[k], run.numbers, kind))
            self._push(data, x, grid.at_node[k], run.numbers)
            self._mujoco.mj_forward(self._model, data)
            y[k] = self._observed(data, x, grid.at_node[k], run.numbers)
            if k == stop:
                return
            x = self._interval(run, k, data, x)
            if not np.all(np.isfinite(data.qpos)) or np.any(np.abs(data.qpos) > STRAY):
                return

    def _interval(self, run: Run, k: int, data: Any, x: FloatArray) -> FloatArray:
        """Advance from one node to the next in equal steps of at most the model's own."""
        grid = run.item.grid
        length = float(grid.dt[k])
        steps = max(1, int(np.ceil(length / self._model.opt.timestep - 1e-9)))
        whole, h = float(self._model.opt.timestep), length / steps
        self._model.opt.timestep = h
        step = self._fitted.model.drive.step
        for sub in range(steps):
            u = grid.between(k, (sub + 0.5) / steps)
            self._push(data, x, u, run.numbers)
            self._mujoco.mj_step(self._model, data)
            if self._own:
                x = flat(step(x, u, run.numbers, h, np.zeros(len(self._drive.joints) + 1)))
            self._take(data, x)
        self._model.opt.timestep = whole
        return x

    def _put(self, data: Any, x: FloatArray) -> None:
        """Give MuJoCo the angles and speeds of a state."""
        groups = len(self._drive.joints)
        for k, joint in enumerate(self._drive.joints):
            data.qpos[self._address[k]] = x[joint.group] * joint.speed
            data.qvel[self._dof[k]] = x[groups + joint.group] * joint.speed
        if not self._by_torque:
            data.act[:] = x[[name.endswith(".lagged") for name in self._mech.state_names]]

    def _take(self, data: Any, x: FloatArray) -> None:
        """Take angles and speeds from MuJoCo into a state."""
        groups = len(self._drive.joints)
        for k, joint in enumerate(self._drive.joints):
            x[joint.group] = data.qpos[self._address[k]] / joint.speed
            x[groups + joint.group] = data.qvel[self._dof[k]] / joint.speed

    def _push(self, data: Any, x: FloatArray, u: FloatArray, p: FloatArray) -> None:
        """Command the actuators, or apply the torque of the motors where the model has none."""
        command, enable, torque = (flat(item) for item in self._functions.drives(x, u, p))
        self._model.opt.disableactuator = 0
        data.qfrc_applied[:] = 0.0
        for k, item in enumerate(self._drive.actuators):
            if self._by_torque:
                dof = self._dof[[joint.name for joint in self._drive.joints].index(item.joint)]
                data.qfrc_applied[dof] += item.gear * torque[k]
            else:
                data.ctrl[k] = command[k]
                self._model.opt.disableactuator |= (1 << k) * int(enable[k] < 0.5)
        if self._by_torque:
            for k, joint in enumerate(self._drive.joints):
                data.qfrc_applied[self._dof[k]] += joint.constant

    def _observed(self, data: Any, x: FloatArray, u: FloatArray, p: FloatArray) -> FloatArray:
        alpha = [data.qacc[self._dof[k]] / joint.speed for k, joint in enumerate(self._drive.joints)]
        return flat(self._functions.output(x, u, p, alpha))


def _functions(mech: Mechanism) -> _Functions:
    state = state_symbols(mech)
    at = state.motion(mech)
    u, p = column(list(mech.inputs.values())), column(list(mech.parameters.values()))
    driven = [motor for motor in mech.drive.motors if mech.drive.driving_signal(motor)]
    enables = [mech.true_input(f"{motor.name}.enable") for motor in driven]
    commands = column([motor_command(mech, motor, at) for motor in driven])
    torques = column([motor_torque(mech, motor, at) for motor in driven])
    enabled = column([1.0 if enable is None else enable for enable in enables])
    alpha = ca.SX.sym("alpha", len(mech.topology.roots))
    seen = column([recorded(mech, channel, at, alpha) for channel in mech.drive.outputs])
    return _Functions(
        ca.Function("drives", [state.x, u, p], [ca.densify(item) for item in (commands, enabled, torques)]),
        ca.Function("seen", [state.x, u, p, alpha], [ca.densify(seen)]),
    )
