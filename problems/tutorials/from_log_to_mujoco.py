# %% [markdown]
# # From a log to MuJoCo
#
# What the bus of a servo wrote, in encoder ticks and tenths of a volt, becomes a joint of a robot simulator
# that has the friction of the real one.
#
#     .venv/bin/python problems/tutorials/from_log_to_mujoco.py
#
# The last part needs MuJoCo: `pip install 'friction-ocp[mujoco]'`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import friction_ocp as fo

LOGS = Path("data/xl330/logs")
OUT = Path("results/tutorials/from_log_to_mujoco")
OUT.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## What is in a log
#
# `inspect_file` reads CSV, MATLAB, HDF5, Parquet, MDF, ROS bags and TDMS, and lists what they hold.

# %%
print(fo.inspect_file(LOGS / "sin_sin-kp100.csv"))

# %% [markdown]
# ## Which column is what
#
# A map says it once for all logs of a machine. Units convert exactly or are refused; what counts steps says how large a
# step is: the encoder has 4096 in a turn.

# %%
(OUT / "map.yaml").write_text("""\
format: friction-ocp-map/1
time: {column: t_ms, unit: ms}
channels:
  position: {column: present_position, unit: counts, scale: 2*pi/4096 rad}
  goal_position: {column: goal_position, unit: counts, scale: 2*pi/4096 rad}
  supply_voltage: {column: input_voltage, unit: counts, scale: 0.1 V}
  torque_enable: {column: torque_enable, unit: "1"}
title: XL330 servo with a pendulum
""")
for log in sorted(LOGS.glob("*.csv")):
    recording = fo.import_recording(log, OUT / "map.yaml")
    fo.write_recording(recording, OUT / f"{log.stem}.h5")
    low, high = np.degrees(recording.channels["position"].values[[0, -1]])
    print(f"{log.stem:<24} {recording.channels['position'].time[-1]:.2f} s, from {low:.1f} to {high:.1f} deg")

# %% [markdown]
# The pendulum hangs at 180 deg, because the encoder counts from there. Nothing has to be recomputed for that: a sensor
# has an `offset`, and here it is a parameter to be found.
#
# ## The machine
#
# The same model as in `first_identification.py`. The gain of the position loop differs between recordings and is known:
# `set` states it beside each file.

# %%
(OUT / "servo.yaml").write_text("""\
# Asked: a joint for MuJoCo, from logs of the servo's bus.
format: friction-ocp-problem/1
title: XL330 servo with a pendulum, from its logs
drive:
  motor: {name: servo, torque_constant: {guess: 0.38, min: 0.05, max: 1.5}, resistance: {guess: 4, min: 0.5, max: 20}}
  shafts:
    - name: servo
      inertia: {guess: 0.002, min: 1e-5, max: 0.05}
      friction:
        {law: coulomb_viscous, tau_c: {guess: 0.01, min: 0, max: 0.3}, viscous: {guess: 0.004, min: 0, max: 0.2}}
    - {name: pendulum, inertia: 0.0049, gravity: {torque: 0.480690}}
  transmissions: [{ratio: 1, stiffness: rigid}]
controller: {type: duty, feedback: position, output: voltage, kp: 0.287737750, saturation: [-1, 1]}
channels:
  goal_position: {measures: reference.theta, role: input}
  supply_voltage: {measures: servo.supply_voltage, role: input, hold: linear}
  torque_enable: {measures: servo.enable, role: input, hold: zero}
  position: {measures: pendulum.theta, offset: {guess: 3.14, min: 2.8, max: 3.5}, resolution: 0.001533980788}
recordings:
  train:
    - {file: lift_and_drop-kp100.h5, set: {controller.kp: 0.287737750}}
    - {file: sin_sin-kp100.h5, set: {controller.kp: 0.287737750}}
    - {file: lift_and_drop-kp800.h5, set: {controller.kp: 2.301902002}}
    - {file: sin_time_square-kp800.h5, set: {controller.kp: 2.301902002}}
  validation:
    - {file: lift_and_drop-kp400.h5, set: {controller.kp: 1.150951001}}
estimation: {loss: absolute, initial_state: measured}
""")
problem = fo.load_problem(OUT / "servo.yaml")
print(*fo.check(problem) or ["check: nothing to complain about"], sep="\n")

# %%
estimate = fo.identify(problem)
for item in estimate.parameters:
    print(f"  {item.name:<24} {item.value:9.4g} {item.unit:<10} +- {1.96 * item.std_error:.2g}  {item.verdict.word}")
result = fo.save(estimate, OUT / "result")

# %% [markdown]
# ## Out
#
# `export` writes armature, damping, frictionloss and an actuator whose control is the voltage. What a target cannot
# express is listed in `losses`: nothing here, while a LuGre bristle, say, would be. `price` runs the validation
# recordings in MuJoCo and here, and says what the move costs beside the error that the model has anyway.

# %%
exported = fo.export(result, to="mjcf", path=OUT / "servo.xml")
print("not expressed:", *exported.losses or ["nothing"], sep="\n  ")
for row in exported.price():
    errors = f"{row.error_here:.4f} {row.unit} here, {row.error_there:.4f} {row.unit} in MuJoCo"
    print(f"{row.recording}, {row.channel}: rms error {errors}; the gap between both is {row.share:.1%} of it")

# %% [markdown]
# ## The joint at work
#
# In the validation recording the servo lifts the pendulum and is then switched off. From that moment on MuJoCo alone
# says how it swings out: no controller, nothing but inertia, gravity and friction.

# %%
import mujoco  # noqa: E402

model = mujoco.MjModel.from_xml_path(str(OUT / "servo.xml"))
data = mujoco.MjData(model)
model.opt.disableactuator = 1  # the group of the motor

recording = fo.read_recording(OUT / "lift_and_drop-kp400.h5")
position, enabled = recording.channels["position"], recording.channels["torque_enable"]
off = enabled.time[enabled.values < 0.5][0]
angle = position.values - estimate.values["position.offset"]
data.qpos[0] = np.interp(off, position.time, angle)
course = []
while data.time < position.time[-1] - off:
    course.append((off + data.time, data.qpos[0]))
    mujoco.mj_step(model, data)
time, swing = np.transpose(course)

# %%
figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
axes.plot(position.time, np.degrees(angle), "k", linewidth=1.8, label="recorded")
axes.plot(time, np.degrees(swing), "tab:orange", label="MuJoCo, from where the servo was switched off")
axes.axvline(off, color="0.6", linewidth=0.8, linestyle="--")
axes.set(title="A pendulum is let go", xlabel="time in s", ylabel="angle from hanging in deg")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig(OUT / "drop.png", dpi=120)

# %% [markdown]
# The first swing is that of the real servo; later ones die out too soon. Coulomb and viscous friction were fitted to a
# servo that lifts as well as swings, and this one has more friction under load than without: neither this model nor a
# `frictionloss` of MuJoCo can say that. `reading_a_diagnosis.py` finds it, and `export` names it among the losses.
