"""The deck for CalculiX: mesh, material, tendons, contact, load. mm, N, MPa."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from notchflex import (
    ArcNotch,
    EquilibriumPath,
    InputError,
    Linear,
    Nitinol,
    Robot,
    StressStrain,
    Superelastic,
    __version__,
    closing,
    pull,
    simulate,
)
from notchflex.export.cuts import check_one_tube, tendon_holes
from notchflex.export.formats import DeckOptions, Document, Subject
from notchflex.export.mesh import TubeMesh, mesh_of
from notchflex.support import ExternalLoad, Material, robot_digest, unchecked_dimensions

Array = NDArray[np.float64]

_MAX_STRAIN = 0.2  # strain up to which a curve is continued
# A node is the tendon's point if it is so near, as a part of the tendon's radius.
_NEAR = 0.01
# A tendon off the nodes hangs on those of the wall that lie within this angle of its side.
_PATCH = np.radians(45.0)
# A contact this many times stiffer (N/mm³) than the modulus over 1 mm lets faces overlap little.
_CONTACT = 50.0
_PER_LINE = 12  # numbers
_STEPS = 9  # of the pull to a usual tension


def material_cards(material: Material) -> str:
    """Return the cards of a material.

    A material with a plateau is given as plastic with hardening: right while it is loaded, not when
    it unloads. True stress is taken over logarithmic strain.

    Raises:
        InputError: The kind has no cards.
    """
    modulus: float = getattr(material, "elastic_modulus", 0.0)
    match material:
        case Linear():
            strain = stress = np.zeros(0)
        case Superelastic():
            strain, stress = _plateau(
                modulus, material.transition_strain, material.superelastic_modulus
            )
        case Nitinol():
            strain, stress = _plateau(
                modulus, material.plateau_stress / modulus, material.plateau_modulus
            )
        case StressStrain():
            strain, stress = map(np.array, material.in_tension)
        case _:
            raise InputError.UNSUPPORTED(
                f"a material of kind {material.kind!r} has no cards for CalculiX; use a linear, "
                "superelastic, nitinol or stress-strain one"
            )
    cards = f"*ELASTIC\n{modulus:.10g},{material.poisson_ratio:.10g}"
    points = _rows(np.stack([stress, strain - stress / modulus], axis=1))
    return f"{cards}\n*PLASTIC\n{points}" if points else cards


def _plateau(modulus: float, first: float, slope: float) -> tuple[Array, Array]:
    """Return strains and stresses (MPa) from the end of the elastic line on."""
    strain = np.array([first, max(_MAX_STRAIN, 2.0 * first)])
    return strain, modulus * first + slope * (strain - first)


class TendonPoint(NamedTuple):
    """A point that a tendon is led through.

    Its displacement is the weighted sum of those of nodes. The weights add up to 1 and those of the
    nodes' places to its place, so that it turns with the wall however far that turns, and its force
    is that of the nodes in sum and in moment.

    Attributes:
        place: Where it is [mm].
        ties: Nodes and their weights; none where it is at rest, one where it is a node itself.
    """

    place: tuple[float, float, float]
    ties: tuple[tuple[int, float], ...]


class TendonSpan(NamedTuple):
    """A straight piece of a tendon.

    Attributes:
        ends: Its ends, base first.
        tension: Its tension, N.
    """

    ends: tuple[TendonPoint, TendonPoint]
    tension: float


def tendon_spans(robot: Robot, mesh: TubeMesh, number: int, tension: Array) -> list[TendonSpan]:
    """Return the pieces of a tendon.

    Args:
        robot: The robot.
        mesh: The mesh, with a line at the tendon.
        number: Which tendon, from 0.
        tension: Tension of its spans as `span_tension` has them: proximal, gap 1, body 1, ...

    Raises:
        InputError: The tendon meets no wall.
    """
    tendon, starts = robot.tendon[number], robot.geometry.body_start
    side = np.radians(tendon.direction_deg - mesh.x_deg)
    heights = [starts[hole.body] + hole.place[2] for hole in tendon_holes(robot, number)]
    points = [_point(mesh, tendon.radius, side, height) for height in heights]
    for point in points[1:]:
        if not point.ties:
            raise InputError.UNSUPPORTED(
                f"tendon {number + 1} of {robot.name} meets no wall {point.place[2]:g} mm from the "
                "base: give the notch before an uncut_length"
            )
    first = 0 if robot.tube.base_length > 0.0 else 1
    return list(map(TendonSpan, pairwise(points), tension[first:].tolist()))


def _point(mesh: TubeMesh, radius: float, side: float, height: float) -> TendonPoint:
    """Return a point of a tendon, at rest where the layer has no wall on its side."""
    numbers = mesh.layer(int(np.argmin(np.abs(mesh.heights - height))))
    x, y = mesh.place[numbers - 1, :2].T
    nodes = (x + 1j * y) * np.exp(-1j * side)  # the tendon lies at a real number
    place = (radius * np.cos(side), radius * np.sin(side), float(height))
    nearest, away = int(np.argmin(np.abs(nodes - radius))), np.abs(np.angle(nodes))
    if abs(nodes[nearest] - radius) <= _NEAR * radius:
        return TendonPoint(place, ((int(numbers[nearest]), 1.0),))
    if away.min() > _NEAR:
        return TendonPoint(place, ())
    near = away < _PATCH
    # The smallest weights. Half a tube has the other half's nodes at -y, with the same weights.
    count = 2 if mesh.is_half else 3
    conditions = np.stack([np.ones(near.sum()), nodes[near].real, nodes[near].imag])
    weights = np.linalg.lstsq(conditions[:count], [1.0, radius, 0.0][:count])[0]
    return TendonPoint(place, tuple(zip(numbers[near].tolist(), weights.tolist(), strict=True)))


def deck(
    robot: Robot, mesh: TubeMesh, spans: Sequence[TendonSpan], options: DeckOptions, comment: str
) -> str:
    """Return the text of a deck that CalculiX runs as it is.

    Args:
        robot: The robot.
        mesh: The mesh of it, or of half of it.
        spans: The straight pieces of its tendons, with the whole tension.
        options: Mesh, contact and end moment.
        comment: What stands at the head.
    """
    # Points of tendons that are no nodes of the mesh have numbers behind those.
    first, is_half = len(mesh.place) + 1, mesh.is_half
    points = [point for span in spans for point in span.ends if len(point.ties) != 1]
    number = {point: first + count for count, point in enumerate(dict.fromkeys(points))}
    plate = first + len(number)  # and the next number
    sets, tendons = ["NALL"], ""
    if number:
        sets.append("NTENDON")
        tendons = f"*NODE,NSET=NTENDON\n{_rows([point.place for point in number], first)}"
    held = ["NCLAMP,1,3", *(["NPLANE,2,2"] if is_half else [])]
    held += [f"{node},1,3" for point, node in number.items() if not point.ties]
    held += [f"{node},2,2" for point, node in number.items() if point.ties and is_half]
    comments = (f"** {line}" for line in comment.splitlines())
    elements = np.column_stack([1 + np.arange(len(mesh.elements)), mesh.elements])
    # The tension of the springs grows with the temperature, from 0 to 1; nothing else does.
    text = f"""{_lines(comments)}
*NODE,NSET=NALL
{_rows(mesh.place, 1)}
{tendons}
*ELEMENT,TYPE=C3D20R,ELSET=TUBE
{_lines(_in_lines(row, 11) for row in elements.tolist())}
{_sets(mesh, options)}
*MATERIAL,NAME=TUBE
{material_cards(robot.material)}
*SOLID SECTION,ELSET=TUBE,MATERIAL=TUBE
{_springs(mesh, spans, number)}
{_hangers(number, (1, 3) if is_half else (1, 2, 3))}
{_tip_plate(mesh, plate) if options.tip_moment else ""}
{_contact(mesh, robot.material) if options.contact else ""}
*BOUNDARY
{_lines(held)}
*INITIAL CONDITIONS,TYPE=TEMPERATURE
{_lines(f"{name},0." for name in sets)}
*STEP,NLGEOM,INC=400
*STATIC
0.1,1.,1e-6,0.25
*TEMPERATURE
{_lines(f"{name},1." for name in sets)}
{_moment(robot, mesh, options, plate + 1) if options.tip_moment else ""}
*NODE FILE
U,RF
*EL FILE
S,E
*NODE PRINT,NSET=NCLAMP,TOTALS=ONLY
RF
*NODE PRINT,NSET=NRINGS
U
*END STEP
"""
    return _lines(filter(None, text.splitlines())) + "\n"


_lines = "\n".join


def _rows(rows: Iterable[Any], first: int | None = None) -> str:
    """Return rows of numbers, each behind its own number from the first one on."""
    texts = (",".join(f"{value:.10g}" for value in row) for row in rows)
    if first is None:
        return _lines(texts)
    return _lines(f"{number},{text}" for number, text in enumerate(texts, start=first))


def _in_lines(items: Iterable[Any], count: int, end: str = ",\n") -> str:
    """Return items with commas between, so many in a line."""
    texts = list(map(str, items))
    rows = (texts[start : start + count] for start in range(0, len(texts), count))
    return end.join(map(",".join, rows))


def _moment(robot: Robot, mesh: TubeMesh, options: DeckOptions, node: int) -> str:
    side = np.radians(robot.notches[0].direction_deg - mesh.x_deg)
    moment = mesh.share * options.tip_moment * np.array([-np.sin(side), np.cos(side)])
    lines = (f"{node},{axis},{size:.10g}" for axis, size in enumerate(moment, 1) if size)
    return f"*CLOAD\n{_lines(lines)}"


def _hangers(number: Mapping[TendonPoint, int], axes: Sequence[int]) -> str:
    """Hang the points of tendons on the nodes of the wall."""
    lines, end = list[str](), "\n"
    for point, node in number.items():
        terms = [(node, -1.0), *point.ties]
        for axis in axes if point.ties else ():
            items = (f"{tied},{axis},{weight:.12g}" for tied, weight in terms)
            lines.append(f"*EQUATION\n{len(terms)}\n{_in_lines(items, 4, end)}")
    return _lines(lines)


def _sets(mesh: TubeMesh, options: DeckOptions) -> str:
    sets: dict[str, Any] = {"NCLAMP": mesh.layer(0)}
    tip = {"NTIP": mesh.layer(-1)} if options.tip_moment else {}
    if mesh.is_half:
        # The plate at the tip holds its own nodes.
        held = np.concatenate([sets["NCLAMP"], *tip.values()])
        sets["NPLANE"] = np.setdiff1d(mesh.in_plane(), held)
    rings = {f"NRING{k}": mesh.layer(layer) for k, layer in enumerate(ring_layers(mesh))}
    return _lines(
        f"*NSET,NSET={name}\n{_in_lines(nodes, 1 if name == 'NRINGS' else _PER_LINE)},"
        for name, nodes in (sets | rings | {"NRINGS": rings} | tip).items()
    )


def ring_layers(mesh: TubeMesh) -> list[int]:
    """Return the layers in the middle of the uncut lengths, base first, by their index along z.

    The base is layer 0 where it has no length.
    """
    edges = mesh.heights[[0, *mesh.faces.ravel().tolist(), -1]]
    middle = 0.5 * (edges[::2] + edges[1::2])
    return [int(np.argmin(np.abs(mesh.heights - height))) for height in middle]


def _springs(mesh: TubeMesh, spans: Sequence[TendonSpan], extra: Mapping[TendonPoint, int]) -> str:
    """Springs of constant force: their tension follows the line between their moving ends."""
    lines: list[str] = []
    for number, span in enumerate(spans, start=1):
        first, last = (extra[end] if end in extra else end.ties[0][0] for end in span.ends)
        force = f"{mesh.share * span.tension:.10g}"
        lines.append(f"""*ELEMENT,TYPE=SPRINGA,ELSET=SPAN{number}
{len(mesh.elements) + number},{first},{last}
*SPRING,ELSET=SPAN{number},NONLINEAR
0.,-100,0.
0.,100,0.
{force},-100,1.
{force},100,1.""")
    return _lines(lines)


def _tip_plate(mesh: TubeMesh, node: int) -> str:
    """A rigid plate on the end of the tube; on half a tube it turns about y alone."""
    place = f"0.,0.,{mesh.heights[-1]:.10g}"
    held = f"*BOUNDARY\n{node},2,2\n{node + 1},1,1\n{node + 1},3,3"
    return f"""*NODE
{node},{place}
{node + 1},{place}
*RIGID BODY,NSET=NTIP,REF NODE={node},ROT NODE={node + 1}
{held if mesh.is_half else ""}"""


def _contact(mesh: TubeMesh, material: Any) -> str:
    """Both faces of every notch, over the outer half of the opening, where they meet."""
    surfaces, pairs = list[str](), list[str]()
    for notch, lips in enumerate(mesh.lips, start=1):
        if all(map(len, lips)):
            pairs.append(f"""*CONTACT PAIR,INTERACTION=FACES,TYPE=SURFACE TO SURFACE
LOWER{notch},UPPER{notch}""")
            for name, elements, face in zip(("LOWER", "UPPER"), lips, ("S2", "S1"), strict=True):
                faces = _lines(f"{element},{face}" for element in elements)
                surfaces.append(f"*SURFACE,NAME={name}{notch},TYPE=ELEMENT\n{faces}")
    behaviour = f"""*SURFACE INTERACTION,NAME=FACES
*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR
{_CONTACT * material.elastic_modulus:.10g}"""
    return _lines([*surfaces, behaviour, *pairs]) if pairs else ""


_NO_LOAD = "a deck of finite elements needs a load: give a tension above 0 N"
_WHICH = {
    True: "mm, N, MPa. Half of the tube: x toward the notches, y across, z along; y = 0 is a plane "
    "of symmetry, z = 0 is held. Forces in this file are half of those of the tube.",
    False: "mm, N, MPa. The whole tube: x toward direction 0, y toward 90 deg, z along; z = 0 is "
    "held.",
}


def deck_document(subject: Subject, options: DeckOptions) -> Document:
    """Make a deck of a robot under the tensions of its tendons; without any under a usual one.

    Raises:
        InputError: Nothing is loaded and no notch closes, or the robot is of another form than the
            mesh can have.
    """
    robot, path, step = subject.robot, subject.path, subject.step
    check_one_tube(robot)
    warnings = _warnings(robot)
    tension = np.zeros((0, 1))
    if path is None and not options.tip_moment:
        path, step = _usual_pull(robot), -1
        warnings.append(
            f"No tension was given: the deck has {path.tension[step, 0]:.4g} N at tendon 1, half "
            "of the tension that closes the first notch."
        )
    if path is not None:
        if path.load.external and path.load.external[step] != ExternalLoad():
            raise InputError.UNSUPPORTED(
                "a deck carries the tensions of tendons and an end moment: leave forces, masses "
                "and gravity out of the load"
            )
        tension = np.asarray(path.span_tension[step])
    pulled = np.flatnonzero(tension[:, 0] > 0.0).tolist()
    mesh = mesh_of(robot, options, pulled)
    spans = [
        span for tendon in pulled for span in tendon_spans(robot, mesh, tendon, tension[tendon])
    ]
    loads = [f"tendon {tendon + 1} at {tension[tendon, 0]:.6g} N" for tendon in pulled]
    if options.tip_moment:
        loads.append(f"a moment of {options.tip_moment:.6g} N mm on a rigid plate at the end")
    if not loads:
        raise InputError.MISSING_VALUE(_NO_LOAD)
    head = [
        f"{robot.name}, by notchflex {__version__} from the robot {robot_digest(robot)}.",
        _WHICH[mesh.is_half],
        f"Load: {', '.join(loads)}.",
        "Tendons are springs of constant force between the edges that they touch; the force falls "
        "from edge to edge by the friction that the chain has at this load.",
        "Run it with: ccx, followed by the name of this file without .inp.",
        "Sets NRING0, NRING1, ...: sections in the middle of the uncut lengths. The .dat file has "
        "their displacements, and the force that holds the tube.",
        *warnings,
    ]
    facts = {"nodes": len(mesh.place), "elements": len(mesh.elements)}
    return Document(deck(robot, mesh, spans, options, "\n".join(head)), tuple(warnings), facts)


def _usual_pull(robot: Robot) -> EquilibriumPath:
    """Pull the first tendon to half of the tension that closes the first notch.

    Raises:
        InputError: No notch closes, or there is no such state.
    """
    tension = closing(robot).tension
    if not np.isfinite(tension).any():
        raise InputError.MISSING_VALUE(_NO_LOAD)
    path = simulate(robot, pull(0.0, 0.5 * float(np.nanmin(tension)), _STEPS))
    if not path.converged[-1]:
        raise InputError.NOT_CONVERGED(f"the deck has no load to carry: {path.reason[-1]}")
    return path


def _warnings(robot: Robot) -> list[str]:
    warnings: list[str] = []
    if not isinstance(robot.material, Linear):
        warnings.append(
            "The deck has the material as plastic with hardening: it is right while the tube is "
            "loaded, not when it unloads."
        )
    if any(isinstance(notch, ArcNotch) and notch.ends == "rigid" for notch in robot.notches):
        warnings.append(
            "The chain of this robot has rigid ends beside its notches, and finite elements have "
            'not: set notch.ends = "shell" to compare the two.'
        )
    warnings += [
        f"The elastic ends of the chain: {sentence}" for sentence in unchecked_dimensions(robot)
    ]
    if any(tendon.path == "wall-arc" for tendon in robot.tendon):
        warnings.append(
            "The tendon of the deck runs straight from edge to edge of a notch, not along the arc "
            "of the wall."
        )
    return warnings
