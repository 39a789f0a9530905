# %% [markdown]
# # Your own friction law, and your own effect
#
# The toolkit has eleven friction laws and two dozen effects, and your gearbox is none of them. Here a lubricant whose
# drag levels off with the speed becomes a law of its own, then a suspect of the diagnosis.
#
#     .venv/bin/python problems/tutorials/your_own_law_and_effect.py

# %%
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import matplotlib.pyplot as plt
import numpy as np

import friction_ocp as fo
from friction_ocp.effects.effect import AbstractEffect, Augmentation, Trial, change_shaft, moving_shafts, upwards
from friction_ocp.friction.law import AbstractFrictionLaw
from friction_ocp.friction.static import CoulombViscous
from friction_ocp.parameters import Free, Value, quantity

OUT = Path("results/tutorials/your_own_law_and_effect")
OUT.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## A law
#
# A law is a class whose fields are its parameters. It says the torque at speeds >= 0, once: directions, standstill and
# load are put around it, and names in files and results, units in the report and the C source follow from its fields.


# %%
@fo.register_law
@dataclass(frozen=True)
class Grease(AbstractFrictionLaw):
    """Dry and viscous friction, and a lubricant that shears thin."""

    tau_c: Value = quantity("torque", "Coulomb friction")
    viscous: Value = quantity("viscous", "slope far above omega_v")
    tau_v: Value = quantity("torque", "lubricant drag far above omega_v")
    omega_v: Value = quantity("speed", "speed of half the lubricant drag")
    name: ClassVar[str] = "grease"

    def magnitude(self, speed: Any) -> Any:
        return self.tau_c + self.viscous * speed + self.tau_v * speed / (self.omega_v + speed)


# %% [markdown]
# The same method runs on plain numbers, on arrays and inside the solver, where it is differentiated: write arithmetic,
# no `if`.

# %%
speed = np.linspace(0.0, 14.0, 200)
figure, axes = plt.subplots(figsize=(7.5, 3.2), layout="constrained")
for omega_v in (0.3, 1.0, 3.0, 10.0):
    axes.plot(speed, 1e3 * Grease(0.01, 0.004, 0.05, omega_v).magnitude(speed), label=f"{omega_v:g} rad/s")
axes.set(title="Grease, by the speed of half its drag", xlabel="speed in rad/s", ylabel="friction torque in mN m")
axes.legend(title="omega_v")
axes.grid(alpha=0.3)
figure.savefig(OUT / "law.png", dpi=120)

# %% [markdown]
# ## In a problem file
#
# Registered, it is a law like any other. This is the servo of `first_identification.py` with another two lines.

# %%
text = Path("problems/xl330/coulomb_viscous.yaml").read_text(encoding="utf-8")
text = text.replace("law: coulomb_viscous", "law: grease").replace("../../data", str(Path("data").resolve()))
drag = "tau_v: {guess: 0.01, min: 0, max: 0.3}\n        omega_v: {guess: 2, min: 0.1, max: 20}\n        "
(OUT / "grease.yaml").write_text(text.replace("viscous: {guess", drag + "viscous: {guess"), encoding="utf-8")

plain = fo.identify(fo.load_problem("problems/xl330/coulomb_viscous.yaml"))
greased = fo.identify(fo.load_problem(OUT / "grease.yaml"))
for label, estimate in (("coulomb_viscous", plain), ("grease", greased)):
    errors, _ = estimate.simulation.validation_errors["position"]
    print(f"{label:<16} free run on validation: {errors.mae:.4f} rad mean absolute")
for item in greased.parameters:
    print(f"  {item.name:<24} {item.value:9.3g} {item.unit:<10} {item.verdict.word}")

# %% [markdown]
# Two parameters more and no difference: the fit sends the drag to its bound of zero, and says so. The lubricant of this
# servo is not what the model misses. An answer like that is worth having beside all other suspects: that is what an
# effect is for.
#
# ## An effect
#
# An effect says where it can be, and returns the drive with it. Its parameters are free, and there is an off value that
# gives the old drive back; trials are sizes at which the score test looks first. The clues know how large torques and
# speeds are in the fitted model.


# %%
@fo.register_effect
class GreaseEffect(AbstractEffect):
    """The lubricant of a shaft shears thin."""

    name = "grease"
    sentence = "a lubricant drags at low speed and less so, for its speed, at high speed"

    def places(self, drive):
        return [shaft.name for shaft in moving_shafts(drive) if isinstance(shaft.friction.law, CoulombViscous)]

    def augment(self, drive, place, clues):
        element, path = drive.shaft(place).friction, f"{place}.friction"
        size, typical = 0.05 * clues.typical_torque[place], clues.typical_speed(place)
        law = Grease(element.law.tau_c, element.law.viscous, upwards(size), Free(typical, 0.01 * typical, 10 * typical))
        added = change_shaft(drive, place, friction=replace(element, law=law))
        speeds = (0.1 * typical, 0.3 * typical, typical)
        trials = tuple(Trial(({f"{path}.tau_v": size},), {f"{path}.omega_v": omega_v}) for omega_v in speeds)
        return Augmentation(added, {f"{path}.tau_v": 0.0}, trials)


# %% [markdown]
# Now it stands among the suspects. Naming a few keeps this short; without `effects` it competes with the whole
# catalogue.

# %%
problem = fo.load_problem("problems/xl330/coulomb_viscous.yaml")
suspects = {"effects": ["grease", "load_dependence", "stribeck", "sensor_delay"]}
diagnosis = fo.diagnose(replace(problem, diagnosis=suspects))
folder = fo.save(diagnosis, OUT / "diagnosis")
result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
for cause in result["rounds"][0]["causes"]:
    print(f"  {cause['effect']:<16} at {cause['component']:<9} probability {cause['probability']:.0%}")

# %%
causes = [cause for cause in result["rounds"][0]["causes"] if cause["component"] == "servo"]
figure, axes = plt.subplots(figsize=(7.5, 2.6), layout="constrained")
axes.barh([cause["effect"].replace("_", " ") for cause in causes], [100 * cause["predicted_gain"] for cause in causes])
axes.invert_yaxis()
axes.set(title="What the score test expects of each", xlabel="share of the excess error in %")
figure.savefig(OUT / "suspects.png", dpi=120)

# %% [markdown]
# ## For everyone
#
# `register_law` and `register_effect` hold for this process. To give a law or an effect to others, and to worker
# processes, put it into a package that names it in an entry point:
#
#     [project.entry-points."friction_ocp.laws"]
#     grease = "my_gearboxes:Grease"
#
#     [project.entry-points."friction_ocp.effects"]
#     grease = "my_gearboxes:GreaseEffect"
