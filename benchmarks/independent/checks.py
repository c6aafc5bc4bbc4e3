"""What must hold in every converged state, whatever found it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from generator import tension_scale
from outside import base_reaction, has_own_weight, work_between
from sections import arc_section, friction_bound
from shape import channel, free_pose, notches_of, piece_lengths, straight_gap, toward

Table = dict[str, Any]
Finding = tuple[str, int, float, str]  # what, step, by how much, more
NUMBERS = """
    tension stroke notch_angle total_angle tip_position tip_rotation body_position
    body_rotation span_tension notch_moment outer_strain peak_strain gap closed
    contact_force contact_log_ratio contact_slid contact_bound contact_turning
    contact_state dissipation base_force base_moment moment_error stored_energy
    tendon_work smallest_eigenvalue residual iterations
"""
EVERY = NUMBERS.split()
BY_TENDON = {"span_tension", "contact_log_ratio", "contact_slid", "contact_bound"} | {
    "contact_turning",
    "contact_state",
    "dissipation",
}


def above(what: str, step: int, size: float, limit: float, more: str = "") -> Iterator[Finding]:
    """Give a finding where a size is above its limit, or is not a number."""
    if not size <= limit:
        yield what, step, float(size), f"limit {limit:.3g} {more}"


def spans_of(robot: Table, path: Any, t: int) -> int:
    """Return how many spans a tendon has: proximal, then a gap and a body each, without the last.

    Over U-links it runs through the wall pieces of its own side alone, so that there are fewer.
    """
    most = 2 * (robot["tendon"][t].get("end_body") or len(notches_of(robot)))
    if any(notch["kind"] == "u-link" for notch in robot["notch"]):
        return min(most, int(np.isfinite(path.span_tension[0, t]).sum()))
    return most


def all_gaps(robot: Table, path: Any, t: int) -> bool:
    """Whether gap j of a tendon is that of notch j."""
    bodies = robot["tendon"][t].get("end_body") or len(notches_of(robot))
    return spans_of(robot, path, t) == 2 * bodies


def check_numbers(robot: Table, path: Any, step: int) -> Iterator[Finding]:
    """Find what is no number where one is due."""
    for name in EVERY:
        values = np.asarray(getattr(path, name)[step], dtype=float)
        if name in BY_TENDON:
            for t, row in enumerate(values):
                due = spans_of(robot, path, t) - (name != "span_tension")
                if not np.isfinite(row[:due]).all():
                    yield f"nan {name}", step, float("nan"), str(row[:due])
        elif not np.isfinite(values).all():
            yield f"nan {name}", step, float("nan"), str(values)


def check_frames(robot: Table, path: Any, step: int) -> Iterator[Finding]:
    """Find rotations that are none, and a tip that is not where the last body ends."""
    turns = path.body_rotation[step]
    skew = np.abs(np.einsum("bij,bik->bjk", turns, turns) - np.eye(3)).max()
    yield from above("rotation not orthonormal", step, skew, 1e-9)
    yield from above("rotation is a mirror", step, float(-np.linalg.det(turns).min()), 0.0)
    length = piece_lengths(robot)
    tip = path.body_position[step, -1] + turns[-1, :, 2] * length[-1]
    scale = length.sum() + robot["tube"]["outer_diameter"]
    far = np.abs(tip - path.tip_position[step]).max() / scale
    yield from above("tip is not the end of the last body", step, far, 1e-9)
    yield from above("tip turned", step, np.abs(turns[-1] - path.tip_rotation[step]).max(), 1e-9)


def check_lips(robot: Table, path: Any, step: int) -> Iterator[Finding]:
    """Find lips that overlap, pull, or press without touching."""
    gap, force, closed = path.gap[step], path.contact_force[step], path.closed[step]
    size = robot["tube"]["outer_diameter"]
    yield from above("lips overlap", step, float(-gap.min()) / size, 1e-8)
    # without any load contact forces are rounding of what would close a notch
    load = max(np.abs(np.nan_to_num(path.span_tension[step])).max(), 1e-6 * tension_scale(robot))
    load = max(load, np.abs(force).max(), np.abs(path.base_force[step]).max())
    yield from above("lips pull", step, float(-force.min()) / load, 1e-9)
    both = np.minimum(gap / size, force / load).max()
    yield from above("lips press without touching", step, float(both), 1e-8)
    wrong = closed & (gap / size > 1e-7) | ~closed & (force / load > 1e-7)
    yield from above("closed is not what gap and force say", step, float(wrong.sum()), 0.0)


def check_commands(robot: Table, path: Any, load: Table, step: int) -> Iterator[Finding]:
    """Find tensions and strokes other than those commanded."""
    tension, stroke = path.tension[step], path.stroke[step]
    most = max(np.abs(path.tension).max(), 1e-12)
    own = max(most, tension_scale(robot))  # a tension found for a stroke is as exact as that
    yield from above("tension below 0", step, float(-tension.min()) / own, 1e-12)
    reach = piece_lengths(robot).sum() + robot["tube"]["outer_diameter"]
    for t in range(len(tension)):
        pull, drawn = load["tension"][t], load["stroke"][t]
        if pull is not None:
            yield from above("tension not as told", step, abs(tension[t] - pull) / most, 1e-9)
        elif drawn is None:
            yield from above("free tendon not slack", step, abs(tension[t]) / most, 1e-12)
        elif tension[t] > 1e-9 * most:
            yield from above("stroke not as told", step, abs(stroke[t] - drawn) / reach, 1e-8)
        else:
            yield from above("slack tendon too long", step, (drawn - stroke[t]) / reach, 1e-8)


def check_friction(robot: Table, path: Any, step: int) -> Iterator[Finding]:
    """Find ratios outside the bound, bounds of another law and sliding the wrong way."""
    reach = piece_lengths(robot).sum() + robot["tube"]["outer_diameter"]
    most = max(np.abs(path.tension[step]).max(), 1e-300)
    highest = max(np.abs(path.tension).max(), 1e-12)
    own = max(highest, tension_scale(robot))
    for t in range(len(robot["tendon"])):
        count = spans_of(robot, path, t)
        along = path.span_tension[step, t, :count]
        ratio = path.contact_log_ratio[step, t, : count - 1]
        bound = path.contact_bound[step, t, : count - 1]
        turning = path.contact_turning[step, t, : count - 1]
        state = path.contact_state[step, t, : count - 1]
        name = f"tendon {t + 1}"
        yield from above("span tension below 0", step, float(-along.min()) / own, 1e-12, name)
        base = abs(along[0] - path.tension[step, t]) / most
        yield from above("first span is not the base", step, base, 1e-9, name)
        law = friction_bound(robot["friction"], turning)
        if robot["friction"].get("turning") != "chord":
            if robot["friction"].get("wrap") == "whole-before":
                # both edges of a notch rub before it; the last edge of all is no contact
                law = np.append(law, 0.0).reshape(-1, 2).sum(axis=1)
                law = np.maximum(law, bound[::2] * (np.arange(len(law)) == len(law) - 1))
                law = np.stack([law, np.zeros_like(law)], axis=1).ravel()[:-1]
            off = np.abs(law - bound).max() / (1 + law.max())
            yield from above("bound is not the law's", step, off, 1e-8, name)
        if path.tension[step, t] < 1e-9 * most:
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.abs(np.log(along[:-1] / along[1:]) - ratio).max()
        yield from above("ratio of spans is not the contact's", step, off, 1e-7, name)
        yield from above(
            "friction beyond its bound", step, (np.abs(ratio) - bound).max(), 1e-8, name
        )
        off = np.abs(ratio - state * bound)[state != 0]
        yield from above("slips below its bound", step, off.max(initial=0.0), 1e-6, name)
        # A step that was solved in parts may slide one way and then the other. From a slack state
        # on, it may first draw the tendon along without any friction.
        whole = step and path.converged[step - 1] and path.run.substeps[step] == 1
        if whole and path.tension[step - 1, t] > 1e-6 * highest:
            moved = path.contact_slid[step, t] - path.contact_slid[step - 1, t]
            moved = moved[: count - 1] / reach
            # The library tells stuck contacts of one piece apart as if an inextensible tendon had
            # E A = 4e5 closing forces (`Chain.memory_stiffness`): they slide by that stretch.
            change = np.abs(along - path.span_tension[step - 1, t, :count]).max()
            give = 1e-7 + 1.5 * change / (4e5 * tension_scale(robot))
            if robot["friction"].get("coefficient"):
                against = (-state * moved)[(state != 0) & (bound > 1e-6)].max(initial=0.0)
                yield from above("slid against its friction", step, against, give, name)
                stuck = np.abs(moved)[(state == 0) & (bound > 1e-6)].max(initial=0.0)
                yield from above("slid while sticking", step, stuck, give, name)


def check_lengths(robot: Table, path: Any, step: int) -> Iterator[Finding]:
    """Find strokes, slid lengths and turnings that the shape of arc notches does not give."""
    rows, ends = notches_of(robot), piece_lengths(robot)
    reach = ends.sum() + robot["tube"]["outer_diameter"]
    turns, places = path.body_rotation[step], path.body_position[step]
    for t, tendon in enumerate(robot["tendon"]):
        count = spans_of(robot, path, t)
        if not all_gaps(robot, path, t):
            continue
        slid = np.append(path.contact_slid[step, t, : count - 1], 0.0)
        stiff = tendon.get("axial_stiffness", np.inf)
        along = path.span_tension[step, t]
        rest = tendon.get("free_length", 0.0) + robot["tube"]["base_length"]
        off = abs(path.stroke[step, t] - slid[0] - along[0] * rest / stiff) / reach
        if rows[0]["kind"] == "arc":  # elsewhere the first span reaches beyond the base
            yield from above(
                "stroke is not what slid in and stretched", step, off, 1e-8, f"{t + 1}"
            )
        for j, notch in enumerate(rows[: count // 2]):
            if notch["kind"] != "arc":
                continue
            rotation = turns[j].T @ turns[j + 1]
            place = turns[j].T @ (places[j + 1] - places[j]) - [0, 0, ends[j]]
            free = free_pose(robot, notch)
            if tendon["path"] == "wall-arc":
                if abs(rotation[:, 2] @ np.cross([0, 0, 1], toward(notch))) > 1e-9:
                    continue  # bent sideways as well
                lever = arc_section(robot["tube"], notch)[0] + channel(tendon) @ toward(notch)
                start = np.radians(notch.get("precurvature_deg", 0.0))
                shorter = lever * (path.notch_angle[step, j] - start)
                rest = notch["height"] - lever * start
            else:
                rest = straight_gap(tendon, *free)[0]
                length, *angles = straight_gap(tendon, rotation, place)
                shorter = rest - length
                if robot["friction"]["kind"] != "frictionless" and tendon["path"] == "straight":
                    told = path.contact_turning[step, t, 2 * j : min(2 * j + 2, count - 1)]
                    off = np.abs(told - angles[: len(told)]).max()
                    yield from above("turning not of the shape", step, off, 1e-6, f"notch {j + 1}")
            drawn = slid[2 * j] - slid[2 * j + 1]
            if 2 * j + 2 == count:  # the tendon is fixed at the far end of its last body
                rest += ends[j + 1]
            off = abs(drawn - shorter - along[2 * j + 1] * rest / stiff) / reach
            yield from above("slid length not of the shape", step, off, 1e-8, f"notch {j + 1}")


def check_base(robot: Table, path: Any, load: Table, step: int) -> Iterator[Finding]:
    """Find a holder that does not balance loads and drives."""
    if has_own_weight(robot, load):
        return
    force, moment = base_reaction(robot, path[step], load)
    size = max(np.abs(force).max(), np.abs(path.tension[step]).max(), 1e-9)
    off = np.abs(force - path.base_force[step]).max() / size
    yield from above("base force does not balance", step, off, 1e-7)
    reach = piece_lengths(robot).sum() + robot["tube"]["outer_diameter"]
    size = max(np.abs(moment).max(), size * reach)
    off = np.abs(moment - path.base_moment[step]).max() / size
    yield from above("base moment does not balance", step, off, 1e-7)


def check_energy(robot: Table, path: Any, loads: list[Table], step: int) -> Iterator[Finding]:
    """Compare energy, work and heat from a state to a near one: virtual work of the balance."""
    paths = {tendon["path"] for tendon in robot["tendon"]}
    if has_own_weight(robot, loads[step]) or paths - {"wall-arc", "straight"}:
        return  # a pull along a channel is no conservative one
    first, second = path[step - 1], path[step]
    gained = float(second.stored_energy - first.stored_energy)
    work, size = work_between(first, second, loads[step - 1], loads[step])
    pulls = (first.tension + second.tension) / 2 * (second.stroke - first.stroke)
    heat = lasting = 0.0
    least = 1e-9 * float(np.abs(path.tension).max())
    for t in range(len(robot["tendon"])):
        count = spans_of(robot, path, t)
        along = (first.span_tension[t, :count] + second.span_tension[t, :count]) / 2
        moved = second.contact_slid[t, : count - 1] - first.contact_slid[t, : count - 1]
        rubbed = (along[:-1] - along[1:]) * moved
        heat += float(rubbed.sum())
        # a tendon let go to slack rubs backward while the mean of its tensions is still forward
        lasting += float(rubbed.sum()) if min(first.tension[t], second.tension[t]) > least else 0.0
        size += float((along[:-1] * np.abs(moved)).sum())
    reach = piece_lengths(robot).sum() + robot["tube"]["outer_diameter"]
    size += 1e-10 * float(np.abs(second.tension).max()) * reach  # what rounding leaves
    size += abs(gained) + float(np.abs(pulls).sum()) + 1e-10 * abs(float(first.stored_energy))
    rough = robot["friction"].get("coefficient", 0.0) > 0
    # Where a tendon turns round or goes slack on the way, tensions change first and strokes after:
    # the work of the drives lies anywhere between the tensions before and after.
    turned = (first.contact_state != second.contact_state).any()
    turned |= (np.minimum(first.tension, second.tension) <= least).any()
    between = np.abs(second.tension - first.tension) / 2 * np.abs(second.stroke - first.stroke)
    open_ = float(between.sum()) if turned else 0.0
    off = max(abs(gained + heat - work - float(pulls.sum())) - open_, 0.0) / max(size, 1e-300)
    more = f"gained {gained:.4e} heat {heat:.4e} outside {work:.4e} drives {pulls.sum():.4e}"
    yield from above("energy does not balance", step, off, 2e-3 if rough else 1e-4, more)
    # below this, contacts that stick give by what keeps their tension determined
    size = max(size, 1e-6 * float(np.abs(second.tension).max()) * reach, 1e-300)
    yield from above("friction gives energy", step, -lasting / size, 1e-3)
