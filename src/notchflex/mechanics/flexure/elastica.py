r"""The cantilever at large deflection under a force at its end, in closed form.

Liu 2022, eq. 8-19: a straight beam, clamped at one end, inextensible, under a force F on its free
end. With ω the angle between its tangent and the direction opposite to the force, k = sin(ω₀/2)
at the free end, k' = cos(ω₀/2) and λ² = F l²/EI, the solution ω(s) = 2 arcsin(k cd(λ s/l)) of
EI ω'' = -F sin ω starts at the free end, where the moment is zero. The paper's differences
of integrals at two amplitudes, K(k) - F(γ₁, k) (eq. 17, whose printed form lacks a root and a
minus), are rewritten by the addition theorems with the amplitude am(λ) alone, which is small for
small loads: the slope keeps its relative precision, and the tip 1e-15 of the length.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from notchflex.errors import InputError


class Elastica(NamedTuple):
    """Free end of a cantilever, in the frame of its clamp.

    Attributes:
        tip_slope: Rotation of the free end, rad.
        tip_along: Position of the free end along the free beam, from the clamp, mm.
        tip_across: Its deflection across, toward the force, mm.
        chord_angle: Angle between the free beam and the line from clamp to free end, rad.
    """

    tip_slope: np.ndarray
    tip_along: np.ndarray
    tip_across: np.ndarray
    chord_angle: np.ndarray


def elastica(
    load: ArrayLike,
    length: ArrayLike,
    bending_stiffness: ArrayLike,
    *,
    clamp_angle: ArrayLike | None = None,
    follower: ArrayLike | None = None,
) -> Elastica:
    r"""Bend a cantilever by a force at its free end, exactly.

    The direction of the force is constant either in space (`clamp_angle`) or relative to the free
    end (`follower`); by default it is perpendicular to the free beam, `clamp_angle` π/2. All
    arguments may be arrays that broadcast.

    Args:
        load: Force at the free end, 0 or more, N.
        length: Length of the beam, mm.
        bending_stiffness: Bending stiffness EI, N mm².
        clamp_angle: Angle between the beam at its clamp, seen toward the free end, and the
            direction opposite to the force, rad: ω(L) of Liu 2022; above 0 and below π.
            π/2 is a force across the free beam, more is one that also pulls it outward, away
            from the clamp, less one that pushes on it.
        follower: The same angle at the free end, rad, kept as it turns: ω(0); above 0, below π.

    Returns:
        The free end.

    Raises:
        InputError: A value lies outside its range, or both angles are given.

    Reference:
        Liu et al., Machines 10, 778 (2022), eq. 8-19.

    Example:
        >>> tip = elastica(10.0, 8.0, 640.0)
        >>> print(f"{tip.tip_slope:.5f} rad, {tip.tip_across / 8.0:.5f} of the length")
        0.46135 rad, 0.30172 of the length
    """
    if clamp_angle is not None and follower is not None:
        raise InputError.CONFLICT("give either clamp_angle or follower, not both")
    given_angle = (
        follower if follower is not None else 0.5 * np.pi if clamp_angle is None else clamp_angle
    )
    name = "clamp_angle" if follower is None else "follower"
    load, length, stiffness, angle = np.broadcast_arrays(
        *(
            np.asarray(value, dtype=float)
            for value in (load, length, bending_stiffness, given_angle)
        )
    )
    for word, valid, allowed in (
        ("load", (load >= 0.0) & np.isfinite(load), "0 or more"),
        ("length", (length > 0.0) & np.isfinite(length), "greater than 0"),
        ("bending_stiffness", (stiffness > 0.0) & np.isfinite(stiffness), "greater than 0"),
        (name, (angle > 0.0) & (angle < np.pi), "between 0 and pi"),
    ):
        if not np.all(valid):
            raise InputError.NOT_FINITE(f"{word} must be {allowed} and finite")
    from scipy import special  # the import takes half a second; solves do not need it

    scaled = length * np.sqrt(load / stiffness)  # λ
    shape = (_from_clamp_angle if follower is None else _from_end_angle)(scaled, angle)
    slope, clamp, modulus, complement, sn, cn, dn, amplitude = shape
    squared = modulus**2
    # Along the direction opposite to the force, and across it (eq. 18): the integrals of cos ω
    # and sin ω, by ε(K) - ε(K - λ) = ε(λ) - k² sn cd.
    with np.errstate(divide="ignore", invalid="ignore"):
        opposite = (
            2.0 * (special.ellipeinc(amplitude, squared) - squared * sn * cn / dn) - scaled
        ) / scaled
        across = 2.0 * modulus * complement * sn / (dn * scaled)
    opposite = np.where(scaled > 0.0, opposite, np.cos(angle))
    across = np.where(scaled > 0.0, across, np.sin(angle))
    tip_along = length * (opposite * np.cos(clamp) + across * np.sin(clamp))
    tip_across = length * (across * np.cos(clamp) - opposite * np.sin(clamp))
    return Elastica(slope, tip_along, tip_across, np.arctan2(tip_across, tip_along))


# Slope of the free end, ω(L), k, k', and the elliptic functions of λ with its amplitude.
_Shape = tuple[np.ndarray, ...]


def _from_end_angle(scaled: np.ndarray, free: np.ndarray) -> _Shape:
    """Solve for a given ω(0); also beyond a quarter period, where the beam curls."""
    from scipy.special import ellipj

    modulus, complement = np.sin(0.5 * free), np.cos(0.5 * free)
    sn, cn, dn, amplitude = ellipj(scaled, modulus**2)
    # Sums of angles: sin((ω₀ - ω_L)/2) = k k' (1 - cn)/dn, its cosine (k² cn + k'²)/dn.
    vers = np.where(cn > 0.0, sn**2 / (1.0 + np.abs(cn)), 1.0 - cn)
    slope = 2.0 * np.arctan2(modulus * complement * vers, modulus**2 * cn + complement**2)
    return slope, free - slope, modulus, complement, sn, cn, dn, amplitude


def _from_clamp_angle(scaled: np.ndarray, clamp: np.ndarray) -> _Shape:
    """Solve for a given ω(L)."""
    # Near ω₀ = π, k' is computed from π - ω₀ to keep its digits; `ellipj` would lose them.
    slope, rest = _slope_for(scaled, clamp)
    modulus, complement = np.cos(0.5 * rest), np.sin(0.5 * rest)
    tangent = _tangent(slope, clamp, rest)
    sn, cn = tangent / np.hypot(1.0, tangent), 1.0 / np.hypot(1.0, tangent)
    dn = np.hypot(cn, complement * sn)
    return slope, clamp, modulus, complement, sn, cn, dn, np.arctan(tangent)


def _tangent(slope: np.ndarray, clamp: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Compute tan am(λ): cot γ₁ / k', with sin γ₁ = sin(ω_L/2) / k (Liu 2022, eq. 17)."""
    below = np.sin(0.5 * slope) * np.sin(clamp + 0.5 * slope)  # k² - sin²(ω_L/2)
    return np.sqrt(below) / (np.sin(0.5 * clamp) * np.sin(0.5 * rest))


def _slope_for(scaled: np.ndarray, clamp: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the slope of the free end, and π - ω there, for a given λ and ω(L)."""
    # λ = F(am(λ), k) rises with the slope from 0 to infinity. The unknown is the logit of the slope
    # over its range, so that both ends keep their relative precision.
    from scipy.optimize import elementwise
    from scipy.special import elliprf, expit

    span = np.pi - clamp
    loaded = scaled > 0.0
    log_load = np.log(np.where(loaded, scaled, 1.0))

    def excess(logit: np.ndarray, log_load: np.ndarray, clamp: np.ndarray) -> np.ndarray:
        span = np.pi - clamp
        slope, rest = span * expit(logit), span * expit(-logit)
        tangent = _tangent(slope, clamp, rest)
        sine, cosine = tangent / np.hypot(1.0, tangent), 1.0 / np.hypot(1.0, tangent)
        delta = cosine**2 + (sine * np.sin(0.5 * rest)) ** 2  # 1 - k² sin², without cancelling
        return np.log(sine * elliprf(cosine**2, delta, 1.0)) - log_load

    # λ² is about twice the slope over sin ω_L for small loads and the logit about λ for large
    # ones; -80 to 80 covers every load with a slope between 1e-34 and pi - 1e-34.
    low, high = np.full_like(scaled, -80.0), np.full_like(scaled, 80.0)
    root = elementwise.find_root(
        excess, (low, high), args=(log_load, clamp), tolerances={"xatol": 1e-15, "xrtol": 1e-15}
    )
    if not np.all(root.success | ~loaded):
        raise InputError.OUT_OF_RANGE(
            "load * length^2 / bending_stiffness must be at least 1e-30 (or 0) and below 3000"
        )
    logit = np.where(loaded, root.x, 0.0)
    return np.where(loaded, span * expit(logit), 0.0), np.where(loaded, span * expit(-logit), span)


def modulus_from_single_notch(
    force: ArrayLike,
    chord_angle: ArrayLike,
    *,
    length: float,
    second_moment: float,
    clamp_angle: ArrayLike | None = None,
    follower: ArrayLike | None = None,
) -> float:
    """Fit the elastic modulus to bending tests of samples with a single notch.

    Liu 2022 (section 5.2) calibrates the printed material in this way. The angle measured is
    that of the chord, as the paper reads its bending angles; the modulus is the one with the
    least sum of squared differences in angle.

    Args:
        force: Pull of every test, N.
        chord_angle: Angle of the chord of the strip in every test, rad.
        length: Length of the strip, mm.
        second_moment: Second moment of its section, mm⁴.
        clamp_angle: Direction of the force, see `elastica`; one, or one a test, rad.
        follower: The same for a force that turns with the free end, rad.

    Returns:
        The elastic modulus, MPa.

    Raises:
        InputError: The numbers are not one angle for each force, or no test bends the sample.

    Example:
        >>> angle = elastica([2.0, 4.0, 6.0], 8.0, 1000.0 * 1.125).chord_angle
        >>> print(
        ...     f"{modulus_from_single_notch([2, 4, 6], angle, length=8, second_moment=1.125):.3f}"
        ... )
        1000.000
    """
    from scipy.optimize import least_squares

    pull, measured = np.asarray(force, dtype=float), np.asarray(chord_angle, dtype=float)
    if pull.ndim != 1 or pull.shape != measured.shape or not len(pull):
        raise InputError.WRONG_SHAPE(
            f"force and chord_angle must be lists of one length, got shapes {pull.shape} and "
            f"{measured.shape}"
        )
    bends = pull * length**2 / (3.0 * second_moment)  # of small deflections, by E times the angle
    if not np.all(np.isfinite(measured)) or not bends @ measured > 0.0:
        raise InputError.NOT_FINITE(
            "no modulus fits: the angles must be finite, and grow with the force"
        )

    def misses(logarithm: np.ndarray) -> np.ndarray:
        stiffness = np.exp(logarithm[0]) * second_moment
        bent = elastica(pull, length, stiffness, clamp_angle=clamp_angle, follower=follower)
        return bent.chord_angle - measured

    start = np.log(bends @ bends / (bends @ measured))
    return float(np.exp(least_squares(misses, [start], xtol=1e-14, ftol=1e-14, gtol=1e-14).x[0]))
