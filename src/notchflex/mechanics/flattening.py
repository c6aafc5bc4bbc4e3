r"""Softening of a notch as it closes: the arc flattens as it bends.

The section of the arc distorts with the amplitude V(z): its wall bends around the tube by
$V m(\varphi)/r^2$, as a bent tube does that flattens (Brazier), here with free edges:

$$m = \tfrac12(\sin^2 a + \sin^2\varphi) + s(\cos a - \cos\varphi) - s\varphi\sin\varphi,\qquad
s = \frac{\sin a}a.$$

The distortion keeps lengths around the tube and right angles, hence it stretches the arc along the
tube by $r V''u(\varphi)$ with $u'''' + u'' = m$; u has no part that moves the section as a whole.
With $J_k = \int_0^a m^k\,d\varphi$ its energy is that of a beam on an elastic foundation,

$$\tfrac12\int (C V''^2 + B V^2)\,dz,\qquad C = t r^3\int u^2 d\varphi,\qquad
B = \frac{t^3}{6(1-\nu^2)}\frac{J_2}{r^3},$$

over Young's modulus; bent by κ, its second moment falls by $2SV$, $S = 2 r^2 t J_2$, which costs or
gives the energy $\kappa^2 SV$. The distortion has three causes. Bending itself makes Brazier's,
even in the angle; Poisson's ratio makes one that is odd in it, and the rings beside the notch
another: their edges warp under the stress of the arc, and they yield to it at either end.

Of the moment $M = K_0\theta/q^2$ with $q = 1 + \alpha\theta/2 + \beta\theta^2/2$ and the length ℓ
of the notch with its ends,

$$\alpha = 3 c_a\frac{c_\nu\nu r\phi h - c_r S\int V_r\,dz}{\ell^2},\quad
\phi = \frac{2 t r^3 |J_1|}I,\qquad
\beta = c_b a^p\Bigl(\frac hr\Bigr)^m\frac{48(1-\nu^2) r^7 J_2}{tI}\frac h{\ell^3}$$

with the distortion $V_r$ by the rings per unit of moment: a notch closes softer and opens stiffer.
Beyond the elastic limit the part of $V_r$ goes with the moment, which makes it, the others with the
angle: the wall then resists its distortion by as much less as the moment that drives it is less.
The factors stand for what one mode of distortion leaves out; they would be 1, and p and m 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from notchflex._arrays import xp
from notchflex._jax import scan
from notchflex.mechanics.ring import EDGE_NORM, HARMONICS, EndCompliance, WallSector, inverse
from notchflex.mechanics.section import gauss_on, up_to


class FittedFactors(NamedTuple):
    """Factors on what the derivation gives, for one kind of cut."""

    relaxation: float  # On the energy of the stress at the interface, harmonics n >= 2
    odd: float  # c_a


# Fitted to finite elements of wrists up to closing (benchmarks/fe/README.md).
FACTORS = {"on-axis": FittedFactors(0.806, 0.788), "off-axis": FittedFactors(0.835, 1.0)}
_POISSON, _RINGS = 0.611, 2.634  # c_nu, c_r
_BRAZIER, _WIDTH, _HEIGHT = 0.521, -1.056, 0.815  # c_b, p, m


# Integrals of a function from 0 to Gauss's nodes on 0 ... 1, from its values there.
_UP_TO = up_to(24, gauss_on(0.0, 1.0, 24)[0])


class Distortion(NamedTuple):
    """How the section of an arc distorts; over Young's modulus.

    Attributes:
        loads: What acts on the edge of a ring by V'' and by V''', in harmonics, as
            `edge_compliance` takes loads.
        along: C, mm^6.
        around: B, mm^2.
        first: J1, rad.
        second: J2, rad.
    """

    loads: Float[Array, "2 harmonics 4"]
    along: Array
    around: Array
    first: Array
    second: Array


def distortion(arc: WallSector, poisson_ratio: float) -> Distortion:
    """Compute the distortion of an arc of wall."""
    r, t, a = arc.radius, arc.wall, arc.half_angle
    angle, weights = gauss_on(0.0, a, len(_UP_TO))
    sine, cosine, end = xp.sin(angle), xp.cos(angle), xp.sin(a)
    before = a * _UP_TO
    turned = xp.cos(a) - cosine - angle * sine
    amplitude = 0.5 * (end**2 + sine**2) + end / a * turned
    # The solution u'' of u'''' + u'' = m is the integral of m sin x at the distance x. What moves
    # the section as a whole is taken off.
    bent = sine * (before @ (cosine * amplitude)) - cosine * (before @ (sine * amplitude))
    along = before @ (before @ bent)
    rigid = xp.stack([xp.ones_like(angle), 2.0 * xp.sin(0.5 * angle) ** 2])
    weighed = rigid * weights[None]
    along = along - inverse(weighed @ rigid.T) @ (weighed @ along) @ rigid
    pull, slide = 2.0 * t * r * weights * along, -2.0 * t * r**2 * weights * (before @ along)

    def harmonic(wave: Any, _: Any) -> Any:
        even, odd = wave
        following = even * cosine - odd * sine, odd * cosine + even * sine
        return following, (even @ pull, odd @ slide)

    start = xp.ones_like(angle), xp.zeros_like(angle)
    sums = scan(harmonic, start, (np.zeros(HARMONICS),))[1]
    tension, shear = (values / EDGE_NORM for values in sums)
    nought = xp.zeros_like(tension)
    loads = [[nought, nought, tension, nought], [shear, nought, nought, nought]]
    first, second = amplitude @ weights, amplitude**2 @ weights
    return Distortion(
        xp.moveaxis(xp.stack([xp.stack(load) for load in loads]), 1, 2),
        2.0 * t * r**3 * (along**2 @ weights),
        t**3 / (6.0 * (1.0 - poisson_ratio**2)) * second / r**3,
        first,
        second,
    )


# x-derivatives of exp(-x) (cos x, sin x), as matrices on these two, up to the third.
_DERIVATIVE = np.array([[-1.0, -1.0], [1.0, -1.0]])
_DERIVATIVES = np.array([np.linalg.matrix_power(_DERIVATIVE, order) for order in range(4)])


def _distorted_by_rings(
    distorted: Distortion, height: float, rings: Sequence[EndCompliance]
) -> Array:
    """Integrate the distortion that the rings make along a notch, per unit of moment.

    Args:
        distorted: How the section distorts.
        height: Height of the notch, mm.
        rings: What either ring adds; the loads are those of the distortion.
    """
    # V is what decays from either end; there [C V', -C V] - R [V'', V'''] is what the ring does.
    rate = (distorted.around / (4.0 * distorted.along)) ** 0.25
    reach = rate * height
    here, there = xp.array([1.0, 0.0]), xp.exp(-reach) * xp.stack([xp.cos(reach), xp.sin(reach)])
    powers = rate ** np.arange(4.0)
    own = powers[:, None] * (_DERIVATIVES @ here)
    other = (powers * (-1.0) ** np.arange(4))[:, None] * (_DERIVATIVES @ there)
    held = distorted.along * np.array([[0.0, 1.0], [-1.0, 0.0]])
    first, last = (xp.concatenate([held, -ring.yielding], 1) for ring in rings)
    system = xp.block([[first @ own, first @ other], [last @ other, last @ own]])
    amplitudes = inverse(system) @ xp.concatenate([ring.warped for ring in rings])
    total = np.linalg.inv(_DERIVATIVE) @ (there - here) / rate
    return xp.sum(amplitudes.reshape(2, 2) @ total)


def softening(
    arc: WallSector,
    distorted: Distortion,
    rings: Sequence[EndCompliance],
    second_moment: Any,
    height: float,
    length: Any,
    poisson_ratio: float,
    odd: float,
) -> tuple[Array, Array, Array]:
    """Compute α, its part by the rings, and β of a notch from its length with its ends."""
    r, t, first, second = arc.radius, arc.wall, distorted.first, distorted.second
    phi = 2.0 * t * r**3 * xp.abs(first) / second_moment
    poisson = _POISSON * poisson_ratio * r * phi * height
    by_rings = _distorted_by_rings(distorted, height, rings)
    warped = -2.0 * _RINGS * r**2 * t * second * by_rings
    brazier = 48.0 * (1.0 - poisson_ratio**2) * r**7 * second / (t * second_moment)
    fitted = _BRAZIER * arc.half_angle**_WIDTH * (height / r) ** _HEIGHT
    own, by_rings = (3.0 * odd * part / length**2 for part in (poisson, warped))
    return own + by_rings, by_rings, fitted * brazier * height / length**3
