"""The sections of Gao's manipulator for `compiled_chain.py`: their numbers, shapes and spans.

A section lies between two bodies that the tendon visits: two flexures, of which the last section's
second one is only a filler. Vectors of the plane are complex numbers z + i x: exp(i a) turns them
by a, and a force f at r has the moment Im(conj(r) f).
"""

from typing import Any, NamedTuple

import numpy as np
from compiled_wrist import compiled

MODES = 5  # of a flexure: three of moments, two of forces
BOTH = 2 * MODES  # of a section


class Gao(NamedTuple):
    """Equal flexures, every second one mirrored; k nodes with the end as one, s sections; mm, N.

    Columns are the first flexures of all sections, then the second ones.
    """

    # By modes: turn of every node, step along x and z there, force of every mode, (3 k + 5, 5).
    strain: np.ndarray
    # From cosine, sine of every node and its turned step (x, z) to the slopes of the end's x and z
    # by the modes and to the end's x and z, (12, 4 k).
    total: np.ndarray
    # Minus the second derivatives by pairs of modes, from the force turned back at every node
    # (x, z) and the force times the turned step, (15, 3 k).
    second: np.ndarray
    stiffness: np.ndarray  # of pairs of modes, (15,)
    rigid: np.ndarray  # beyond the rod's end (x, z), (2,)
    hand: np.ndarray  # 1, for the mirrored -1, for the filler 0, (2 s,)
    start: np.ndarray  # of the rod in the proximal body, (2 s,)
    # Where the tendon enters the distal and leaves the proximal body, and the way from its entry to
    # where it leaves, or to the load, (3, s).
    way: np.ndarray
    tendon: np.ndarray  # its length across the free gap and in the distal body, (2, s)
    numbers: np.ndarray  # friction coefficient, axial stiffness of the memory, height of a notch


def gao_arrays(robot: Any) -> Gao:
    """Read the numbers of the robot off the library's chain."""
    from notchflex.mechanics.chain import assemble

    chain = assemble(robot, "tendons")
    rods, tendon, own = chain.rods, chain.groups[0], chain.elastic[0]
    step, from_rod = rods.step[0][:, :, 1:], rods.start_rotation[0]
    used = np.append(np.any(step, axis=(1, 2)), True)  # others stand for no length; the end
    turn = rods.turn[0, used, 0, 1:]
    x, z = np.moveaxis(from_rod @ np.append(step, np.zeros((1, 2, MODES)), axis=0)[used], 1, 0)
    none, ones = 0.0 * turn, np.kron(np.eye(4)[2:], np.ones(len(turn)))
    m, n = np.triu_indices(MODES)
    pairs = [turn[:, m] * f[:, n] + turn[:, n] * f[:, m] for f in (-z, x, 0.5 * turn)]
    rigid = from_rod @ (rods.curve_offset[0] + rods.curve_rotation[0] @ rods.end_offset[0])
    visits = np.flatnonzero(tendon.visits[:, 0])
    enters, leaves = tendon.enters[visits, 0], tendon.leaves[visits, 0]
    onward = np.vstack([leaves[1:], [0.0, chain.body_length[-1]]]) - enters
    starts = rods.start_offset[np.r_[0, visits[:-1] + 1, visits]]
    start, *way = (point @ (1j, 1.0) for point in (starts, enters, leaves, onward))
    hand = np.repeat([1.0, -1.0], len(visits))
    hand[-1], start[-1] = 0.0, -rigid[1]
    slopes = [[x, z, none, turn], [z, -x, -turn, none]]
    total = [np.hstack([part.T for part in row]) for row in slopes]
    return Gao(
        np.vstack([turn, x, z, own]),
        np.vstack([*total, ones]),
        np.hstack([pair.T for pair in pairs]),
        own[m, n],
        *(rigid, hand, start, np.stack(way)),
        np.stack([tendon.natural_gap[visits, 0], tendon.body_length[visits, 0]]),
        np.array([robot.friction.coefficient, chain.memory_stiffness[0], rods.length[0].sum()]),
    )


@compiled
def fill_shape(c, modes, strain, turned, total):
    """Strains and turned strains at the nodes; slopes and places of the flexures' ends."""
    k = len(turned) // 4
    size = k * modes.shape[1]
    np.dot(c.strain, modes, strain)
    strain[2 * k - 1], strain[3 * k - 1] = c.rigid[0], c.rigid[1]
    u, v = strain.ravel(), turned.ravel()
    for j in range(size):  # cosine by Taylor's series: angles are small (1e-16 up to half a radian)
        y = u[j] * u[j]
        even = 1.0 - y * (1.0 / 132.0) * (1.0 - y * (1.0 / 182.0))
        even = 1.0 - y * (1.0 / 56.0) * (1.0 - y * (1.0 / 90.0) * even)
        v[j] = 1.0 - y * 0.5 * (1.0 - y * (1.0 / 12.0) * (1.0 - y * (1.0 / 30.0) * even))
    for j in range(size):
        y = u[j] * u[j]
        odd = 1.0 - y * (1.0 / 110.0) * (1.0 - y * (1.0 / 156.0))
        odd = 1.0 - y * (1.0 / 42.0) * (1.0 - y * (1.0 / 72.0) * odd)
        v[size + j] = u[j] * (1.0 - y * (1.0 / 6.0) * (1.0 - y * (1.0 / 20.0) * odd))
    for j in range(size):
        v[2 * size + j] = v[j] * u[size + j] + v[size + j] * u[2 * size + j]
        v[3 * size + j] = v[j] * u[2 * size + j] - v[size + j] * u[size + j]
    np.dot(c.total, turned, total)


@compiled
def walk_spans(c, tension, load, state, strain, turned, total, matrix):
    """Spans, tensions and loads from base to tip, and what the modes do to them.

    Returns the last moment, `forces` (x, z at the flexures' ends, times the way from there to the
    tendon's entry), `spans` (see the end), and `slopes` of the span's length, its way across and
    the rotation by the modes (3, 10, s). Fills the balance's right sides, its last four columns.
    """
    s, k, moment = c.tendon.shape[1], len(turned) // 4, state[2][0]
    forces, spans, slopes = np.empty((3, 2 * s)), np.empty((s, 8)), np.empty((3, BOTH, s))
    ratio, slid, bound = state[1]
    for i in range(s):
        j = s + i
        spin = turned[k - 1, i] + 1j * turned[2 * k - 1, i]
        other = turned[k - 1, j] + 1j * c.hand[j] * turned[2 * k - 1, j]
        enters = other * c.way[0, i]
        arm = spin * (c.start[j] + total[11, j] + 1j * c.hand[j] * total[10, j] + enters)
        span = c.start[i] + total[11, i] + 1j * total[10, i] + arm - c.way[1, i]
        length = abs(span)
        unit = np.conj(span) / length
        gap = tension * np.exp(-ratio[0, i])
        tension = gap * np.exp(-ratio[1, i])
        local, force = load * unit, load - gap * np.conj(unit)
        moment -= length * local.imag
        back = force * np.conj(spin) * c.hand[j] ** 2
        forces[0, i], forces[1, i] = force.imag, force.real
        forces[2, i], forces[2, j] = (force * np.conj(arm)).real, (back * np.conj(enters)).real
        forces[0, j], forces[1, j] = c.hand[j] * back.imag, back.real
        for m in range(BOTH):
            n, column, lever = (m, i, arm) if m < MODES else (m - MODES, j, enters)
            hand = c.hand[column]
            turn = hand * c.strain[k - 1, n]
            slope = hand * (hand * total[MODES + n, column] + 1j * total[n, column])
            slope = (slope + 1j * turn * lever) * unit * (1.0 if m < MODES else spin)
            slopes[0, m, i], slopes[1, m, i], slopes[2, m, i] = slope.real, slope.imag, turn
            own = moment * turn + (local.real - gap) * slope.real + local.imag * slope.imag
            matrix[m, BOTH, i] = own - strain[3 * k + n, column]
            matrix[m, BOTH + 1, i], matrix[m, BOTH + 2, i] = -slope.real, turn
            matrix[m, BOTH + 3, i] = local.imag * slope.real - local.real * slope.imag
        # Tangents of half the turning angles, signed, where the tendon leaves and enters.
        both = spin * other
        for edge, bend in enumerate((np.conj(unit), both * unit)):
            t = bend.imag / (1.0 + bend.real)
            held = min(c.numbers[0] * abs(t), 1.0 - 1e-9)
            bound[edge, i] = np.log((1.0 + held) / (1.0 - held))
            spans[i, edge] = np.sign(t) * c.numbers[0] * (1.0 + t * t) / (1.0 - held**2) / length
        load = load * np.conj(both)
        onward = load * np.conj(c.way[2, i])
        moment -= onward.imag
        spans[i, 2], spans[i, 3], spans[i, 4] = length, gap, tension
        spans[i, 5], spans[i, 6], spans[i, 7] = local.real, local.imag, onward.real
    bound[1, -1] = spans[-1, 1] = 0.0  # fixed there
    drawn = 0.0
    for i in range(s - 1, -1, -1):
        drawn += spans[i, 4] * c.tendon[1, i] / c.numbers[1]
        slid[1, i] = drawn
        drawn += c.tendon[0, i] * (1.0 + spans[i, 3] / c.numbers[1]) - spans[i, 2]
        slid[0, i] = drawn
    return moment, forces, spans.T.copy(), slopes
