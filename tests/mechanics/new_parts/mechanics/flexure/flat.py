"""The rod of a flat strip."""

from notchflex.mechanics.flexure import notch_rod as nr
from notchflex.mechanics.flexure.rod import Rod, rod, section_fibres
from notchflex.mechanics.section import two_walls, two_walls_fibres
from notchflex.robot import Tube
from notchflex.robot.notches.flat import FlatNotch


@rod.register
def _(notch: FlatNotch, tube: Tube, refinement: int = 0) -> Rod:
    points = nr.RodQuadrature((0.0, notch.height), (7 + refinement,), (10 + refinement,))
    axis = nr.NeutralAxis(points, nr.shifted(-notch.offset), nr.shifted(notch.offset))
    strip = two_walls(0.5 * notch.width, notch.thickness, 0.25 * notch.width)
    modes = nr.legendre_modes(points, 2 + refinement, 2 + refinement, 1, tendon_modes=1)
    closure = tube.outer_radius + notch.offset
    section = nr.about_neutral_axis(strip)
    return nr.build_rod(axis, section, modes, closure, direction_deg=notch.direction_deg)


@section_fibres.register
def _(notch: FlatNotch, tube: Tube):
    return two_walls_fibres
