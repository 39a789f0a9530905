"""Noise of measured inputs as states of a drive: a sensor shows it, and the machine does not feel it.

Noise of an input that runs in lines from sample to sample does so itself: it has a value at the first sample and a
rate. That of one that is held has a value alone. Source: Fuller 1987, Measurement error models (functional models: the
true inputs are unknowns).
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from friction_ocp.drive.stepping import SteppedDrive

NOISE, RATE = ".noise", ".noise_rate"


def noise_states(drive: SteppedDrive) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the columns of the noise of all noisy inputs, and those of the rates, of which held ones have none."""
    names = drive.state_names
    noise = [names.index(name + NOISE) for name in drive.noisy_inputs]
    return tuple(noise), tuple(k for k, name in enumerate(names) if name.endswith(RATE))


def with_input_noise(drive: SteppedDrive, inputs: tuple[str, ...]) -> SteppedDrive:
    """Return a drive that feels some inputs without the noise that its further states are.

    The noise is in units of the input as it is recorded. It stays, and rises at its rate; at the start there is none.
    """
    if not inputs:
        return drive
    holds = {channel.name: channel.hold for channel in drive.mechanism.drive.inputs}
    lines = tuple(name for name in inputs if holds[name] == "linear")
    columns = [drive.input_names.index(name) for name in inputs]
    rising = [inputs.index(name) for name in lines]

    def felt(function: ca.Function, middle: bool) -> ca.Function:
        arguments = [ca.SX.sym(f"a{k}", function.size1_in(k)) for k in range(function.n_in())]
        noise, rate = ca.SX.sym("noise", len(inputs)), ca.SX.sym("rate", len(lines))
        state, signals, *rest = arguments
        slope = ca.SX.zeros(len(inputs))
        slope[rising] = rate
        shown = ca.SX(signals)
        shown[columns] -= noise + (0.5 * rest[1] * slope if middle else 0.0)
        value, *further = function.call([state, shown, *rest], True, False)
        if middle:
            value = ca.vertcat(value, noise + rest[1] * slope, rate)
        elif function.name() == "tick":
            value = ca.vertcat(value, noise, rate)
        return ca.Function(function.name(), [ca.vertcat(state, noise, rate), signals, *rest], [value, *further])

    arguments = [ca.SX.sym(f"a{k}", drive.start.size1_in(k)) for k in range(drive.start.n_in())]
    start = ca.vertcat(drive.start.call(arguments, True, False)[0], ca.SX.zeros(len(inputs) + len(lines)))
    further = (*(name + NOISE for name in inputs), *(name + RATE for name in lines))
    return replace(
        drive,
        state_names=(*drive.state_names, *further),
        step=felt(drive.step, middle=True),
        output=felt(drive.output, middle=False),
        tick=None if drive.tick is None else felt(drive.tick, middle=False),
        start=ca.Function("start", arguments, [start]),
        implicit={name: felt(item, middle=name == "step") for name, item in drive.implicit.items()},
        noisy_inputs=inputs,
    )
