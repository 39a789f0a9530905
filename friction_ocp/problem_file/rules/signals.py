"""Rules about what is measured, what drives the machine, and what its controller sees."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from friction_ocp.drive.parts import DRIVING_SIGNALS, Drive, Motor
from friction_ocp.drive.topology import topology
from friction_ocp.drive.units import DRIVE_TORQUE, MOTOR_SIGNALS, REFERENCE_SIGNALS, SHAFT_SIGNALS
from friction_ocp.errors import Finding
from friction_ocp.expressions import closest
from friction_ocp.problem_file.rules.case import Case, Rule

_PREDICTED = {"theta", "omega", "alpha", "torque", "current", "voltage", DRIVE_TORQUE}
_REFERENCE_OF = {"duty": "theta", "p": "theta", "pd": "theta", "cascade": "theta", "pi_velocity": "omega"}
_OTHER_WORDS = {"position": "theta", "angle": "theta", "velocity": "omega", "speed": "omega", "acceleration": "alpha"}
"""What signals are called elsewhere."""


def channels_measure_what_exists(case: Case) -> Iterator[Finding]:
    """`measures` names a part of the drive and a signal that this part has."""
    signals = available_signals(case.drive)
    parts = sorted({signal.partition(".")[0] for signal in signals} - {"temperature"})
    for channel in case.drive.channels:
        where = case.at(f"channels.{channel.name}.measures")
        own = [signal for signal in signals if signal.partition(".")[0] == channel.part]
        if channel.measures in signals:
            continue
        if own:
            what = f"'{channel.part}' has no signal '{channel.signal}'"
            meant = [f"{motor.name}.{channel.signal}" for motor in case.drive.motors if motor.shaft == channel.part]
            meant.append(f"{channel.part}.{_OTHER_WORDS.get(channel.signal, '')}")
            turned = [f"did you mean '{name}'?" for name in meant if name in signals]
            remedy = turned[0] if turned else closest(channel.measures, own)
            yield Finding(where, what, f"available: {', '.join(own)}", remedy)
        else:
            allowed = f"parts: {', '.join(parts)}; or temperature"
            yield Finding(where, f"unknown part '{channel.part}'", allowed, closest(channel.part, parts))


def available_signals(drive: Drive) -> list[str]:
    """Return everything that a channel of the drive could measure."""
    shafts = [f"{shaft.name}.{signal}" for shaft in drive.shafts for signal in (*SHAFT_SIGNALS, DRIVE_TORQUE)]
    motors = [f"{motor.name}.{signal}" for motor in drive.motors for signal in MOTOR_SIGNALS]
    return [*shafts, *motors, *(f"reference.{signal}" for signal in REFERENCE_SIGNALS), "temperature"]


def roles_fit_signals(case: Case) -> Iterator[Finding]:
    """Set points, supply and enable are given to the drive; an acceleration cannot be imposed on it."""
    existing = available_signals(case.drive)
    for channel in case.drive.channels:
        where = case.at(f"channels.{channel.name}.role")
        if channel.measures not in existing:
            continue
        if channel.role == "output" and (channel.part == "reference" or channel.signal not in _PREDICTED):
            yield Finding(where, f"nothing predicts {channel.measures}", "role: input", "state role: input")
        if channel.role == "input" and channel.signal == "alpha":
            yield Finding(where, f"{channel.measures} cannot drive a shaft", "theta or omega, or role: output")
        if channel.role == "input" and channel.signal == DRIVE_TORQUE:
            what = f"{channel.measures} is what a prescribed motion takes, and cannot be given beside it"
            yield Finding(where, what, "role: output", "to drive a shaft by a torque, measure <motor>.torque")


def inputs_are_single(case: Case) -> Iterator[Finding]:
    """No two input channels give the same signal."""
    for measures, count in Counter(channel.measures for channel in case.drive.inputs).items():
        if count > 1:
            names = [channel.name for channel in case.drive.inputs if channel.measures == measures]
            what = f"{' and '.join(names)} are both inputs for {measures}"
            yield Finding(case.at("channels"), what, "one of them", "leave the other out")


def ways_of_driving(drive: Drive, motor: Motor) -> list[str]:
    """Return what makes a motor turn: the signals given to it, and the controller's command."""
    ways = [f"{motor.name}.{signal}" for signal in DRIVING_SIGNALS if _is_input(drive, f"{motor.name}.{signal}")]
    if drive.controller is not None:
        return [*ways, f"controller ({drive.controller.output})"]
    command = f"{motor.name}.current_command"
    return [command] if not ways and _is_input(drive, command) else ways


def _is_input(drive: Drive, measures: str) -> bool:
    return any(channel.measures == measures for channel in drive.inputs)


def _kinds_of_driving(drive: Drive, motor: Motor) -> set[str]:
    kinds = {signal for signal in DRIVING_SIGNALS if _is_input(drive, f"{motor.name}.{signal}")}
    if not kinds and drive.controller is None and _is_input(drive, f"{motor.name}.current_command"):
        return {"current"}
    return kinds if drive.controller is None else kinds | {drive.controller.output}


def _moves_as_prescribed(drive: Drive, shaft: str) -> bool:
    """Whether an input prescribes the motion of a shaft, or that of one rigidly joined to it."""
    joined = topology(drive)
    return any(joined.group_of[part] == joined.group_of.get(shaft) for part in drive.prescribed)


def motors_are_driven(case: Case) -> Iterator[Finding]:
    """Each motor follows a measured current, torque or voltage, a commanded current, or the controller."""
    drive = case.drive
    for k, motor in enumerate(drive.motors):
        driven = ways_of_driving(drive, motor) or drive.prescribed or case.has_points_alone
        if not driven:
            allowed = (
                f"an input channel for {motor.name}.current, .current_command, .torque or .voltage, or a controller"
            )
            yield Finding(case.at(case.place_of_motor(k)), f"nothing drives motor '{motor.name}'", allowed)


def something_moves_the_drive(case: Case) -> Iterator[Finding]:
    """Without a motor or a prescribed motion only a free decay is left."""
    if not case.drive.motors and not case.drive.prescribed and not case.has_points_alone:
        what = "there is no motor, and no input prescribes the motion of a shaft"
        remedy = "add drive.motor unless the recordings show a free decay"
        yield Finding(case.at("drive"), what, remedy=remedy, severity="warning")


def motors_are_driven_once(case: Case) -> Iterator[Finding]:
    """A motor that follows its measured current cannot follow a voltage as well."""
    for k, motor in enumerate(case.drive.motors):
        ways = ways_of_driving(case.drive, motor)
        if len(ways) > 1:
            what = f"motor '{motor.name}' is driven by {' and by '.join(ways)}"
            yield Finding(case.at(case.place_of_motor(k)), what, "one of them", "make the others outputs")


def voltage_needs_resistance(case: Case) -> Iterator[Finding]:
    """The current under a voltage follows from the resistance of the winding."""
    for k, motor in enumerate(case.drive.motors):
        if "voltage" in _kinds_of_driving(case.drive, motor) and motor.resistance is None:
            where = case.at(f"{case.place_of_motor(k)}.resistance")
            what = f"motor '{motor.name}' is driven by voltage, and its resistance is missing"
            yield Finding(where, what, "a number or {guess, min, max}, in ohm")


def motor_outputs_can_be_predicted(case: Case) -> Iterator[Finding]:
    """A motor driven by torque has no known current, one driven by current no known voltage."""
    needed = {"current": {"current", "voltage"}, "voltage": {"voltage"}, "torque": set(DRIVING_SIGNALS)}
    motors = {motor.name: motor for motor in case.drive.motors}
    for channel in case.drive.outputs:
        if channel.signal == DRIVE_TORQUE and not _moves_as_prescribed(case.drive, channel.part):
            what = f"{channel.measures} cannot be predicted: no input prescribes the motion of '{channel.part}'"
            remedy = f"make the channel of {channel.part}.omega or {channel.part}.theta an input"
            yield Finding(case.at(f"channels.{channel.name}"), what, remedy=remedy)
        if channel.part not in motors or channel.signal not in needed:
            continue
        if channel.signal != "voltage" and _moves_as_prescribed(case.drive, motors[channel.part].shaft):
            continue
        kinds = _kinds_of_driving(case.drive, motors[channel.part])
        if not kinds & needed[channel.signal]:
            by = " and ".join(sorted(kinds)) or "nothing"
            what = f"{channel.measures} cannot be predicted: motor '{channel.part}' is driven by {by}"
            yield Finding(
                case.at(f"channels.{channel.name}"), what, remedy="leave the channel out or make it the input"
            )


def something_is_predicted(case: Case) -> Iterator[Finding]:
    """A fit compares at least one output channel."""
    if not case.drive.outputs and not case.has_points_alone:
        names = ", ".join(channel.name for channel in case.drive.channels)
        what = f"no channel is an output ({names} are inputs)" if names else "there are no channels"
        yield Finding(case.at("channels"), what, "at least one output, such as {measures: motor.theta}")


def controller_sees_a_channel(case: Case) -> Iterator[Finding]:
    """The feedback is a channel that measures the angle of a shaft, or its speed for a speed controller."""
    controller, drive = case.drive.controller, case.drive
    if controller is None:
        return
    names = [channel.name for channel in drive.channels]
    shafts = [shaft.name for shaft in drive.shafts]
    wanted = ("theta", "omega") if controller.type == "pi_velocity" else ("theta",)
    channel = next((item for item in drive.channels if item.name == controller.feedback), None)
    if channel is None:
        what = f"unknown feedback channel '{controller.feedback}'"
        remedy = closest(controller.feedback, names)
        yield Finding(case.at("controller.feedback"), what, f"available: {', '.join(names)}", remedy)
    elif channel.part not in shafts or channel.signal not in wanted:
        what = f"feedback channel '{channel.name}' measures {channel.measures}"
        allowed = f"{' or '.join(f'<shaft>.{signal}' for signal in wanted)} for a {controller.type} controller"
        yield Finding(case.at("controller.feedback"), what, allowed)


def controller_has_a_reference(case: Case) -> Iterator[Finding]:
    """The controller follows a recorded set point."""
    controller = case.drive.controller
    if controller is None:
        return
    wanted = f"reference.{_REFERENCE_OF[controller.type]}"
    if not _is_input(case.drive, wanted):
        what = f"the {controller.type} controller has no set point"
        yield Finding(case.at("controller"), what, f"an input channel that measures {wanted}")


def duty_controller_has_a_supply(case: Case) -> Iterator[Finding]:
    """A duty cycle becomes a voltage by the supply."""
    controller = case.drive.controller
    if controller is None or controller.type != "duty":
        return
    if controller.output != "voltage":
        what = f"a duty controller has output {controller.output}"
        yield Finding(case.at("controller.output"), what, "voltage: duty times supply voltage")
    for motor in case.drive.motors:
        if not _is_input(case.drive, f"{motor.name}.supply_voltage"):
            what = f"the duty of motor '{motor.name}' has no supply voltage"
            allowed = f"an input channel that measures {motor.name}.supply_voltage"
            yield Finding(case.at("controller"), what, allowed, "or type: p, whose output is the voltage itself")


def delays_of_inputs_are_known(case: Case) -> Iterator[Finding]:
    """The clock of an input is shifted before the fit; a shift to be found is that of all outputs against it."""
    for channel in case.drive.inputs:
        if not isinstance(channel.delay, (int, float)) and channel is not case.drive.acted_on:
            where = case.at(f"channels.{channel.name}.delay")
            what = f"{channel.name} is not the only input that moves the machine, and its delay cannot be fitted"
            remedy = "fit the delay of the outputs instead: late inputs are early outputs"
            yield Finding(where, what, "a number", remedy)


def clocks_exist(case: Case) -> Iterator[Finding]:
    """A channel is stamped by a clock that the file describes."""
    names = [clock.name for clock in case.drive.clocks]
    for channel in case.drive.channels:
        if channel.clock and channel.clock not in names:
            where = case.at(f"channels.{channel.name}.clock")
            there = f"there are {', '.join(names)}" if names else "describe it in clocks"
            yield Finding(where, f"unknown clock '{channel.clock}'", there, closest(channel.clock, names))


def clocks_of_inputs_are_known(case: Case) -> Iterator[Finding]:
    """The stamps of an input are moved before the fit; what is to be found is the clock of the outputs against it."""
    for channel in case.drive.inputs:
        clock = case.drive.clock_of(channel)
        for key in ("offset", "drift") if clock else ():
            if not isinstance(getattr(clock, key), (int, float)):
                what = f"{channel.name} is an input, and its clock cannot be fitted"
                remedy = "fit the clock of the outputs instead: it is what differs"
                yield Finding(case.at(f"clocks.{channel.clock}.{key}"), what, "a number", remedy)


def delay_needs_a_sample_time(case: Case) -> Iterator[Finding]:
    """Only a sampled controller can be late."""
    controller = case.drive.controller
    if controller is not None and controller.sample_time is None and controller.delay > 0:
        what = f"delay = {controller.delay:g} s of a controller without sample_time has no effect"
        yield Finding(case.at("controller.delay"), what, remedy="state sample_time")


def process_noise_acts_on_shafts(case: Case) -> Iterator[Finding]:
    """Process noise is a torque on a shaft that exists."""
    names = [shaft.name for shaft in case.drive.shafts]
    options = case.problem.estimation
    for name in dict.fromkeys((*options.process_noise, *options.estimated_noise)):
        if name not in names:
            where = case.at(f"estimation.process_noise.{name}")
            yield Finding(where, f"unknown shaft '{name}'", f"there are {', '.join(names)}", closest(name, names))


SIGNALS: tuple[Rule, ...] = (
    channels_measure_what_exists,
    roles_fit_signals,
    inputs_are_single,
    motors_are_driven_once,
    delays_of_inputs_are_known,
    clocks_exist,
    clocks_of_inputs_are_known,
    delay_needs_a_sample_time,
    process_noise_acts_on_shafts,
)
WHOLE: tuple[Rule, ...] = (
    motors_are_driven,
    something_moves_the_drive,
    voltage_needs_resistance,
    motor_outputs_can_be_predicted,
    something_is_predicted,
    controller_sees_a_channel,
    controller_has_a_reference,
    duty_controller_has_a_supply,
)
"""Rules about what has to be there."""
