"""Sections of cut tubes, and beams, against closed forms made by other means."""

from __future__ import annotations

import numpy as np
from differences import Difference, difference, table_of

import notchflex as nf
from notchflex.mechanics.flexure.u_link import CurvedEnd
from reference_data import CUTS, choose, reference

SECTIONS = {"on-axis": nf.annular_sector, "off-axis": nf.annular_segment}


def differences() -> list[Difference]:
    """Compare sections, the cantilever, and the middle line of a U-link."""
    rows = []
    table = reference("pacheco_sections.csv")
    for number, cut in enumerate(CUTS):
        own = choose(table, cut=(0, number))
        found = SECTIONS[cut](0.81, 0.70, own[:, 1])
        three = np.stack([found.area, found.centroid, found.second_moment_weak], axis=1)
        name = f"{cut} cut: area, centroid, second moment"
        rows.append(difference(name, three, own[:, 2:5], ""))
    beam = reference("liu_single_beam.csv")
    for mode, kind in enumerate(("clamp_angle", "follower")):
        own = choose(beam, mode=(0, mode))
        end = nf.elastica(own[:, 2], 1.0, 1.0, **{kind: np.radians(own[:, 1])})
        name = f"cantilever, {('force of fixed direction', 'following force')[mode]}: pose, chord"
        rows.append(difference(name, np.stack(end[:4], axis=1), own[:, 3:], "of the length, rad"))
    link, end = reference("gao_geometry_seg1.csv"), CurvedEnd(0.275, 0.70)
    middle = np.concatenate([end.middle(link[:, 0]), end.heading(link[:, 0])[:, None]], axis=1)
    rows.append(
        difference("curved end of a U-link: line, heading", middle, link[:, 6:9], "mm, rad")
    )
    return rows


def tables() -> dict[str, str]:
    """Return what stands on the page."""
    return {"sections": table_of(differences())}
