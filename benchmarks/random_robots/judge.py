"""Whether a solved state holds, judged outside the solver: `wrong(robot, load, path, before)`.

Everything is put together in NumPy from what a result reports, the description of the robot and
the load. Asked for:

- every number is one, where one is due;
- the commands are met, and what they do not name is slack;
- bodies are turned by rotations, notch angles and the tip are those of the poses;
- holder, drives and loads balance on the whole robot;
- every arc notch is in balance (arcs.py), every backbone and flexure of a table (rods.py), and so
  are rods and links in a plane (planar_rods.py);
- tensions and contact forces are not negative, gaps neither, one of force and gap is nil;
- tendons turn as the poses say, friction is within its bound there, opposes what slides, and
  tensions fall by it; strokes and slid lengths are those of the poses (tendons.py);
- sheaths lead their wires by Euler's law and remember their tension (sheaths.py);
- strains and the limit line give the margin of fatigue (cycles.py);
- from a near state on, the work of loads and drives is energy gained and heat.

No formula of the solver is called: those of sections, materials, friction and rings are written
again (sections.py, rings.py). Read are its data: openings of notches and lengths between them,
masses of bodies, places of fibres (which are judged) and what they remember. Not checked are
moments inside strips and U-links in space, but by energy, and energy where tendons pull along a
channel or fibres remember.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

import notchflex as nf

from .arcs import judge_arcs
from .cycles import judge_margin
from .forces import State, about_z, height_of
from .planar_rods import judge_planar_rods
from .rods import judge_rods, masses
from .sections import memory_of
from .sheaths import held_by_sheaths, judge_sheaths
from .tendons import judge_tendons

EXACT = 1e-8  # relative, of what is added up
SHARP = 1e-10  # of rotations
# Scaled as the solver scales its imbalance: a stroke over the length, a force over the largest.
_NEAR = 1e-7


# Parts of the energy that may be missing from a near state to the next, with friction and without.
_ROUGH, _SMOOTH = 2e-3, 1e-4
NUMBERS = [
    "tension",
    "stroke",
    "notch_angle",
    "total_angle",
    "tip_position",
    "tip_rotation",
    "body_position",
    "body_rotation",
    "notch_moment",
    "outer_strain",
    "peak_strain",
    "closed",
    "contact_force",
    "base_force",
    "base_moment",
    "moment_error",
    "stored_energy",
    "tendon_work",
    "smallest_eigenvalue",
    "residual",
    "iterations",
]
CONTACTS = [
    "contact_log_ratio",
    "contact_slid",
    "contact_bound",
    "contact_turning",
    "contact_state",
    "dissipation",
]


def not_finite(state: nf.Equilibrium) -> list[str]:
    """Tell which numbers of a solved state are none.

    Notches that never close have no gap. Over how many contacts a tendon runs tell its tensions.
    """
    notches = state.path.robot.notches
    known = np.array([not isinstance(notch, nf.TableNotch) for notch in notches])
    found = []
    for name in NUMBERS:
        values = np.asarray(getattr(state, name))
        if name in ("outer_strain", "peak_strain"):  # of tables they are not known
            values = values[known]
        if not np.isfinite(values).all():
            found.append(name)
    if any(tendon.sheath_length for tendon in state.path.robot.tendon):
        names = "base_tension", "base_stroke"
        found += [name for name in names if not np.isfinite(getattr(state, name)).all()]
    due = np.isfinite(state.span_tension)
    if not due[:, 0].all():
        found.append("span_tension")
    for name in CONTACTS:
        if (np.isfinite(getattr(state, name))[:, : due.shape[1] - 1] < due[:, 1:]).any():
            found.append(name)
    return [f"{name} is not finite" for name in found]


def wrong(
    robot: nf.Robot,
    load: nf.Load,
    path: nf.EquilibriumPath,
    before: tuple[nf.Load, nf.EquilibriumPath] | None = None,
) -> list[str]:
    """Tell what does not hold of a solved state.

    Args:
        robot: The robot.
        load: The load.
        path: What `nf.simulate(robot, load)` returned; its one step is converged.
        before: A load near this one and its state, from which this one was reached.

    Returns:
        One sentence for everything that does not hold.
    """
    if unfinished := not_finite(path[0]):
        return unfinished
    state = State(robot, load, path)
    arcs = judge_arcs(state)
    of_rods, tables = judge_rods(state)
    found = [
        *_commands(load, state),
        *_poses(state),
        *_whole(state),
        *([] if state.undecided else [*arcs.problems, *of_rods]),
        *masses(state),
        *judge_planar_rods(state),
        *_contacts(state),
        *judge_tendons(state, arcs, tables),
        *judge_sheaths(state),
        *judge_margin(state),
    ]
    return found if before is None else [*found, *_energy(State(robot, *before), state)]


def plain(reason: str) -> str:
    """A reason without its numbers, so that equal ones are counted together."""
    number = r"-?\d+(\.\d+)?(e[+-]?\d+)?"
    return re.sub(rf"{number}(, {number})*", "#", reason)


def _commands(load: nf.Load, state: State) -> Iterator[str]:
    """Tensions and strokes are as demanded; a tendon with too much length is slack."""
    near, tendons = _NEAR * state.height, state.robot.number_of_tendons
    tensions, strokes = (load.per_tendon(name, tendons) for name in ("tension", "stroke"))
    for number, (tension, stroke) in enumerate(zip(tensions, strokes, strict=True)):
        name = f"tendon {number + 1}"
        pulled, drawn = float(state.now.tension[number]), float(state.now.stroke[number])
        if stroke is None:
            asked = tension or 0.0
            if not abs(pulled - asked) <= EXACT * asked + state.rounding:
                yield f"{name}: {pulled:.6g} N, not {asked:.6g}"
        elif not (drawn > stroke - near and (drawn < stroke + near or pulled < state.rounding)):
            yield f"{name}: {drawn:.6g} mm, not {stroke:.6g}"


def _poses(state: State) -> list[str]:
    """Rotations are rotations; angles and tip are those of the bodies."""
    found = []
    now, turn = state.now, state.rotation
    off = np.abs(np.swapaxes(turn, 1, 2) @ turn - np.eye(3)).max()
    if off > SHARP or np.abs(np.linalg.det(turn) - 1.0).max() > SHARP:
        found.append(f"bodies are turned by what is no rotation (by {off:.1e})")
    tip_turned = np.abs(now.tip_rotation - turn[-1]).max() > SHARP
    if tip_turned or np.abs(state.tip - now.tip_position).max() > SHARP * state.reach:
        found.append("the tip is not where the last body has it")
    frames = np.array([about_z(notch.direction_deg) for notch in state.robot.notches])
    relative = np.swapaxes(turn[:-1] @ frames, 1, 2) @ turn[1:] @ frames
    sine = relative[:, 0, 2] - relative[:, 2, 0]
    cosine = relative[:, 0, 0] + relative[:, 2, 2]
    off = np.abs(np.arctan2(sine, cosine) - now.notch_angle).max()
    if off > SHARP:
        found.append(f"notch angles are not those of the bodies (by {off:.1e})")
    return found


def _whole(state: State) -> list[str]:
    """Holder, drives and loads balance; moments are about the proximal end."""
    now = state.now
    force, moment, sizes = state.beyond(0, np.zeros(3))
    # Inner forces cancel but count for the size: tendons and edges are larger than what is left.
    force, moment = force + now.base_force, moment + now.base_moment
    for number, tension in enumerate(state.pull):
        pull = state.rotation[0] @ [0.0, 0.0, -tension]
        at = np.cross(state.rotation[0] @ state.tendon_place(number), pull)
        force, moment = force + pull, moment + at
        sizes = sizes[0] + np.linalg.norm(pull), sizes[1] + np.linalg.norm(at)
    found = []
    sums = (("force", force, sizes[0], 1.0), ("moment", moment, sizes[1], state.reach))
    for name, left, size, lever in sums:
        off = float(np.linalg.norm(left))
        if off > EXACT * size + state.rounding * lever:
            found.append(
                f"{name} of the whole out of balance by {off:.1e} (all that acts: {size:.1e})"
            )
    return found


def _contacts(state: State) -> list[str]:
    """Closed notches: force and gap not negative, one of them nil, gaps those of the poses."""
    now, found = state.now, []
    force, gap = now.contact_force, now.gap
    height = np.array([height_of(notch) for notch in state.robot.notches])
    closes = ~np.isnan(gap)
    largest = np.abs(now.notch_moment).max() / state.robot.tube.outer_radius
    if (force < -state.rounding).any():
        found.append(f"lips pull with {-force.min():.1e} N")
    if (gap[closes] < -1e-8 * np.maximum(height, 1.0)[closes]).any():
        found.append(f"lips overlap by {-np.nanmin(gap):.1e} mm")
    pressed = force > _NEAR * largest + state.rounding
    both = pressed & (np.where(closes, gap, np.inf) > _NEAR * height)
    if both.any():
        found.append(f"lips press over a gap of {gap[both].max():.1e} mm")
    apart = np.where(closes, gap, np.inf) > 10.0 * _NEAR * height
    if (now.closed & apart | ~now.closed & (force > 10.0 * _NEAR * largest + state.rounding)).any():
        found.append("which notches are closed is not what gap and force say")
    edges = np.isfinite(state.gap)
    off = np.abs(state.gap - gap)[edges] / height[edges]
    if off.size and not off.max() < 1e-9 * (1.0 + state.reach / height.min()):
        found.append(f"gaps of edges are not those of the poses (by {off.max():.1e} of the height)")
    return found


def _energy(before: State, state: State) -> list[str]:
    """Energy gained, work and heat from a state to a near one: virtual work of the balance."""
    robot, first, second = state.robot, before.now, state.now
    if {tendon.path for tendon in robot.tendon} - {"wall-arc", "straight"}:
        return []  # a pull along a channel is no conservative one
    if memory_of(state.path) is not None:
        return []  # its fibres lose energy from state to state
    gained = float(second.stored_energy - first.stored_energy)
    gained -= held_by_sheaths(state.path) - held_by_sheaths(before.path)
    work = size = 0.0
    for one, other in zip(before.external, state.external, strict=True):
        turn = Rotation.from_matrix(state.rotation[one.body] @ before.rotation[one.body].T)
        for mean, way in (
            (one.force + other.force, other.point - one.point),
            (one.moment + other.moment, turn.as_rotvec()),
        ):
            work += 0.5 * mean @ way
            size += 0.5 * np.abs(mean * way).sum()
    drawn = state.drawn - before.drawn
    pulls = 0.5 * (before.pull + state.pull) * drawn
    least = 1e-9 * max(before.pull.max(), state.pull.max())
    along = 0.5 * (first.span_tension + second.span_tension)
    moved = (second.contact_slid - first.contact_slid)[:, : along.shape[1] - 1]
    rubbed = np.nan_to_num(along[:, :-1] - along[:, 1:]) * np.nan_to_num(moved)
    heat = float(rubbed.sum() + np.sum(second.material_dissipation - first.material_dissipation))
    # A tendon let go to slack rubs backward while the mean of its tensions is still forward.
    taut = np.minimum(before.pull, state.pull) > least
    # So does a contact that turns round on the way.
    stays = (first.contact_state == second.contact_state)[:, : rubbed.shape[1]]
    lasting = float(np.where(stays, rubbed, 0.0)[taut].sum())
    most, reach = float(state.pull.max()), float(state.length.sum()) + state.height
    reach += 2.0 * robot.tube.outer_radius
    size += float(np.nansum(along[:, :-1] * np.abs(moved))) + 1e-10 * most * reach
    size += abs(gained) + float(np.abs(pulls).sum()) + 1e-10 * abs(float(first.stored_energy))
    # Where a tendon turns round or goes slack on the way, tensions change first and strokes after:
    # the work of the drives lies anywhere between the tensions before and after.
    alike = np.array_equal(first.contact_state, second.contact_state, equal_nan=True)
    between = 0.5 * np.abs(state.pull - before.pull) * np.abs(drawn)
    open_ = 0.0 if alike and taut.all() else float(between.sum())
    size = max(size, 1e-150)  # what remains of a robot at rest are squares of rounding
    off = max(abs(gained + heat - work - float(pulls.sum())) - open_, 0.0) / size
    found = []
    if not off <= (_ROUGH if getattr(robot.friction, "coefficient", 0.0) else _SMOOTH):
        found.append(
            f"energy does not balance by {off:.1e}: gained {gained:.4e}, heat {heat:.4e}, "
            f"outside {work:.4e}, drives {pulls.sum():.4e}"
        )
    # Below this, contacts that stick give by what keeps their tension determined.
    if -lasting > 1e-3 * max(size, 1e-6 * most * reach, 1e-300):
        found.append(f"friction gives {-lasting:.1e} N mm")
    return found
