"""Gao's manipulator of 2017 by hand for numba: the speed that the library is compared with.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/compiled_chain.py

Newton's method takes all sections at once: what lies between two bodies that the tendon visits, two
flexures, of which the last section's second one is only a filler. No load is cut into parts, there
is no search along a line, and no slot closes. `compiled_wrist.py` does the same for wrist A.
"""

import numpy as np
from compiled_sections import BOTH, MODES, fill_shape, gao_arrays, walk_spans
from compiled_wrist import MOST, SMALL, compiled, median_us, prange, print_table, spread

RATE = 8.0  # how strongly slip drives a log ratio in the search, per slip in heights of the notch
SIDEWAYS = 0.4905  # N, 50 g at the tip, against the bend


@compiled
def _balance(c, turned, forces, spans, slopes, felt, pairs, matrix):
    """Fill in what the modes of a section do to its balance, of a symmetric matrix the upper half.

    That is its rods' stiffness and what the forces do, by rod; then the turning of the span.
    """
    s, k = c.tendon.shape[1], len(turned) // 4
    factor, row = np.empty(s), 0
    for n in range(k):
        for j in range(2 * s):
            felt[n, j] = turned[n, j] * forces[0, j] - turned[k + n, j] * forces[1, j]
            felt[k + n, j] = turned[k + n, j] * forces[0, j] + turned[n, j] * forces[1, j]
            along = turned[2 * k + n, j] * forces[0, j] + turned[3 * k + n, j] * forces[1, j]
            felt[2 * k + n, j] = along
    felt[-1] += forces[2]
    np.dot(c.second, felt, pairs)
    for m in range(MODES):
        for n in range(m, MODES):
            for i in range(s):
                matrix[m, n, i] = pairs[row, i] + c.stiffness[row]
                matrix[MODES + m, MODES + n, i] = pairs[row, s + i] + c.stiffness[row]
            row += 1
        for n in range(MODES, BOTH):
            for i in range(s):
                across = slopes[1, n, i] * (spans[5, i] - spans[3, i])
                matrix[m, n, i] = c.strain[k - 1, m] * (across - spans[6, i] * slopes[0, n, i])
    for m in range(BOTH):
        for i in range(s):
            factor[i] = spans[3, i] / spans[2, i] * slopes[1, m, i]
        for n in range(m, BOTH):
            for i in range(s):
                matrix[m, n, i] += factor[i] * slopes[1, n, i]


@compiled
def _eliminate(slopes, matrix):
    """Solve every section's balance for its modes (in its right sides); what spans owe to them."""
    s, owed = matrix.shape[2], np.zeros((3, 4, matrix.shape[2]))
    factor = np.empty(s)
    for m in range(BOTH):
        for i in range(s):
            matrix[m, m, i] = 1.0 / matrix[m, m, i]
        for n in range(m + 1, BOTH):
            for i in range(s):
                factor[i] = matrix[m, n, i] * matrix[m, m, i]
            for o in range(n, BOTH + 4):
                for i in range(s):
                    matrix[n, o, i] -= factor[i] * matrix[m, o, i]
    for m in range(BOTH - 1, -1, -1):
        for o in range(BOTH, BOTH + 4):
            for n in range(m + 1, BOTH):
                for i in range(s):
                    matrix[m, o, i] -= matrix[m, n, i] * matrix[n, o, i]
            for i in range(s):
                matrix[m, o, i] *= matrix[m, m, i]
            for r in range(3):
                for i in range(s):
                    owed[r, o - BOTH, i] += slopes[r, m, i] * matrix[m, o, i]
    return owed


@compiled
def _tie(carried, target, tied):
    """Where a contact sticks its slip gives the free number so far, which leaves the columns."""
    tied[0] = (target - carried[3, 0]) / carried[3, 1]
    tied[1] = -carried[3, 2] / carried[3, 1]
    for r in range(4):
        carried[r, 0] += carried[r, 1] * tied[0]
        carried[r, 2] += carried[r, 1] * tied[1]
        carried[r, 1] = 0.0


@compiled
def _touch(c, contacts, before, edge, i, carried, tied, steps):
    """Let a contact slide toward the base (1) or the tip (-1) or stick (0), by its slip."""
    ratio, slid, bound = contacts[:, edge, i]
    goal = ratio + RATE * (slid - before[1, edge, i]) / c.numbers[2]
    sign = 1.0 if goal >= bound - SMALL else (-1.0 if goal <= SMALL - bound else 0.0)
    if sign == 0.0:
        _tie(carried, before[1, edge, i] - slid, tied)
    steps[3 + edge, i, 0] = 0.0 if sign == 0.0 else sign * bound - ratio
    steps[3 + edge, i, 1], steps[3 + edge, i, 2] = 1.0 - abs(sign), 0.0
    steps[5 + edge, i] = carried[3]
    return sign


@compiled
def _sweep(c, state, before, rest, spans, matrix, owed):
    """Take the linear step along the chain, base to tip; returns its largest change.

    All is affine in two free numbers: the log ratio of the last contact that sticks (before it
    the slip at the base), and the moment of the load at the base. `carried` are ln of the
    tension, heading, moment of the load, slid length; `steps` gap tension, moment, heading, log
    ratios and slid lengths.
    """
    (modes, contacts, at_base), s, number = state, c.tendon.shape[1], 0
    carried, moved, steps = np.zeros((4, 3)), np.empty(3), np.zeros((7, s, 3))
    tied, part = np.empty((2 * s + 1, 2)), np.empty((2, s), np.int64)
    carried[3, 1] = carried[2, 2] = 1.0
    for i in range(s):
        k0, k1, length, T, body, normal, across, onward = spans[:, i]
        R = owed[:, :, i]
        sign = _touch(c, contacts, before, 0, i, carried, tied[number], steps)
        number += 1 if sign == 0.0 else 0
        part[0, i] = number
        hold = T * sign * k0
        m11, m12 = 1.0 + hold * R[1, 1], hold * R[1, 2]
        m21, m22 = across * R[0, 1] - normal * R[1, 1], 1.0 + across * R[0, 2] - normal * R[1, 2]
        for o in range(3):
            heading, one = carried[1, o], 1.0 if o == 0 else 0.0
            longer, aside = R[0, 0] * one + R[0, 3] * heading, R[1, 0] * one + R[1, 3] * heading
            r1 = T * (carried[0, o] - steps[3, i, o]) - hold * aside
            r2 = carried[2, o] + length * normal * heading + normal * aside - across * longer
            tension = (r1 * m22 - m12 * r2) / (m11 * m22 - m12 * m21)
            moment = (m11 * r2 - m21 * r1) / (m11 * m22 - m12 * m21)
            steps[0, i, o], steps[1, i, o], steps[2, i, o] = tension, moment, heading
            longer += R[0, 1] * tension + R[0, 2] * moment
            aside += R[1, 1] * tension + R[1, 2] * moment
            turn = R[2, 0] * one + R[2, 1] * tension + R[2, 2] * moment + R[2, 3] * heading
            steps[3, i, o] += sign * k0 * aside
            carried[0, o] -= steps[3, i, o]
            carried[1, o] += turn
            carried[2, o] = moment + onward * carried[1, o]
            carried[3, o] += longer - T * c.tendon[0, i] / c.numbers[1] * carried[0, o]
            moved[o] = k1 * (length * turn - aside)
        sign = _touch(c, contacts, before, 1, i, carried, tied[number], steps)
        number += 1 if sign == 0.0 else 0
        part[1, i] = number
        for o in range(3):
            steps[4, i, o] += sign * moved[o]
            carried[0, o] -= steps[4, i, o]
            carried[3, o] -= body * c.tendon[1, i] / c.numbers[1] * carried[0, o]
    _tie(carried, 0.0, tied[number])
    moment = -(rest + carried[2, 0]) / carried[2, 2]
    at_base[0] += moment
    largest = 0.0
    for i in range(s):
        for row in range(7):
            own = tied[part[1 if row == 4 else 0, i]]
            steps[row, i, 0] += steps[row, i, 1] * (own[0] + own[1] * moment)
            steps[row, i, 0] += steps[row, i, 2] * moment
        for m in range(BOTH):
            step = matrix[m, BOTH, i]
            for o in range(3):
                step += matrix[m, BOTH + 1 + o, i] * steps[o, i, 0]
            modes[m % MODES, i + (m // MODES) * s] += step
            largest = max(largest, abs(step))
        for edge in range(2):
            contacts[0, edge, i] += steps[3 + edge, i, 0]
            contacts[1, edge, i] += steps[5 + edge, i, 0]
            largest = max(largest, abs(steps[3 + edge, i, 0]))
    return largest


@compiled
def _follow(c, tension, last, load, state, room):
    """Follow one load from a state by Newton's method; returns the iterations.

    The first guess of the log ratios is that of the play operator: a tension stays unless the one
    before it leaves the band that the contact can bear.
    """
    contacts, before = state[1], state[1].copy()
    old, new = np.log(max(last, 1e-100)), np.log(max(tension, 1e-100))
    for i in range(contacts.shape[2]):
        for edge in range(2):
            old -= before[0, edge, i]
            limit = before[2, edge, i]
            contacts[0, edge, i] = min(max(new - old, -limit), limit)
            new -= contacts[0, edge, i]
    strain, turned, total, felt, pairs, matrix = room
    for iteration in range(1, MOST + 1):
        fill_shape(c, state[0], strain, turned, total)
        moved = walk_spans(c, tension, load, state, strain, turned, total, matrix)
        rest, forces, spans, slopes = moved
        _balance(c, turned, forces, spans, slopes, felt, pairs, matrix)
        if _sweep(c, state, before, rest, spans, matrix, _eliminate(slopes, matrix)) < SMALL:
            return iteration
    return MOST + 1


@compiled
def gao_path(c, tensions, load):
    """Follow tensions (N) with memory; returns modes (steps, 5, 2 s) and iterations (steps,)."""
    modes, counts = np.empty((len(tensions), MODES, len(c.hand))), np.empty(len(tensions))
    # Modes; log ratio, slid length and bound of contacts; the load's moment.
    state = np.zeros(modes.shape[1:]), np.zeros((3, 2, c.tendon.shape[1])), np.zeros(1)
    both, k, last = len(c.hand), c.total.shape[1] // 4, 0.0
    # Strains, turned strains, totals; what is felt, pairs of modes and balance. To allocate these
    # in every iteration would cost half a solve.
    strain, turned, total = (3 * k + MODES, both), (4 * k, both), (BOTH + 2, both)
    room = (
        np.empty(strain),
        np.empty(turned),
        np.empty(total),
        np.empty((3 * k, both)),
        np.empty((len(c.second), both)),
        np.empty((BOTH, BOTH + 4, both // 2)),
    )
    for step in range(len(tensions)):
        counts[step] = _follow(c, tensions[step], last, load, state, room)
        modes[step], last = state[0], tensions[step]
    return modes, counts


@compiled
def gao_solve(c, tension, load):
    """Solve from rest, the load before the tension; returns modes (5, 2 s) and iterations."""
    steps = np.array([0.0, tension])
    modes, counts = gao_path(c, steps[1:] if load == 0.0 else steps, load)
    return modes[-1], counts.sum()


@spread
def gao_batch(c, tensions, load):
    """Solve each tension (N) from rest; returns modes (loads, 5, 2 s)."""
    modes = np.empty((len(tensions), MODES, len(c.hand)))
    for j in prange(len(tensions)):
        modes[j] = gao_solve(c, tensions[j], load)[0]
    return modes


def gao_times() -> dict[str, float]:
    """Times of Gao's robot, us, free and with 50 g: one solve at 6 N, path to 13 N, batch."""
    from notchflex import load_robot

    c, up = gao_arrays(load_robot("gao2017")), np.linspace(0.0, 13.0, 400)
    there, times = np.r_[0.0:14.0, 13.0:-1.0:-1.0], {}
    for name, load in (("free", 0j), ("50 g", -SIDEWAYS * 1j)):
        of = f"Gao, {name}, "
        times[of + "one solve"] = median_us(lambda load=load: gao_solve(c, 6.0, load), 301)
        path = median_us(lambda load=load: gao_path(c, there, load))
        times[of + "path, per step"] = path / len(there)
        batch = median_us(lambda load=load: gao_batch(c, up, load), 7)
        times[of + "batch, per solve"] = batch / len(up)
    return times


if __name__ == "__main__":
    print_table(gao_times())
