# %% [markdown]
# # Designing the next experiment
#
# Before another day at the machine: which motion would tell the most? This axis has a motor with LuGre friction, an
# elastic reducer and a load, under a position controller; motor current, encoder and an accelerometer on the load are
# logged. So far there is one recording, of ordinary moves.
#
# It takes about a minute: each motion is simulated with all its sensitivities.
#
#     .venv/bin/python problems/tutorials/designing_the_next_experiment.py

# %%
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import friction_ocp as fo

OUT = Path("results/tutorials/designing_the_next_experiment")

# %% [markdown]
# ## What is known so far
#
# A problem is a frozen value: `replace` makes another one of it. Here it keeps one of its two training recordings.

# %%
both = fo.load_problem("problems/two_mass/joint.yaml")
problem = replace(both, train=both.train[:1], validation=())
print("at hand:", *(use.name for use in problem.train))

# %% [markdown]
# ## What the machine may do
#
# Limits are those of the first shaft. In a problem file they are a section of their own; one that is not stated is as
# far as the recordings went. The controller of the problem leads the motion, so what it cannot follow is not proposed.

# %%
limited = replace(problem, limits={"speed": 60.0, "torque": 0.9})
design = fo.design(limited, criterion="D")
fo.save(design, OUT)

# %% [markdown]
# Eight kinds of motion were tried on the fitted model, each as large as the limits allow. The criterion D is the volume
# of the confidence region of all parameters: ten times smaller is worth 4.6 (natural logarithm of the determinant of
# the information, so twice that of the volume).

# %%
for option in design.options:
    peaks = option.run.peaks
    reach = f"up to {peaks['speed']:5.1f} rad/s, {peaks['torque']:.2f} N m, over {peaks['travel']:5.1f} rad"
    print(f"  {option.run.motion.name:<16} worth {option.worth:5.1f}   {reach}")
best = design.options[0]
print("record:", best.run.motion.sentence)

# %% [markdown]
# `excitation.h5` holds it: the reference to play, and what the model expects every channel to show.

# %%
channels = best.run.recording.channels
figure, panels = plt.subplots(3, 1, figsize=(7.5, 6), sharex=True, layout="constrained")
shown = (("reference", "reference in rad"), ("current", "current in A"), ("load_acceleration", "load in rad/s²"))
for axes, (name, label) in zip(panels, shown, strict=True):
    axes.plot(channels[name].time, channels[name].values, linewidth=0.9)
    axes.set(ylabel=label)
panels[0].set(title=f"What to record next: {best.run.motion.name}")
panels[-1].set(xlabel="time in s")
figure.savefig(OUT / "excitation.png", dpi=120)

# %% [markdown]
# ## What it is worth
#
# The standard errors that the recording at hand leaves, and those that are expected once the motion was recorded as
# well. They count the noise of the sensors alone: what the model misses, a diagnosis says first.

# %%
last = design.options[-1]
values = design.fitted.values
columns = {
    "so far": design.std_errors,
    f"with {last.run.motion.name}": last.std_errors,
    f"with {best.run.motion.name}": best.std_errors,
}
print(f"{'standard error in %':<24}" + "".join(f"{label:>22}" for label in columns))
for k, (name, value) in enumerate(values.items()):
    print(f"{name:<24}" + "".join(f"{100 * errors[k] / abs(value):22.2f}" for errors in columns.values()))

# %%
places, scale = np.arange(len(values)), np.abs(list(values.values()))
figure, axes = plt.subplots(figsize=(7.5, 4.6), layout="constrained")
for (label, errors), marker in zip(columns.items(), ("o", "s", "D"), strict=True):
    axes.semilogx(100 * errors / scale, places, marker, label=label)
axes.set_yticks(places, list(values))
axes.invert_yaxis()
axes.set(title="What another recording is worth", xlabel="standard error in % of the value")
axes.grid(alpha=0.3)
figure.legend(ncols=3, loc="outside lower center")
figure.savefig(OUT / "worth.png", dpi=120)

# %% [markdown]
# The choice of the motion matters more than its length: both take as long as the recording at hand.

# %% [markdown]
# ## Telling explanations apart
#
# The other question that a design answers is which of two explanations is true. After a diagnosis that is `undecided`,
# name the rivals, and the motions are ranked by how far the two stay apart once the false one has adapted:
#
#     fo.design(problem, between=[("stribeck", "motor"), ("quadratic_drag", "motor")])
#
# on the command line `friction-ocp design PROBLEM --between stribeck@motor quadratic_drag@motor`. `power` is then the
# probability that one such recording decides.
