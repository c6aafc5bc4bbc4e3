"""Which section each cut of an asymmetric notch leaves."""

from notchflex.mechanics.section.sector import annular_sector
from notchflex.mechanics.section.segment import annular_segment

SECTION_OF_CUT = {"on-axis": annular_sector, "off-axis": annular_segment}
