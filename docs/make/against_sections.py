"""Sections of cut tubes, and beams, against closed forms made by other means."""

from __future__ import annotations

import numpy as np
from differences import Differences

import notchflex as nf
from notchflex.mechanics.flexure.u_link import CurvedEnd
from reference_data import CUTS, choose, reference

SECTIONS = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}


def tables() -> dict[str, str]:
    """Compare sections, the cantilever, and the middle line of a U-link."""
    compared = Differences()
    table = reference("pacheco_sections.csv")
    for number, cut in enumerate(CUTS):
        rows = choose(table, cut=(0, number))
        section = SECTIONS[cut](0.81, 0.70, rows[:, 1])
        three = np.stack([section.area, section.centroid, section.second_moment_weak], axis=1)
        compared.add(f"{cut} cut: area, centroid, second moment", three, rows[:, 2:5])
    beam = reference("liu_single_beam.csv")
    forces = {"clamp_angle": "force of fixed direction", "follower": "following force"}
    for mode, (kind, force) in enumerate(forces.items()):
        rows = choose(beam, mode=(0, mode))
        end = nf.elastica(rows[:, 2], 1.0, 1.0, **{kind: np.radians(rows[:, 1])})
        pose = np.stack(end[:4], axis=1)
        name = f"cantilever, {force}: pose, chord"
        compared.add(name, pose, rows[:, 3:], "of the length, rad")
    link, end = reference("gao_geometry_seg1.csv"), CurvedEnd(0.275, 0.70)
    middle = np.concatenate([end.middle(link[:, 0]), end.heading(link[:, 0])[:, None]], axis=1)
    compared.add("curved end of a U-link: line, heading", middle, link[:, 6:9], "mm, rad")
    return {"sections": compared.table()}
