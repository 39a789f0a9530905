"""Compiled: the time step of the whole drive and the loop over steps.

Rigidly joined shafts form a group with one speed; shaft speed = scale * group speed. A step drifts the angles half a
step, finds the mean acceleration of the step with friction linear-implicit about a predicted mid-step speed
(torque = A + B omega_mid), and splits the step where a speed passes zero. Second order, with exact sticking.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numba
from numba import njit

from .flaw_kernels import (
    amplify,
    heat_up,
    kinematic,
    magnetised,
    outside_torque,
    ripple_torque,
    saturated,
    scale_friction,
    settle_loops,
    spring_torque,
)
from .layout import BREAKS, BRISTLE, CURRENT, GMS, LOOP, PIECES, SIGMA0, SLOPES, VOLTAGE
from .mechanics import contact, demand, move
from .signals import control, read_signals, sense


@njit
def drive_motors(m, st, n):
    """Add the motor torques to their shafts, with the slope that back-EMF gives them."""
    for j in range(m.motors):
        i = m.motor[j, 0]
        kt, resistance, inductance = m.winding[j, 0], m.winding[j, 1], m.winding[j, 2]
        share, bias = m.winding[j, 3], m.winding[j, 4]
        begin = end = st.command[m.motor[j, 3]] if m.motor[j, 3] >= 0 else 0.0
        if m.motor[j, 2] >= 0:
            begin, end = st.signal_now[m.motor[j, 2], 0], st.signal_now[m.motor[j, 2], 1]
        row = st.motor[j]
        for k in range(7):
            row[k] = 0.0
        row[8], row[9] = begin, end
        begin, end = amplify(m, st, j, share * begin + bias, share * end + bias, n)
        cogging, ripple = ripple_torque(m, st, j)
        st.force[i, 0] += cogging
        if m.motor[j, 4] >= 0 and st.signal_now[m.motor[j, 4], 0] < 0.5:
            row[7] = 0.0
            continue
        form, limit, sharpness = m.iron[j, 0], m.iron[j, 1], m.iron[j, 2]
        if m.motor[j, 1] != VOLTAGE:
            if m.motor[j, 1] != CURRENT:
                begin, end = begin / kt, end / kt
            row[0], row[1] = begin, end
            begin, end = magnetised(m, st, j, begin, end)
            row[2] = kt * ripple * saturated(form, limit, sharpness, begin)
            row[3] = kt * ripple * saturated(form, limit, sharpness, end)
            st.force[i, 0] += 0.5 * (row[2] + row[3])
            st.force[i, 7] += 0.5 * (row[2] + row[3]) * m.applied[i, 3]
            continue
        row[4], row[5], row[6] = begin, end, 0.5 * (begin + end)
        kt *= ripple
        if form > 0 and row[7] != 0.0:
            kt *= saturated(form, limit, sharpness, row[7]) / row[7]
        row[10] = kt
        x = resistance * m.step / inductance if inductance > 0.0 else math.inf
        phi = -math.expm1(-x) / x
        torque, slope = kt * (row[7] * phi + row[6] / resistance * (1.0 - phi)), kt * kt / resistance * (1.0 - phi)
        st.force[i, 0] += torque
        st.force[i, 1] += slope
        st.force[i, 7] += (torque - slope * m.scale[i] * st.omega[m.group[i], 2]) * m.applied[i, 3]


@njit
def settle_motors(m, st):
    """Finish the currents of the voltage-driven motors with the speeds of the step."""
    for j in range(m.motors):
        if m.motor[j, 1] != VOLTAGE or (m.motor[j, 4] >= 0 and st.signal_now[m.motor[j, 4], 0] < 0.5):
            continue
        i = m.motor[j, 0]
        g, s = m.group[i], m.scale[i]
        resistance, inductance = m.winding[j, 1], m.winding[j, 2]
        row = st.motor[j]
        kt = row[10]
        if inductance > 0.0:
            row[0] = row[7]
            mean = s * (st.theta[g, 0] - st.theta[g, 1]) / m.step
            row[7] += ((row[6] - kt * mean) / resistance - row[7]) * -math.expm1(-resistance * m.step / inductance)
            row[1] = row[7]
        else:
            row[0] = (row[4] - kt * s * st.omega[g, 1]) / resistance
            row[1] = (row[5] - kt * s * st.omega[g, 0]) / resistance
            row[7] = row[1]
        row[2], row[3] = kt * row[0], kt * row[1]


@njit
def load_shafts(m, st, noise):
    """Set the torques on every shaft at mid step."""
    h = m.step
    for i in range(m.shafts):
        g = m.group[i]
        scale_friction(m, st, i)
        torque = m.applied[i, 2] + outside_torque(m, st, i)
        if m.applied[i, 0] != 0.0:
            torque -= m.applied[i, 0] * math.sin(m.scale[i] * st.theta[g, 2] + m.applied[i, 1])
        if m.external[i] >= 0:
            torque += 0.5 * (st.signal_now[m.external[i], 0] + st.signal_now[m.external[i], 1])
        if m.noise_std[i] > 0.0:
            torque += m.noise_std[i] * noise[i]
            st.alpha[g, 2] += m.scale[i] * m.noise_std[i] * noise[i] / m.group_inertia[g]
        st.force[i, 0], st.force[i, 1], st.force[i, 2], st.force[i, 7] = torque, 0.0, 0.0, 0.0
    for e in range(m.joints):
        i, j = m.joint[e, 0], m.joint[e, 1]
        ratio = m.elastic[e, 0]
        si, sj, gi, gj = m.scale[i] / ratio, m.scale[j], m.group[i], m.group[j]
        error, over_in, over_out = kinematic(m, e, m.scale[i] * st.theta[gi, 2], sj * st.theta[gj, 2])
        over_in += 1.0 / ratio
        rate = over_in * m.scale[i] * st.omega[gi, 2] - (1.0 - over_out) * sj * st.omega[gj, 2]
        middle = si * st.theta[gi, 2] + error - sj * st.theta[gj, 2]
        torque = contact(m.elastic[e], middle - 0.5 * h * rate, rate, h)
        torque += spring_torque(m, st, e, middle, 0.5 * h * rate)
        st.joint_torque[e] = torque
        st.force[j, 0] += torque * (1.0 - over_out)
        st.force[i, 2] += torque * over_in


@njit
def prepare(m, st):
    """Predict angles and speeds at mid step; a prescribed speed also gets its end value."""
    h = m.step
    for g in range(m.groups):
        st.theta[g, 1] = st.theta[g, 0]
        st.omega[g, 1] = st.omega[g, 0]
        a = st.alpha[g, 0]
        st.alpha[g, 1] = a
        if m.traits[g, 2] >= 0:
            s = m.scale[m.shaft[m.first[g]]]
            st.omega[g, 1] = st.signal_now[m.traits[g, 2], 0] / s
            st.omega[g, 0] = st.signal_now[m.traits[g, 2], 1] / s
            a = (st.omega[g, 0] - st.omega[g, 1]) / h
        st.alpha[g, 2] = 0.0
        st.omega[g, 2] = st.omega[g, 1] + 0.5 * h * a
        st.theta[g, 2] = st.theta[g, 1] + 0.5 * h * st.omega[g, 1]


@njit
def advance(m, st):
    """Move every group, then its bristles."""
    h = m.step
    for g in range(m.groups):
        if m.traits[g, 2] >= 0:
            a = (st.omega[g, 0] - st.omega[g, 1]) / h
            demand(m, st, g, a, st.omega[g, 1], st.omega[g, 2], 1.0 if st.omega[g, 2] >= 0.0 else -1.0, h)
            travel = h * st.omega[g, 2]
        else:
            a, st.omega[g, 0], travel = move(m, st, g)
        st.theta[g, 0] = st.theta[g, 1] + travel
        st.alpha[g, 0] = a - st.alpha[g, 2] if a != 0.0 else 0.0
        for k in range(m.first[g], m.first[g + 1]):
            i = m.shaft[k]
            mean = m.scale[i] * travel / h
            heat_up(m, st, i, mean)
            if m.law[i] == BRISTLE:
                x = st.memory[i] * h
                phi = 1.0 - 0.5 * x if x < 1e-4 else -math.expm1(-x) / x
                st.bristle[i, 0] += (mean - st.memory[i] * st.bristle[i, 0]) * h * phi
            elif m.law[i] == LOOP:
                forward = st.memory[i] / m.friction[i, 0, SIGMA0]
                backward = st.opposite[i] / m.friction[i, 1, SIGMA0]
                st.bristle[i, 0] = min(max(st.bristle[i, 0] + mean * h, -backward), forward)
            elif m.law[i] == GMS:
                q, other = m.friction[i, 0], m.friction[i, 1]
                for j in range(int(q[PIECES])):
                    force = st.bristle[i, j] + (q if mean >= 0.0 else other)[SLOPES + j] * mean * h
                    st.bristle[i, j] = min(
                        max(force, -other[BREAKS + j] * st.opposite[i]), q[BREAKS + j] * st.memory[i]
                    )


@njit
def keep_truth(m, st, row):
    """Store per shaft theta, omega, alpha, friction torque, deflection; per joint the torque; per motor the current."""
    shafts = m.shafts
    for g in range(m.groups):
        mean = (st.theta[g, 0] - st.theta[g, 1]) / m.step
        drive, held = 0.0, 0.0
        for k in range(m.first[g], m.first[g + 1]):
            i = m.shaft[k]
            drive += m.scale[i] * (st.force[i, 0] - st.force[i, 2])
            held += m.scale[i] * st.force[i, 3]
        stuck = m.traits[g, 0] == 1 and st.omega[g, 0] == 0.0 and st.omega[g, 1] == 0.0
        for k in range(m.first[g], m.first[g + 1]):
            i = m.shaft[k]
            s = m.scale[i]
            row[i], row[shafts + i], row[2 * shafts + i] = s * st.theta[g, 0], s * st.omega[g, 0], s * st.alpha[g, 0]
            friction = st.force[i, 3] + st.force[i, 4] * s * mean
            row[3 * shafts + i] = st.force[i, 3] * drive / held if stuck and held != 0.0 else friction
            row[4 * shafts + i] = st.bristle[i, 0]
    at = 5 * shafts
    for e in range(m.joints):
        row[at + e] = st.joint_torque[e]
    for j in range(m.motors):
        row[at + m.joints + j] = st.motor[j, 1]


def _run(model, state, signals, references, samples, recorded, truth, noise, begin, end):
    """Take the steps begin..end - 1.

    signals = (time, value), references = (theta and omega, issued commands), samples = (step, fraction, ready);
    recorded holds the sensor noise on entry; noise is (end - begin, s) standard normal where a shaft has noise.
    """
    m, st = model[0], state[0]
    time, value = signals
    reference, issued = references
    step, fraction, ready = samples
    if begin == 0:
        sense(m, st, step, fraction, recorded, -1)
    for n in range(begin, end):
        read_signals(m, st, time, value, n)
        control(m, st, reference, issued, ready, recorded, n)
        st.clock[0] = (n + 0.5) * m.step
        prepare(m, st)
        load_shafts(m, st, noise[min(n - begin, noise.shape[0] - 1)])
        drive_motors(m, st, n)
        advance(m, st)
        settle_motors(m, st)
        settle_loops(m, st)
        sense(m, st, step, fraction, recorded, n)
        if m.truth_every > 0 and (n + 1) % m.truth_every == 0 and (n + 1) // m.truth_every < truth.shape[0]:
            keep_truth(m, st, truth[(n + 1) // m.truth_every])


def _compile():
    """Compile with a cache keyed by the text of all kernel files: numba itself looks only at the caller's file."""
    here = Path(__file__).parent
    texts = [
        (here / f"{name}.py").read_bytes() for name in ("layout", "flaw_kernels", "mechanics", "signals", "stepping")
    ]
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(here / "__pycache__" / f"numba-{hashlib.sha256(b''.join(texts)).hexdigest()[:12]}")
    try:
        return njit(cache=True)(_run)
    finally:
        numba.config.CACHE_DIR = before


run = _compile()
