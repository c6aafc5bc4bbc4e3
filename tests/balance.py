"""Balance of a whole robot, added up in numpy from what a result reports and what was put on it."""

from __future__ import annotations

import numpy as np

import notchflex as nf


def left_over(path: nf.EquilibriumPath) -> tuple[np.ndarray, np.ndarray]:
    """What holder, drives and loads leave unbalanced of force and moment, each over its size.

    The size is the sum of the magnitudes of all that acts. Moments are about the origin of the
    world, the proximal end of the tube.

    Returns:
        Relative force and moment, steps each.
    """
    acting = [_acting(path, step) for step in range(len(path))]
    force, moment = (
        np.array([_relative([one[kind] for one in step]) for step in acting]) for kind in (0, 1)
    )
    return force, moment


def cone_used(path: nf.EquilibriumPath) -> np.ndarray:
    """Friction over the largest that the contacts can bear, from tensions and turning alone.

    (s, t, contacts); 0 where no tendon is. At a corner (Gao 2017, Liu 2022) it is the friction
    force over mu times the normal force, at a capstan (Pacheco 2021) ln(T / T') over mu beta.
    Where the whole turning of a notch counts ahead of it (Pacheco 2021, eq. 10) it is taken for
    the two edges of each gap together, (s, t, gaps).
    """
    friction = path.robot.friction
    assert isinstance(friction, nf.Capstan | nf.Corner)
    tension, turning = path.span_tension, path.contact_turning
    if isinstance(friction, nf.Corner):
        rubbing, normal = _on_corner(tension[..., :-1], tension[..., 1:], turning)
        return _ratio(rubbing, normal, friction.coefficient)
    if friction.wrap == "whole-before":
        # Proximal, gap 1, body 1, gap 2, ...: a gap with both its edges lies between two bodies.
        # In the last body the tendon is fixed; its gap turns by twice what it does at one edge.
        tension = np.concatenate([tension[..., :-1:2], tension[..., -1:]], axis=-1)
        last = 2.0 * turning[..., -1:]
        turning = np.concatenate([turning[..., :-1:2] + turning[..., 1::2], last], axis=-1)
    fall = np.log(tension[..., :-1]) - np.log(tension[..., 1:])
    return _ratio(fall, turning, friction.coefficient)


def _on_corner(
    before: np.ndarray, behind: np.ndarray, turning: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Friction and normal force of a string on a corner, whose normal is the bisector.

    The string turns by beta and has the tensions T, T' before and behind: (T - T') cos(beta / 2)
    and (T + T') sin(beta / 2).
    """
    half = 0.5 * turning
    return (before - behind) * np.cos(half), (before + behind) * np.sin(half)


def _ratio(friction: np.ndarray, normal: np.ndarray, coefficient: float) -> np.ndarray:
    """Friction over its bound; infinite for friction without pressure, 0 for no tendon."""
    there = ~np.isnan(friction)
    size, bound = np.abs(friction), coefficient * normal
    without = np.where(there & (size > 0.0), np.inf, 0.0)
    return np.divide(size, bound, out=without, where=there & (bound > 0.0))


def _acting(path: nf.EquilibriumPath, step: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Every force with its moment about the origin; moments alone with no force."""
    external, nothing = path.load.external[step], np.zeros(3)
    bodies = list(zip(path.body_position[step], path.body_rotation[step], strict=True))
    base = bodies[0][1]
    every = [(path.base_force[step], path.base_moment[step])]
    for tendon, tension in zip(path.robot.tendon, path.tension[step], strict=True):
        side = np.radians(tendon.direction_deg)
        place = tendon.radius * np.array([np.cos(side), np.sin(side), 0.0])
        every.append(_at(base @ place, base @ [0.0, 0.0, -tension]))
    for one in external.body_forces:
        origin, rotation = bodies[one.body]
        turn = rotation if one.following else np.eye(3)
        every.append(_at(origin + rotation @ one.point, turn @ one.force))
        every.append((nothing, turn @ one.moment))
    turn = path.tip_rotation[step] if external.following else np.eye(3)
    hangs = path.tip_position[step] + path.tip_rotation[step] @ external.tip_point
    every.append(_at(hangs, turn @ external.tip_force))
    every.append((nothing, turn @ external.tip_moment))
    every.append(_at(hangs, np.array(external.weight(external.tip_mass))))
    if external.gravity is not None:
        masses, centres = path.chain.body_mass, path.chain.body_centre
        for (origin, rotation), mass, centre in zip(bodies, masses, centres, strict=True):
            every.append(_at(origin + rotation @ centre, np.array(external.weight(float(mass)))))
    return every


def _at(point: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(force), np.cross(point, force)


def _relative(vectors: list[np.ndarray]) -> float:
    size = sum(float(np.linalg.norm(vector)) for vector in vectors)
    return float(np.linalg.norm(np.sum(vectors, axis=0))) / (size or 1.0)
