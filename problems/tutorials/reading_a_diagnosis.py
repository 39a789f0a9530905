# %% [markdown]
# # Reading a diagnosis
#
# In `first_identification.py` a model with Coulomb and viscous friction left 0.056 rad between the simulated servo and
# the real one, while its encoder resolves 0.0015 rad: something is missing. What?
#
# `diagnose` adds every effect of its catalogue to the model, at every place where it makes sense, and lets recordings
# that took no part in the fit decide. The answer takes about a minute.
#
#     .venv/bin/python problems/tutorials/reading_a_diagnosis.py

# %%
import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import friction_ocp as fo

OUT = Path("results/tutorials/reading_a_diagnosis")

# %%
problem = fo.load_problem("problems/xl330/coulomb_viscous.yaml")
diagnosis = fo.diagnose(problem)
folder = fo.save(diagnosis, OUT)
result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
print("verdict:", result["verdict"])

# %% [markdown]
# ## The verdict
#
# | verdict | means |
# |---|---|
# | `no_gap` | the model leaves nothing but noise |
# | `explained` | what `accepted` lists was missing, and with it nothing but noise is left |
# | `undecided` | something is missing, but these recordings cannot tell which of an alias set it is |
# | `unknown_effect` | what was found helps, but what is left is more than noise, and nothing in the catalogue fits |
#
# A real machine that is looked at with a good encoder will often say `unknown_effect`. That is no failure: it is told
# how much of the gap is understood, and that the rest is real.
#
# ## What was missing
#
# One effect is added a round. Every candidate has three gains, as shares of the excess error: what the score test
# expected before any refit, what the refit reached on the recordings that it saw, and what was left of that on
# recordings that were held out. Only the last one counts: a gain that vanishes there was a fit of something else.
# Candidates of which the score test expects too little are not refitted.

# %%
for number, decision in enumerate(result["rounds"], 1):
    print(f"round {number}: power of the innovations, over the noise: {decision['excess']['ratio']:.0f}")
    refitted = [cause for cause in decision["causes"] if cause["heldout_gain"] is not None]
    for cause in refitted:
        where = f"{cause['effect'].replace('_', ' ')} at {cause['component']}"
        gains = "  ".join(f"{cause[key]:4.0%}" for key in ("predicted_gain", "refit_gain", "heldout_gain"))
        print(f"  {where:<28} probability {cause['probability']:4.0%}   gains {gains}")
    print(f"  and {len(decision['causes']) - len(refitted)} more that were not refitted")
for item in result["accepted"]:
    sizes = ", ".join(f"{name} = {found['value']:.2g}" for name, found in item["parameters"].items())
    print(f"accepted: {item['effect']} at {item['component']}: {sizes}")

# %%
first = result["rounds"][0]
causes = [cause for cause in first["causes"] if cause["heldout_gain"] is not None]
places = np.arange(len(causes))
figure, axes = plt.subplots(figsize=(7.5, 0.9 + 0.62 * len(causes)), layout="constrained")
for shift, key, label in ((-0.2, "refit_gain", "on what it was fitted to"), (0.2, "heldout_gain", "held out")):
    axes.barh(places + shift, [100 * cause[key] for cause in causes], 0.38, label=label)
axes.set_yticks(places, [f"{cause['effect'].replace('_', ' ')} at {cause['component']}" for cause in causes])
axes.axvline(0, color="0.3", linewidth=0.8)
axes.invert_yaxis()
axes.set(title="Round 1: who keeps the promise?", xlabel="share of the excess error that is gone in %", xlim=(-60, 60))
figure.legend(ncols=2, loc="outside lower center")
figure.savefig(OUT / "gains.png", dpi=120)

# %% [markdown]
# Friction that grows with the torque which the gear transmits: teeth are pressed together by the load they carry, and
# rub the more. It makes mechanical sense, and it is what we saw in the first tutorial: under the load of the lifted
# pendulum the servo held still, where the simulation sank on.
#
# ## What cannot be told apart
#
# Members of an alias set explain these recordings equally well. The best of them is accepted, because the model is
# better with it; which of them it is remains open until something is recorded that separates them. Where more than
# noise is left, as here, the cause need not be among them: they come as near, no more.

# %%
for members in result["alias_sets"]:
    print("cannot be told apart:", " or ".join(f"{item['effect']} at {item['component']}" for item in members))
for members in result["as_near"]:
    print("come as near:", " and ".join(f"{item['effect']} at {item['component']}" for item in members))
if result["next_experiment"]:
    print(result["next_experiment"]["text"])

# %% [markdown]
# ## How far it goes
#
# The gap is measured by free runs of the validation recordings, which chose nothing. Its interval comes from resampling
# their blocks.

# %%
gap = result["gap"]
low, high = gap["shrink"]["interval95"]
for name, before in gap["before"].items():
    after = gap["after"][name]
    print(f"{name}: rms {before['rms']:.3f} {before['unit']} before, {after['rms']:.3f} {after['unit']} after")
print(f"{gap['shrink']['overall']:.0%} of the excess error is gone, 95 %: {low:.0%} to {high:.0%}")

# %%
figure, panels = plt.subplots(2, 1, figsize=(7.5, 5.5), sharex=True, layout="constrained")
pairs = zip(diagnosis.before.runs, diagnosis.after.runs, strict=True)
shown = [pair for pair in pairs if pair[0].name.startswith(("lift", "sin_sin"))]
for axes, (before, after) in zip(panels, shown, strict=True):
    axes.plot(before.time, before.measured[:, 0], "k", linewidth=1.8, label="measured")
    axes.plot(before.time, before.simulated[:, 0], "0.65", label="simulated before")
    axes.plot(after.time, after.simulated[:, 0], "tab:orange", label="with what was found")
    axes.set(title=before.name, ylabel="angle in rad")
panels[1].set(xlabel="time in s")
figure.legend(*panels[0].get_legend_handles_labels(), ncols=3, loc="outside lower center")
figure.savefig(OUT / "before_after.png", dpi=120)

# %% [markdown]
# ## What it did to the parameters
#
# A model that misses something bends the parameters that it has. This is the reason to diagnose before believing an
# identified friction: the Coulomb and viscous friction of the first tutorial were mostly load-dependent friction in
# disguise.

# %%
for item in result["biased_parameters"]:
    print(f"  {item['name']:<24} {item['before']:9.4f} before, {item['after']:9.4f} {item['unit']} after")

# %% [markdown]
# `augmented.yaml` in the same folder is the problem with what was found, for `simulate`, `identify` or another round of
# questions; `report.html` shows all of this, and where and when the gap is seen.
