"""The text of a deck for CalculiX: mesh, material, tendons, contact, load. mm, N, MPa."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from notchflex.export.finite_elements.material_cards import material_cards, with_cards
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.finite_elements.tendon_spans import TendonSpan
from notchflex.export.finite_elements.tube_mesh import TubeMesh
from notchflex.robot import Robot

# A contact this many times stiffer (N/mm³) than the modulus over 1 mm lets faces overlap little.
_CONTACT = 50.0
_PER_LINE = 12


def deck(
    robot: Robot,
    mesh: TubeMesh,
    spans: list[TendonSpan],
    options: DeckOptions,
    comment: str = "",
) -> str:
    """Return the text of a deck that CalculiX runs as it is.

    Args:
        robot: The robot.
        mesh: The mesh of it, or of half of it.
        spans: The straight pieces of its tendons, with the whole tension.
        options: Mesh, contact and end moment.
        comment: What stands at the head.
    """
    extra = [span.fixed for span in spans if span.fixed is not None]
    tip = _tip_plate(mesh, len(extra)) if options.tip_moment else None
    lines = [f"** {line}" for line in comment.splitlines()]
    lines += ["*NODE,NSET=NALL", *_nodes(mesh.place, 1)]
    if extra:
        lines += ["*NODE,NSET=NFIXED", *_nodes(np.array(extra), len(mesh.place) + 1)]
    lines += ["*ELEMENT,TYPE=C3D20R,ELSET=TUBE"]
    for number, row in enumerate(mesh.elements.tolist(), start=1):
        text = [number, *row]
        lines += [",".join(map(str, text[:11])) + ",", ",".join(map(str, text[11:]))]
    lines += _sets(mesh, tip is not None)
    lines += ["*MATERIAL,NAME=TUBE", *material_cards(robot.material)]
    lines += ["*SOLID SECTION,ELSET=TUBE,MATERIAL=TUBE"]
    lines += _springs(mesh, spans)
    if tip:
        lines += tip
    if options.contact:
        lines += list(_contact(mesh, robot))
    lines += ["*BOUNDARY", "NCLAMP,1,3"] + (["NPLANE,2,2"] if mesh.is_half else [])
    if extra:
        lines += ["NFIXED,1,3"]
    lines += ["*INITIAL CONDITIONS,TYPE=TEMPERATURE", "NALL,0."]
    lines += ["NFIXED,0."] if extra else []
    lines += ["*STEP,NLGEOM,INC=400", "*STATIC", "0.1,1.,1e-6,0.25"]
    # The tension of the springs grows with the temperature, from 0 to 1; nothing else does.
    lines += ["*TEMPERATURE", "NALL,1."] + (["NFIXED,1."] if extra else [])
    if tip:
        first = len(mesh.place) + len(extra) + 1
        side = np.radians(robot.notches[0].direction_deg - mesh.x_deg)
        across = mesh.share * options.tip_moment * np.array([-np.sin(side), np.cos(side)])
        lines += ["*CLOAD", *(f"{first + 1},{k},{m:.10g}" for k, m in enumerate(across, 1) if m)]
    lines += ["*NODE FILE", "U,RF", "*EL FILE", "S,E"]
    lines += ["*NODE PRINT,NSET=NCLAMP,TOTALS=ONLY", "RF"]
    lines += ["*NODE PRINT,NSET=NRINGS", "U", "*END STEP", ""]
    return "\n".join(lines)


def _nodes(positions: np.ndarray, first: int) -> Iterator[str]:
    for number, (x, y, z) in enumerate(positions.tolist(), start=first):
        yield f"{number},{x:.10g},{y:.10g},{z:.10g}"


def _set(name: str, numbers: Iterable[int]) -> Iterator[str]:
    yield f"*NSET,NSET={name}"
    each = sorted(set(map(int, numbers)))
    for start in range(0, len(each), _PER_LINE):
        yield ",".join(map(str, each[start : start + _PER_LINE])) + ","


def _sets(mesh: TubeMesh, has_plate: bool) -> list[str]:
    clamped = set(mesh.layer(0).tolist())
    lines = list(_set("NCLAMP", clamped))
    if mesh.is_half:
        plane = set(mesh.in_plane().tolist()) - clamped
        if has_plate:  # the plate holds its own nodes
            plane -= set(mesh.layer(-1).tolist())
        lines += _set("NPLANE", plane)
    rings = ring_layers(mesh)
    for number, index in enumerate(rings):
        lines += _set(f"NRING{number}", mesh.layer(index).tolist())
    lines += ["*NSET,NSET=NRINGS", *(f"NRING{number}," for number in range(len(rings)))]
    if has_plate:
        lines += _set("NTIP", mesh.layer(-1).tolist())
    return lines


def ring_layers(mesh: TubeMesh) -> list[int]:
    """Return the layers in the middle of the uncut lengths, base first, by their index along z.

    The base is layer 0 where it has no length.
    """
    height = mesh.heights
    edges = [0, *mesh.faces.ravel().tolist(), len(height) - 1]
    middle = 0.5 * (height[edges[::2]] + height[edges[1::2]])
    return [int(np.argmin(np.abs(height - z))) for z in middle]


def _springs(mesh: TubeMesh, spans: list[TendonSpan]) -> list[str]:
    """Springs of constant force: their tension follows the line between their moving ends."""
    lines: list[str] = []
    fixed = len(mesh.place)
    for number, span in enumerate(spans, start=1):
        ends = list(span.nodes)
        if span.fixed is not None:
            fixed += 1
            ends.insert(0, fixed)
        force = mesh.share * span.tension
        name = f"SPAN{number}"
        lines += [f"*ELEMENT,TYPE=SPRINGA,ELSET={name}"]
        lines += [f"{len(mesh.elements) + number},{ends[0]},{ends[1]}"]
        lines += [f"*SPRING,ELSET={name},NONLINEAR"]
        lines += [f"0.,{x:g},0." for x in (-100.0, 100.0)]
        lines += [f"{force:.10g},{x:g},1." for x in (-100.0, 100.0)]
    return lines


def _tip_plate(mesh: TubeMesh, extra: int) -> list[str]:
    """A rigid plate on the end of the tube; on half a tube it turns about y alone."""
    first = len(mesh.place) + extra + 1
    end = float(mesh.heights[-1])
    lines = [
        "*NODE",
        f"{first},0.,0.,{end:.10g}",
        f"{first + 1},0.,0.,{end:.10g}",
        f"*RIGID BODY,NSET=NTIP,REF NODE={first},ROT NODE={first + 1}",
    ]
    if not mesh.is_half:
        return lines
    return [
        *lines,
        "*BOUNDARY",
        f"{first},2,2",
        f"{first + 1},1,1",
        f"{first + 1},3,3",
    ]


def _contact(mesh: TubeMesh, robot: Robot) -> Iterator[str]:
    """Both faces of every notch, over the outer half of the opening, where they meet."""
    modulus = with_cards(robot.material).elastic_modulus
    names: list[tuple[str, str]] = []
    for notch, opening in enumerate(mesh.openings, start=1):
        below, above = mesh.faces_of(opening)
        if not (len(below) and len(above)):
            continue
        names.append((f"LOWER{notch}", f"UPPER{notch}"))
        for name, elements, face in zip(names[-1], (below, above), ("S2", "S1"), strict=True):
            yield f"*SURFACE,NAME={name},TYPE=ELEMENT"
            yield from (f"{element},{face}" for element in elements.tolist())
    if names:
        yield "*SURFACE INTERACTION,NAME=FACES"
        yield "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR"
        yield f"{_CONTACT * modulus:.10g}"
        for pair in names:
            yield "*CONTACT PAIR,INTERACTION=FACES,TYPE=SURFACE TO SURFACE"
            yield ",".join(pair)
