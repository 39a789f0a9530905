"""Memory layout of the compiled kernels: signal and law codes, constants of a run, and its changing state.

Both are records of fixed size: compiled once for every drive, and passed on as one pointer.
"""

from __future__ import annotations

import numpy as np

STATIC, BRISTLE, GMS, LOOP = 0, 1, 2, 3
TAU_C, TAU_S, OMEGA_S, DELTA, VISCOUS, QUADRATIC, SIGMA0, SIGMA1, LOAD_C, LOAD_S, LOAD_V, PIECES = range(12)
SLOPES, BREAKS, COLUMNS = 12, 20, 28
CURRENT, TORQUE, VOLTAGE = 0, 1, 2
THETA, OMEGA, ALPHA, MOTOR_CURRENT, MOTOR_TORQUE, MOTOR_VOLTAGE, _, MOTOR_COMMAND = range(8)
P, PD, PI_VELOCITY, CASCADE, DUTY = range(5)
SHAFTS, JOINTS, MOTORS, INPUTS, CONTROLLERS, SENSORS = 12, 12, 6, 24, 4, 32
LOOPS, WAVES, AMPLIFIER_STEPS = 6, 96, 4096
COGGING, TORQUE_RIPPLE, FRICTION_RIPPLE = 0, MOTORS, 2 * MOTORS
VISCOUS_RIPPLE = FRICTION_RIPPLE + SHAFTS
DISTURBANCE = VISCOUS_RIPPLE + SHAFTS
KINEMATIC = DISTURBANCE + SHAFTS
ECCENTRICITY = KINEMATIC + JOINTS
PLACES = ECCENTRICITY + SENSORS

FLOAT, INT = np.float64, np.int64

# g groups of rigidly joined shafts, s shafts, e elastic joints, m motors, i inputs, c controllers, n sensors
MODEL = np.dtype(
    [
        ("step", FLOAT),
        ("truth_every", INT),
        ("groups", INT),
        ("shafts", INT),
        ("joints", INT),
        ("motors", INT),
        ("inputs", INT),
        ("controllers", INT),
        ("sensors", INT),
        ("first", INT, (SHAFTS + 1,)),  # shafts of group g are shaft[first[g]:first[g + 1]], parents before children
        ("shaft", INT, (SHAFTS,)),
        ("parent", INT, (SHAFTS,)),  # rigid parent or -1
        ("forward", INT, (SHAFTS,)),  # 1 where the parent is the motor side
        ("scale", FLOAT, (SHAFTS,)),  # shaft speed = scale * group speed
        ("group", INT, (SHAFTS,)),
        ("inertia", FLOAT, (SHAFTS,)),
        ("group_inertia", FLOAT, (SHAFTS,)),
        (
            "traits",
            INT,
            (SHAFTS, 3),
        ),  # set-valued, implicit in the joint torque, input of the prescribed speed or -1
        ("law", INT, (SHAFTS,)),
        ("friction", FLOAT, (SHAFTS, 2, COLUMNS)),  # by direction
        ("applied", FLOAT, (SHAFTS, 4)),  # gravity torque, gravity phase, constant torque, 1 where no joint ends
        ("external", INT, (SHAFTS,)),  # input or -1
        ("noise_std", FLOAT, (SHAFTS,)),  # torque held for one step
        ("joint", INT, (JOINTS, 2)),  # from, to
        ("elastic", FLOAT, (JOINTS, 4)),  # ratio, stiffness, damping, half the free play
        ("motor", INT, (MOTORS, 5)),  # shaft, drive, input, controller, enable input
        ("winding", FLOAT, (MOTORS, 5)),  # torque constant, resistance, inductance, share, bias
        ("signal", INT, (INPUTS + 1,)),  # offsets into the time and value arrays
        ("signal_linear", INT, (INPUTS,)),
        ("controller", INT, (CONTROLLERS, 6)),  # type, feedback, rate feedback, delay steps, two taps, anti-windup
        ("gain", FLOAT, (CONTROLLERS, 7)),  # kp, ki, kd, low, high, supply, sample time
        ("tick", INT, (CONTROLLERS + 1,)),  # offsets into the references
        ("sensor", INT, (SENSORS, 2)),  # signal code, shaft or motor
        ("scaling", FLOAT, (SENSORS, 3)),  # gain, offset, resolution
        ("sample", INT, (SENSORS + 1,)),  # offsets into the samples
        ("wave", FLOAT, (WAVES, 3)),  # cosine, sine, wave number of every harmonic
        ("wave_at", INT, (PLACES + 1,)),  # offsets into them by place
        ("warm", FLOAT, (SHAFTS, 4)),  # time constant or 0, dry, viscous, power or 0
        ("memory", FLOAT, (SHAFTS, 3)),  # share, scale, time constant
        ("friction_input", INT, (SHAFTS, 2)),  # inputs of a factor on the friction and of added dry friction, or -1
        ("bumper", FLOAT, (SHAFTS, 4)),  # low, high, stiffness or 0, damping
        ("spring", FLOAT, (JOINTS, 4)),  # cubic, second stiffness, its twist, ratio error over the output angle
        ("loops", INT, (JOINTS, 2)),  # count, smooth
        ("loop", FLOAT, (JOINTS, LOOPS, 2)),  # torque, twist
        ("amplifier", FLOAT, (MOTORS, 4)),  # rate limit, time constant, hysteresis share and width
        ("amplifier_delay", INT, (MOTORS,)),  # steps
        ("iron", FLOAT, (MOTORS, 3)),  # saturation: form or 0, current, sharpness
    ],
    align=True,
)

STATE = np.dtype(
    [
        ("theta", FLOAT, (SHAFTS, 3)),  # per group: now, at the start of the step, at mid step
        ("omega", FLOAT, (SHAFTS, 3)),  # per group: now, at the start of the step, predicted mid step
        ("alpha", FLOAT, (SHAFTS, 3)),  # per group: this step, the step before, noise torque / inertia
        ("bristle", FLOAT, (SHAFTS, 8)),
        ("memory", FLOAT, (SHAFTS,)),  # bristle rate of the step, or level of springs that slip, positive direction
        ("opposite", FLOAT, (SHAFTS,)),  # the same level, negative direction
        ("force", FLOAT, (SHAFTS, 8)),  # applied, its slope, passed on, friction A, B, torque T, work space, motors
        ("joint_torque", FLOAT, (JOINTS,)),
        # current, torque, voltage at start and end, mean voltage, inductive current, command at start and end, kt
        ("motor", FLOAT, (MOTORS, 11)),
        ("signal_at", INT, (INPUTS,)),
        ("signal_now", FLOAT, (INPUTS, 2)),  # start and end of the step
        ("command", FLOAT, (CONTROLLERS,)),
        ("loop", FLOAT, (CONTROLLERS, 3)),  # integral, previous readings
        ("counter", INT, (CONTROLLERS, 2)),  # next tick, next command to apply
        ("sensor_at", INT, (SENSORS, 2)),  # next sample, last one seen by a controller
        ("clock", FLOAT, (1,)),  # time at mid step
        ("factor", FLOAT, (SHAFTS, 3)),  # on dry and on viscous friction; dry friction added
        ("warmth", FLOAT, (SHAFTS,)),
        ("swing", FLOAT, (SHAFTS,)),  # filtered acceleration
        ("slipped", FLOAT, (JOINTS, LOOPS)),
        ("queue", FLOAT, (MOTORS, AMPLIFIER_STEPS, 2)),  # commands under way, at start and end of their step
        ("amplified", FLOAT, (MOTORS, 2)),  # behind the rate limit, behind the lag
        ("magnet", FLOAT, (MOTORS, 2)),  # current since the last reversal within its limits, last current
    ],
    align=True,
)
