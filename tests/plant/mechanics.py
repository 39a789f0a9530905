"""Compiled: friction, backlash and the motion of one group of rigidly joined shafts over a step."""

from __future__ import annotations

import math

from numba import njit

from .layout import (
    BREAKS,
    BRISTLE,
    DELTA,
    GMS,
    LOAD_C,
    LOAD_S,
    LOAD_V,
    LOOP,
    OMEGA_S,
    PIECES,
    QUADRATIC,
    SIGMA0,
    SIGMA1,
    SLOPES,
    TAU_C,
    TAU_S,
    VISCOUS,
)


@njit
def level(q, speed, load):
    """Return Coulomb plus Stribeck level at `speed` >= 0."""
    value = q[TAU_C] + q[LOAD_C] * load
    if q[OMEGA_S] > 0.0:
        x = speed / q[OMEGA_S]
        power = x * x if q[DELTA] == 2.0 else x if q[DELTA] == 1.0 else x ** q[DELTA]
        value += (q[TAU_S] - q[TAU_C] + q[LOAD_S] * load) * math.exp(-power)
    return value


@njit
def bristle_line(m, st, i, omega, d, top, slope, h):
    """Return A, B of LuGre or Dahl: the bristle over a step of constant speed, its rate frozen at `omega`."""
    z = st.bristle[i, 0]
    lead = z if z != 0.0 else omega if omega != 0.0 else d
    side = m.friction[i, 0 if lead > 0.0 else 1]
    rate = side[SIGMA0] * abs(omega) / top
    st.memory[i] = rate
    x = rate * h
    if x < 1e-4:
        phi, psi = 1.0 - 0.5 * x, 0.5 - x / 6.0
    else:
        phi = -math.expm1(-x) / x
        psi = (1.0 - phi) / x
    a = (side[SIGMA0] - side[SIGMA1] * rate) * phi * z
    return a, side[SIGMA0] * h * psi + side[SIGMA1] * phi + slope


@njit
def polyline(q, speed):
    """Return the torque of the segments at `speed` >= 0 and their slope there."""
    value, start = 0.0, 0.0
    for j in range(int(q[PIECES])):
        end = q[BREAKS + j]
        value += q[SLOPES + j] * (min(speed, end) - start)
        if speed < end:
            return value, q[SLOPES + j]
        start = end
    return value, 0.0


@njit
def loop_line(m, st, i, omega, top, slope, h):
    """Return A, B of a spring that slips at `top`, beside the segments of a polyline."""
    q = m.friction[i, 0 if omega >= 0.0 else 1]
    value, piece = polyline(q, abs(omega))
    value *= st.factor[i, 1]
    piece *= st.factor[i, 1]
    z = st.bristle[i, 0]
    stiffness = m.friction[i, 0 if z > 0.0 or (z == 0.0 and omega >= 0.0) else 1, SIGMA0]
    a = (value if omega >= 0.0 else -value) - piece * omega
    if abs(z + 0.5 * h * omega) * q[SIGMA0] < top or z * omega < 0.0:
        return a + stiffness * z, slope + piece + 0.5 * h * stiffness
    return a + (top if omega >= 0.0 else -top), slope + piece


@njit
def friction_line(m, st, i, omega, d, load, h):
    """Return A, B of the mean friction torque A + B omega_mid of a step; d is the direction at standstill."""
    q = m.friction[i, 0 if (omega > 0.0 or (omega == 0.0 and d > 0.0)) else 1]
    speed = abs(omega)
    dry, wet = st.factor[i, 0], st.factor[i, 1]
    slope = wet * (q[VISCOUS] + q[LOAD_V] * load)
    top = dry * level(q, speed, load) + st.factor[i, 2]
    if m.law[i] == BRISTLE:
        return bristle_line(m, st, i, omega, d, top, slope, h)
    if m.law[i] == LOOP or m.law[i] == GMS:
        st.memory[i] = dry * level(m.friction[i, 0], speed, load) + st.factor[i, 2]
        st.opposite[i] = dry * level(m.friction[i, 1], speed, load) + st.factor[i, 2]
    if m.law[i] == LOOP:
        return loop_line(m, st, i, omega, top, slope, h)
    if m.law[i] == GMS:
        a = 0.0
        for j in range(int(q[PIECES])):
            force = st.bristle[i, j] + 0.5 * h * q[SLOPES + j] * omega
            limit = q[BREAKS + j] * top
            if abs(force) < limit or force * omega < 0.0:
                a += st.bristle[i, j]
                slope += 0.5 * h * q[SLOPES + j]
            else:
                a += limit if force > 0.0 else -limit
        return a, slope
    value = top + slope * speed + wet * q[QUADRATIC] * speed * speed
    slope += 2.0 * wet * q[QUADRATIC] * speed
    pieces, piece = polyline(q, speed)
    value += wet * pieces
    slope += wet * piece
    return d * value - slope * omega, slope


@njit
def demand(m, st, g, a, omega, middle, d, h):
    """Return the torque that group g lacks for the acceleration a; sets the torque T of every shaft in it."""
    for k in range(m.first[g], m.first[g + 1]):
        i = m.shaft[k]
        st.force[i, 5] = st.force[i, 2]
        st.force[i, 6] = st.force[i, 2]
    for k in range(m.first[g + 1] - 1, m.first[g] - 1, -1):
        i = m.shaft[k]
        s = m.scale[i]
        mean = s * (omega + 0.5 * h * a)
        fa, fb = friction_line(m, st, i, s * middle, d if s > 0.0 else -d, abs(st.force[i, 5]), h)
        st.force[i, 3] = fa
        st.force[i, 4] = fb
        total = m.inertia[i] * s * a + fa + (fb + st.force[i, 1]) * mean - st.force[i, 0] + st.force[i, 6]
        up = m.parent[i]
        if up < 0:
            return total * s
        st.force[up, 6] += total * s / m.scale[up]
        if m.forward[i] == 1:
            st.force[up, 5] += total * s / m.scale[up]
    return 0.0


@njit
def acceleration(m, st, g, omega, middle, d, h):
    """Return the mean acceleration of group g over h, moving in direction d."""
    if m.traits[g, 1] == 0:
        drive, slope = 0.0, 0.0
        for k in range(m.first[g], m.first[g + 1]):
            i = m.shaft[k]
            s = m.scale[i]
            load = abs(st.force[i, 2]) + abs(st.force[i, 7])
            fa, fb = friction_line(m, st, i, s * middle, d if s > 0.0 else -d, load, h)
            st.force[i, 3] = fa
            st.force[i, 4] = fb
            drive += s * (st.force[i, 0] - st.force[i, 2] - fa)
            slope += s * s * (fb + st.force[i, 1])
        return (drive - slope * omega) / (m.group_inertia[g] + 0.5 * h * slope)
    size = 0.0
    for k in range(m.first[g], m.first[g + 1]):
        i = m.shaft[k]
        size += abs(m.scale[i]) * (abs(st.force[i, 0]) + abs(st.force[i, 2]))
    a0 = st.alpha[g, 1]
    r0 = demand(m, st, g, a0, omega, middle, d, h)
    a1 = a0 - r0 / m.group_inertia[g]
    for _ in range(50):
        r1 = demand(m, st, g, a1, omega, middle, d, h)
        if a1 == a0 or r1 == r0 or abs(r1) <= 1e-14 * (size + m.group_inertia[g] * abs(a1)):
            break
        a0, r0, a1 = a1, r1, a1 - r1 * (a1 - a0) / (r1 - r0)
    return a1


@njit
def move(m, st, g):
    """Advance group g by a step: slide, stop and stick, reverse, or break away."""
    h = m.step
    omega = st.omega[g, 1]
    middle = st.omega[g, 2]
    if m.traits[g, 0] == 0:
        a = acceleration(m, st, g, omega, middle, 1.0 if middle >= 0.0 else -1.0, h)
        return a, omega + h * a, h * (omega + 0.5 * h * a)
    travel, rest, d = 0.0, h, 1.0
    if omega != 0.0:
        d = 1.0 if omega > 0.0 else -1.0
        a = acceleration(m, st, g, omega, middle if d * middle > 0.0 else 0.0, d, h)
        if d * (omega + h * a) >= 0.0:
            return a, omega + h * a, h * (omega + 0.5 * h * a)
        travel = -0.5 * omega * omega / a
        rest = h + omega / a
        d = -d
    a = acceleration(m, st, g, 0.0, 0.0, d, rest)
    if d * a <= 0.0 and omega == 0.0:
        d = -d
        a = acceleration(m, st, g, 0.0, 0.0, d, rest)
    if d * a > 0.0:
        return a, a * rest, travel + 0.5 * a * rest * rest
    return 0.0, 0.0, travel


@njit
def contact(elastic, twist, rate, h):
    """Return the mean torque over a step that begins at `twist`: exact for a constant twist rate, never adhesive."""
    k, c, half = elastic[1], elastic[2], elastic[3]
    if half == 0.0:
        return k * (twist + 0.5 * h * rate) + c * rate
    side = 1.0 if twist + 0.5 * h * rate > 0.0 else -1.0
    begin = side * twist - half
    end = begin + side * rate * h
    low = max(0.0, -c * side * rate / k)
    if begin > low and end > low:
        return side * (0.5 * k * (begin + end) + c * side * rate)
    if begin <= low and end <= low:
        return 0.0
    near = max(min(begin, end), low)
    far = max(begin, end)
    return side * (far - near) * (0.5 * k * (far + near) + c * side * rate) / abs(end - begin)
