"""mujoco.sysid (MuJoCo's own toolbox) on the servo: recorded voltages drive a hinge with friction loss and damping.

Its parameters are the torque per volt, the damping with back-EMF in it, friction loss, armature and the offset of the
sensor; torque constant and resistance follow for the viscous friction of the guess, which voltages cannot tell apart.
"""

from __future__ import annotations

import time

import mujoco
import numpy as np
from mujoco import sysid
from peer_cases import Case, Run

from peer_tools.shooting import Answer

LENGTH = 0.1
MODEL = """
<mujoco>
  <option timestep="0.002" gravity="0 0 -9.81" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
    <body name="arm">
      <inertial pos="0 0 -0.1" mass="0.49" diaginertia="1e-9 1e-9 1e-9"/>
      <joint name="servo" type="hinge" axis="0 1 0" armature="0.002" damping="0.04" frictionloss="0.01"/>
      <geom size="0.01" contype="0" conaffinity="0" mass="0"/>
    </body>
  </worldbody>
  <actuator><general name="volts" joint="servo" gainprm="0.1"/></actuator>
  <sensor><jointpos name="position" joint="servo"/></sensor>
</mujoco>
"""


def solve(case: Case) -> Answer:
    """Solve over all recordings."""
    began = time.perf_counter()
    inertia, tau_c, viscous, constant, resistance, offset = case.guess
    gain, damping = constant / resistance, viscous + constant**2 / resistance
    low, high = case.lower, case.upper
    bounds = {
        "armature": (inertia, low[0], high[0], set_joint),
        "frictionloss": (tau_c, low[1], high[1], set_joint),
        "damping": (damping, 1e-3, 0.5, set_joint),
        "gain": (gain, 0.01, 1.0, set_gain),
        "offset": (offset, low[5], high[5], set_offset),
    }
    params = sysid.ParameterDict(
        {name: sysid.Parameter(name, *numbers, modifier=modifier) for name, (*numbers, modifier) in bounds.items()}
    )
    sequences = [sequence_of(case, run, k) for k, run in enumerate(case.runs)]
    residual = sysid.build_residual_fn(models_sequences=sequences)
    built = time.perf_counter()
    found, result = sysid.optimize(params, residual, optimizer="mujoco", verbose=False)
    gain, damping = float(found["gain"].value[0]), float(found["damping"].value[0])
    constant = max(damping - viscous, 1e-6) / gain
    own = {name: float(found[name].value[0]) for name in bounds}
    values = np.array([own["armature"], own["frictionloss"], viscous, constant, constant / gain, own["offset"]])
    return Answer(values, built - began, time.perf_counter() - built, True, str(getattr(result, "message", "")))


def set_joint(spec: mujoco.MjSpec, param: sysid.Parameter) -> None:
    """Write a number of the joint."""
    joint = spec.joint("servo")
    if param.name == "damping":
        joint.damping[0] = param.value[0]
    else:
        setattr(joint, param.name, float(param.value[0]))


def set_offset(spec: mujoco.MjSpec, param: sysid.Parameter) -> None:
    """Turn the pendulum against the zero of its sensor."""
    angle = float(param.value[0])
    spec.body("arm").ipos = [LENGTH * np.sin(angle), 0.0, -LENGTH * np.cos(angle)]


def set_gain(spec: mujoco.MjSpec, param: sysid.Parameter) -> None:
    """Write the torque per volt."""
    spec.actuator("volts").gainprm[0] = float(param.value[0])


def sequence_of(case: Case, run: Run, number: int) -> sysid.ModelSequences:
    """Return one recording; the voltage follows from goal, position and supply as in the firmware."""
    spec = mujoco.MjSpec.from_string(MODEL)
    model = spec.compile()
    goal, supply, enable, gain = run.inputs.T
    volts = enable * supply * np.clip(gain * (goal - run.measured[:-1, 0]), -1.0, 1.0)
    stamps = run.time[:-1] - run.time[0]
    control = sysid.TimeSeries.from_control_names(stamps, volts[:, None], model)
    sensors = sysid.TimeSeries.from_names(stamps, run.measured[:-1, :1], model)
    start = sysid.create_initial_state(model, run.states[0, :1], run.states[0, 1:2])
    return sysid.ModelSequences(f"run{number}", spec, f"run{number}", start, control, sensors)
