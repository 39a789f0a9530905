"""Compiled: inputs, sampled controllers and sensors."""

from __future__ import annotations

import math

from numba import njit

from .flaw_kernels import wave
from .layout import ALPHA, CASCADE, DUTY, ECCENTRICITY, MOTOR_CURRENT, OMEGA, PD, THETA


@njit
def read_signals(m, st, time, value, n):
    """Set the value of every input at the start and the end of step n."""
    h = m.step
    for j in range(m.inputs):
        at = st.signal_at[j]
        last = m.signal[j + 1] - 1
        while at < last and time[at + 1] <= (n + 0.5) * h:
            at += 1
        st.signal_at[j] = at
        start = value[at]
        slope = 0.0
        if m.signal_linear[j] == 1 and at < last and time[at] < (n + 0.5) * h:
            slope = (value[at + 1] - start) / (time[at + 1] - time[at])
        st.signal_now[j, 0] = start + slope * (n * h - time[at])
        st.signal_now[j, 1] = start + slope * ((n + 1) * h - time[at])


@njit
def reading(m, st, ready, recorded, sensor, n):
    """Return the newest value of a sensor that has arrived by step n."""
    at = st.sensor_at[sensor, 1]
    while at + 1 < m.sample[sensor + 1] and ready[at + 1] <= n:
        at += 1
    st.sensor_at[sensor, 1] = at
    return recorded[at]


@njit
def control_law(m, st, c, theta_ref, omega_ref, theta, omega):
    """Return the saturated command of a tick."""
    kp, ki, kd, low = m.gain[c, 0], m.gain[c, 1], m.gain[c, 2], m.gain[c, 3]
    high, supply, period = m.gain[c, 4], m.gain[c, 5], m.gain[c, 6]
    kind = m.controller[c, 0]
    error = theta_ref - theta
    if kind == DUTY:
        return supply * min(max(kp * error, low), high)
    if kind <= PD:
        return min(max(kp * error + kd * (omega_ref - omega), low), high)
    if kind == CASCADE:
        error = kp * error + omega_ref - omega
        kp = kd
    else:
        error = omega_ref - omega
    raw = kp * error + st.loop[c, 0]
    outward = (raw > high and ki * error > 0.0) or (raw < low and ki * error < 0.0)
    if m.controller[c, 5] == 0 or not outward:
        st.loop[c, 0] += ki * period * error
    return min(max(kp * error + st.loop[c, 0], low), high)


@njit
def control(m, st, reference, issued, ready, recorded, n):
    """Run the controllers whose tick is due and apply the commands that have arrived."""
    for c in range(m.controllers):
        k = st.counter[c, 0]
        if m.tick[c] + k < m.tick[c + 1] and int(k * m.gain[c, 6] / m.step + 0.5) <= n:
            theta = reading(m, st, ready, recorded, m.controller[c, 1], n)
            if k == 0:
                st.loop[c, 1] = theta
                st.loop[c, 2] = theta
            taps = 1 + m.controller[c, 4]
            omega = (theta - st.loop[c, taps]) / (taps * m.gain[c, 6])
            if m.controller[c, 2] >= 0:
                omega = reading(m, st, ready, recorded, m.controller[c, 2], n)
            row = m.tick[c] + k
            issued[row] = control_law(m, st, c, reference[row, 0], reference[row, 1], theta, omega)
            st.loop[c, 2] = st.loop[c, 1]
            st.loop[c, 1] = theta
            st.counter[c, 0] = k + 1
        k = st.counter[c, 1]
        while k < st.counter[c, 0] and int(k * m.gain[c, 6] / m.step + 0.5) + m.controller[c, 3] <= n:
            st.command[c] = issued[m.tick[c] + k]
            k += 1
        st.counter[c, 1] = k


@njit
def eccentric(m, st, c, value, theta):
    """Return the reading of an eccentric sensor: its angle ripples with the angle, its speed with the slope of that."""
    if m.sensor[c, 0] == THETA:
        return value + wave(m, ECCENTRICITY + c, value)[0]
    if m.sensor[c, 0] == OMEGA:
        return value * (1.0 + wave(m, ECCENTRICITY + c, theta)[1])
    return value


@njit
def sense(m, st, step, fraction, recorded, n):
    """Record the samples that fall into step n; alpha lies mid step and is taken one step late."""
    h = m.step
    for c in range(m.sensors):
        kind, item = m.sensor[c, 0], m.sensor[c, 1]
        late = 1 if kind == ALPHA else 0
        at = st.sensor_at[c, 0]
        while at < m.sample[c + 1] and step[at] + late <= n:
            f = fraction[at]
            if kind <= ALPHA:
                g, s = m.group[item], m.scale[item]
                if kind == THETA:
                    way = h * st.omega[g, 1]
                    value = st.theta[g, 1] + f * way + f * f * (st.theta[g, 0] - st.theta[g, 1] - way)
                elif kind == OMEGA:
                    value = st.omega[g, 1] + f * (st.omega[g, 0] - st.omega[g, 1])
                else:
                    value = st.alpha[g, 1] + (f - 0.5) * (st.alpha[g, 0] - st.alpha[g, 1])
                value *= s
                if m.wave_at[ECCENTRICITY + c] < m.wave_at[ECCENTRICITY + c + 1]:
                    value = eccentric(m, st, c, value, s * st.theta[g, 2])
            else:
                column = 2 * (kind - MOTOR_CURRENT)
                value = st.motor[item, column] + f * (st.motor[item, column + 1] - st.motor[item, column])
            value = m.scaling[c, 0] * value + m.scaling[c, 1] + recorded[at]
            if m.scaling[c, 2] > 0.0:
                value = math.floor(value / m.scaling[c, 2] + 0.5) * m.scaling[c, 2]
            recorded[at] = value
            at += 1
        st.sensor_at[c, 0] = at
