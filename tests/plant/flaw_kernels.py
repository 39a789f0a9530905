"""Compiled: ripples, amplifier and iron of a motor, loops and stiffening of a joint, factors on the friction."""

from __future__ import annotations

import math

from numba import njit

from .layout import (
    AMPLIFIER_STEPS,
    COGGING,
    DISTURBANCE,
    FRICTION_RIPPLE,
    KINEMATIC,
    TORQUE_RIPPLE,
    VISCOUS_RIPPLE,
)


@njit
def wave(m, place, x):
    """Return the ripple of a place at x, and its slope."""
    value, slope = 0.0, 0.0
    for k in range(m.wave_at[place], m.wave_at[place + 1]):
        number = m.wave[k, 2]
        c, s = math.cos(number * x), math.sin(number * x)
        value += m.wave[k, 0] * c + m.wave[k, 1] * s
        slope += number * (m.wave[k, 1] * c - m.wave[k, 0] * s)
    return value, slope


@njit
def saturated(form, limit, sharpness, current):
    """Return the current that would make the same torque without saturation."""
    if form == 0:
        return current
    x = abs(current) / limit
    if form == 1:
        size = math.tanh(x)
    elif form == 2:
        size = x / (1.0 + x**sharpness) ** (1.0 / sharpness)
    else:
        size = x - x**3 / 3.0 if x < 1.0 else 2.0 / 3.0
    return math.copysign(limit * size, current)


@njit
def amplify(m, st, j, begin, end, n):
    """Return the command of motor j behind delay, rate limit and lag, at both ends of step n."""
    late = m.amplifier_delay[j]
    if late > 0:
        slot = n % AMPLIFIER_STEPS
        st.queue[j, slot, 0], st.queue[j, slot, 1] = begin, end
        if n >= late:
            slot = (n - late) % AMPLIFIER_STEPS
            begin, end = st.queue[j, slot, 0], st.queue[j, slot, 1]
        else:
            begin = end = st.queue[j, 0, 0]
    limit, lag = m.amplifier[j, 0], m.amplifier[j, 1]
    if n == 0:
        st.amplified[j, 0] = st.amplified[j, 1] = begin
    if limit < math.inf:
        begin = st.amplified[j, 0]
        end = begin + min(max(end - begin, -limit * m.step), limit * m.step)
        st.amplified[j, 0] = end
    if lag > 0.0:
        wanted = 0.5 * (begin + end)
        begin = st.amplified[j, 1]
        end = wanted + (begin - wanted) * math.exp(-m.step / lag)
        st.amplified[j, 1] = end
    return begin, end


@njit
def magnetised(m, st, j, begin, end):
    """Return the currents that count for the torque, with what the iron keeps from before."""
    share, width = m.amplifier[j, 2], m.amplifier[j, 3]
    if share == 0.0:
        return begin, end
    first = min(max(st.magnet[j, 0] + begin - st.magnet[j, 1], -width), width)
    last = min(max(first + end - begin, -width), width)
    st.magnet[j, 0], st.magnet[j, 1] = last, end
    return begin - share * first, end - share * last


@njit
def ripple_torque(m, st, j):
    """Return cogging of motor j and the factor on its torque constant, at mid step."""
    i = m.motor[j, 0]
    theta = m.scale[i] * st.theta[m.group[i], 2]
    return wave(m, COGGING + j, theta)[0], 1.0 + wave(m, TORQUE_RIPPLE + j, theta)[0]


@njit
def scale_friction(m, st, i):
    """Set the factors on dry and viscous friction of a shaft, and the dry friction added to it."""
    g, s = m.group[i], m.scale[i]
    theta, omega = s * st.theta[g, 2], s * st.omega[g, 2]
    dry = 1.0 + wave(m, FRICTION_RIPPLE + i, theta)[0]
    viscous = 1.0 + wave(m, VISCOUS_RIPPLE + i, theta)[0]
    dry *= 1.0 + m.warm[i, 1] * st.warmth[i]
    viscous *= 1.0 + m.warm[i, 2] * st.warmth[i]
    if m.memory[i, 0] != 0.0:
        side = 1.0 if omega >= 0.0 else -1.0
        dry *= 1.0 + m.memory[i, 0] * math.tanh(side * st.swing[i] / m.memory[i, 1])
    if m.friction_input[i, 0] >= 0:
        factor = 0.5 * (st.signal_now[m.friction_input[i, 0], 0] + st.signal_now[m.friction_input[i, 0], 1])
        dry *= factor
        viscous *= factor
    st.factor[i, 0], st.factor[i, 1], st.factor[i, 2] = dry, viscous, 0.0
    if m.friction_input[i, 1] >= 0:
        at = m.friction_input[i, 1]
        st.factor[i, 2] = 0.5 * (st.signal_now[at, 0] + st.signal_now[at, 1])


@njit
def outside_torque(m, st, i):
    """Return the torque of a bumper and of a disturbance periodic in time on shaft i, at mid step."""
    torque = wave(m, DISTURBANCE + i, st.clock[0])[0]
    g, s = m.group[i], m.scale[i]
    theta, omega = s * st.theta[g, 2], s * st.omega[g, 2]
    low, high, stiffness, damping = m.bumper[i, 0], m.bumper[i, 1], m.bumper[i, 2], m.bumper[i, 3]
    if stiffness > 0.0 and theta > high:
        torque -= max(0.0, stiffness * (theta - high) + damping * omega)
    elif stiffness > 0.0 and theta < low:
        torque += max(0.0, stiffness * (low - theta) - damping * omega)
    return torque


@njit
def heat_up(m, st, i, mean):
    """Advance the warmth and the filtered acceleration of shaft i by a step of mean speed `mean`."""
    if m.warm[i, 0] > 0.0:
        source = 1.0
        if m.warm[i, 3] > 0.0:
            source = abs((st.force[i, 3] + st.force[i, 4] * mean) * mean) / m.warm[i, 3]
        st.warmth[i] += (source - st.warmth[i]) * -math.expm1(-m.step / m.warm[i, 0])
    if m.memory[i, 0] != 0.0:
        a = m.scale[i] * st.alpha[m.group[i], 0]
        st.swing[i] += (a - st.swing[i]) * -math.expm1(-m.step / m.memory[i, 2])


@njit
def kinematic(m, e, theta_in, theta_out):
    """Return the error of the ratio of joint e on the output side, and its slopes over both angles."""
    if m.wave_at[KINEMATIC + e] == m.wave_at[KINEMATIC + e + 1]:
        return 0.0, 0.0, 0.0
    if m.spring[e, 3] == 0.0:
        value, slope = wave(m, KINEMATIC + e, theta_in)
        return value, slope, 0.0
    value, slope = wave(m, KINEMATIC + e, theta_out)
    return value, 0.0, slope


@njit
def slip(smooth, z, way):
    """Return the deflection, in slip twists, of an element after `way` slip twists."""
    if smooth == 0:
        return min(max(z + way, -1.0), 1.0)
    side = 1.0 if way > 0.0 else -1.0
    return side + (z - side) * math.exp(-abs(way))


@njit
def spring_torque(m, st, e, twist, way):
    """Return what stiffening and loops add to the torque of joint e at `twist`, `way` beyond the start of the step."""
    half = m.elastic[e, 3]
    beyond = math.copysign(max(0.0, abs(twist) - half), twist)
    torque = m.spring[e, 0] * beyond**3
    if m.spring[e, 1] != 0.0:
        torque += math.copysign(m.spring[e, 1] * max(0.0, abs(beyond) - m.spring[e, 2]), beyond)
    for k in range(m.loops[e, 0]):
        torque += m.loop[e, k, 0] * slip(m.loops[e, 1], st.slipped[e, k], way / m.loop[e, k, 1])
    return torque


@njit
def settle_loops(m, st):
    """Advance the loops of all joints by the twist of the step."""
    for e in range(m.joints):
        if m.loops[e, 0] == 0:
            continue
        i, j = m.joint[e, 0], m.joint[e, 1]
        si, sj, gi, gj = m.scale[i], m.scale[j], m.group[i], m.group[j]
        after = kinematic(m, e, si * st.theta[gi, 0], sj * st.theta[gj, 0])[0]
        before = kinematic(m, e, si * st.theta[gi, 1], sj * st.theta[gj, 1])[0]
        way = si / m.elastic[e, 0] * (st.theta[gi, 0] - st.theta[gi, 1])
        way += after - before - sj * (st.theta[gj, 0] - st.theta[gj, 1])
        for k in range(m.loops[e, 0]):
            st.slipped[e, k] = slip(m.loops[e, 1], st.slipped[e, k], way / m.loop[e, k, 1])
