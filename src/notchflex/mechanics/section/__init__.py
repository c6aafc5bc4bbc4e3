"""Cross-sections that cuts leave of a tube: area, moments, torsion, shear centre, edges."""

from notchflex.mechanics.section.cuts import SECTION_OF_CUT as SECTION_OF_CUT
from notchflex.mechanics.section.cuts import annular_sector as annular_sector
from notchflex.mechanics.section.cuts import annular_segment as annular_segment
from notchflex.mechanics.section.section import Section as Section
from notchflex.mechanics.section.section import clamped_torsion_constant as clamped_torsion_constant
from notchflex.mechanics.section.section import two_walls as two_walls
