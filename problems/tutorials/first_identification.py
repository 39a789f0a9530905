# %% [markdown]
# # A first identification
#
# A small geared servo, a Dynamixel XL330, lifts a pendulum. Its bus was logged while it followed four motions at three
# controller gains: twelve recordings of six seconds. How much of what we see is friction?
#
# Run this file from the folder of the repository, as a whole or cell by cell in an editor that knows `# %%`:
#
#     .venv/bin/python problems/tutorials/first_identification.py

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import friction_ocp as fo

OUT = Path("results/tutorials/first_identification")
OUT.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## What was recorded
#
# A recording is a set of channels, each with its unit and its own times. Times may be irregular, as they are here.

# %%
recording = fo.read_recording("data/xl330/sin_time_square-kp400.h5")
print(recording.title)
for name, channel in recording.channels.items():
    low, high = channel.values.min(), channel.values.max()
    print(f"  {name:<15} {channel.time.size} samples, {low:8.3f} to {high:6.3f} {channel.unit}")

# %%
position, goal = recording.channels["position"], recording.channels["goal_position"]
figure, axes = plt.subplots(figsize=(7.5, 3.2), layout="constrained")
axes.plot(goal.time, goal.values, "0.6", linewidth=1.2, label="goal")
axes.plot(position.time, position.values, label="position")
axes.set(title="A sweep, and a servo that lags behind it", xlabel="time in s", ylabel="angle in rad")
axes.legend()
figure.savefig(OUT / "recorded.png", dpi=120)

# %% [markdown]
# ## What is known, and what is asked
#
# A problem file says what the machine is made of. A plain number is known; `{guess: ...}` is to be found. Here the
# pendulum is known (it was weighed) and so is the firmware's control law; inertia of the rotor, friction, resistance
# and torque constant are not. Open the file beside this one: it is 50 lines, half of them a comment that says so.
#
# `check` solves nothing. It looks for what is wrong or doubtful in file and recordings, and foresees which parameters
# these motions can tell. An empty list is good news.

# %%
problem = fo.load_problem("problems/xl330/coulomb_viscous.yaml")
findings = fo.check(problem)
print(*findings or ["check: nothing to complain about"], sep="\n")

# %% [markdown]
# ## The answer
#
# `identify` fits all eight training recordings at once: it simulates the servo in its own control loop, from the start
# of each recording to its end, and turns the parameters until the simulated positions are those that were measured.

# %%
guessed = fo.simulate(problem)
estimate = fo.identify(problem)
print(f"converged: {estimate.converged}, after {estimate.solver.iterations} iterations")
for item in estimate.parameters:
    low, high = item.interval95
    print(f"  {item.name:<24} {item.value:9.3g} {item.unit:<10} 95 %: {low:8.3g} to {high:8.3g}  {item.verdict.word}")

# %% [markdown]
# `ok` means that the recordings tell the parameter. The others are `at_bound`, `not_identifiable` and `traded`, which
# names the parameters with which it can be exchanged.
#
# ## Is it any good?
#
# Four recordings, at a gain that the fit has never seen, were kept for this question. The simulation is free: it starts
# once and is never corrected by the measurement.

# %%
before, _ = guessed.validation_errors["position"]
after, by_recording = estimate.simulation.validation_errors["position"]
print(f"free run on validation: {before.mae:.3f} rad mean absolute error with the guesses, {after.mae:.3f} rad fitted")
for name, errors in by_recording.items():
    print(f"  {name:<24} {errors.mae:.3f} rad")

# %%
runs = {run.name: run for run in estimate.simulation.validation}
first = {run.name: run for run in guessed.validation}
figure, panels = plt.subplots(2, 1, figsize=(7.5, 5.5), sharex=True, layout="constrained")
for axes, name in zip(panels, ("sin_time_square-kp400", "lift_and_drop-kp400"), strict=True):
    run = runs[name]
    axes.plot(run.time, first[name].simulated[:, 0], "0.75", label="simulated with the guesses")
    axes.plot(run.time, run.measured[:, 0], "k", linewidth=1.8, label="measured")
    axes.plot(run.time, run.simulated[:, 0], "tab:orange", label="simulated with the answer")
    axes.set(title=name, ylabel="angle in rad")
panels[1].set(xlabel="time in s")
figure.legend(*panels[0].get_legend_handles_labels(), ncols=3, loc="outside lower center")
figure.savefig(OUT / "free_run.png", dpi=120)

# %% [markdown]
# Much better than the guesses, and still not right: look at the last half second before the pendulum is dropped, where
# the servo holds still under its load and the simulation sinks on. The estimate says so itself:

# %%
print(*estimate.warnings, sep="\n")

# %% [markdown]
# Take that seriously. Residuals that are not white mean that the model misses something; the intervals above already
# allow for it. What it misses is the subject of the next tutorial, `reading_a_diagnosis.py`.
#
# ## The friction
#
# What we came for, with its 95 % band, over the speeds that the recordings reach:

# %%
(curve,) = estimate.curves
figure, axes = plt.subplots(figsize=(7.5, 3.4), layout="constrained")
axes.fill_between(curve.speed, 1e3 * curve.lower, 1e3 * curve.upper, color="tab:blue", alpha=0.2)
axes.plot(curve.speed, 1e3 * curve.torque, "tab:blue")
axes.set(title="Friction of the servo, at its output", xlabel="speed in rad/s", ylabel="friction torque in mN m")
axes.grid(alpha=0.3)
figure.savefig(OUT / "friction.png", dpi=120)

# %% [markdown]
# ## Keep it
#
# `save` writes what the command `friction-ocp identify` would: a report to open in a browser, `result.json`,
# `result.h5`, figures, and `fitted.yaml`, the problem with its answer, from which everything can go on.

# %%
folder = fo.save(estimate, OUT / "result")
print(*sorted(path.name for path in folder.iterdir()), sep="\n")
