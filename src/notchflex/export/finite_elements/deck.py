"""The deck for CalculiX: mesh, material, tendons, contact, load. mm, N, MPa."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

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
from notchflex.export.cuts import tendon_holes
from notchflex.export.finite_elements.meshes import TubeMesh, check_shape, mesh_of
from notchflex.export.formats import DeckOptions, Document, Subject
from notchflex.loads.load import NOTHING
from notchflex.support import Material, robot_digest, unchecked_dimensions

_MAX_STRAIN = 0.2  # strain up to which a curve is continued


def material_cards(material: Material) -> list[str]:
    """Return the cards of a material.

    A material with a plateau is given as plastic with hardening: right while it is loaded, not when
    it unloads. True stress is taken over logarithmic strain.

    Raises:
        InputError: The kind has no cards.
    """
    supported = with_cards(material)
    modulus = supported.elastic_modulus
    elastic = ["*ELASTIC", f"{modulus:.10g},{supported.poisson_ratio:.10g}"]
    if isinstance(supported, Linear):
        return elastic
    points = _curve(supported, modulus)
    lines = [f"{stress:.10g},{strain - stress / modulus:.10g}" for strain, stress in points]
    return [*elastic, "*PLASTIC", *lines]


def with_cards(material: Material) -> Linear | Superelastic | Nitinol | StressStrain:
    """Return a material of a kind that has cards.

    Raises:
        InputError: The kind has none.
    """
    if isinstance(material, (Linear, Superelastic, Nitinol, StressStrain)):
        return material
    raise InputError.UNSUPPORTED(
        f"a material of kind {material.kind!r} has no cards for CalculiX; use a linear, "
        "superelastic, nitinol or stress-strain one"
    )


def _curve(
    material: Superelastic | Nitinol | StressStrain, modulus: float
) -> list[tuple[float, float]]:
    """Strains and stresses (MPa) from the end of the elastic line on."""
    if isinstance(material, Superelastic):
        first, slope = material.transition_strain, material.superelastic_modulus
        return [
            (e, modulus * first + slope * (e - first)) for e in (first, max(_MAX_STRAIN, 2 * first))
        ]
    if isinstance(material, Nitinol):
        first, slope = material.plateau_stress / modulus, material.plateau_modulus
        return [
            (e, modulus * first + slope * (e - first)) for e in (first, max(_MAX_STRAIN, 2 * first))
        ]
    return list(zip(*material.in_tension, strict=True))


# A node is the tendon's point if it is so near, as a part of the tendon's radius.
_NEAR = 0.01
# A tendon off the nodes hangs on those of the wall that lie within this angle of its side.
_PATCH = np.radians(45.0)


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


def tendon_spans(
    robot: Robot, mesh: TubeMesh, tendon: int, tension: Float[np.ndarray, " spans"]
) -> list[TendonSpan]:
    """Return the pieces of a tendon.

    Args:
        robot: The robot.
        mesh: The mesh, with a line at the tendon.
        tendon: Which tendon, from 0.
        tension: Tension of its spans as `span_tension` has them: proximal, gap 1, body 1, ...

    Raises:
        InputError: The tendon meets no wall.
    """
    one = robot.tendon[tendon]
    side = np.radians(one.direction_deg - mesh.x_deg)
    check_shape(robot)
    starts = robot.geometry.body_start
    holes = [starts[hole.body] + hole.place[2] for hole in tendon_holes(robot, tendon)]
    points = [_point(mesh, one.radius, side, height) for height in holes]
    for point in points[1:]:
        if not point.ties:
            raise InputError.UNSUPPORTED(
                f"tendon {tendon + 1} of {robot.name} meets no wall {point.place[2]:g} mm from the "
                "base: give the notch before an uncut_length"
            )
    own = tension if robot.tube.base_length > 0.0 else tension[1:]
    return [
        TendonSpan(ends, force) for ends, force in zip(pairwise(points), own.tolist(), strict=False)
    ]


def _point(mesh: TubeMesh, radius: float, side: float, height: float) -> TendonPoint:
    """Return a point of a tendon, at rest where the layer has no wall on its side."""
    numbers = mesh.layer(int(np.argmin(np.abs(mesh.heights - height))))
    x, y = mesh.place[numbers - 1, :2].T
    nodes = (x + 1j * y) * np.exp(-1j * side)  # the tendon lies at a real number
    place = (radius * np.cos(side), radius * np.sin(side), float(height))
    nearest = int(np.argmin(np.abs(nodes - radius)))
    if abs(nodes[nearest] - radius) <= _NEAR * radius:
        return TendonPoint(place, ((int(numbers[nearest]), 1.0),))
    away = np.abs(np.angle(nodes))
    if away.min() > _NEAR:
        return TendonPoint(place, ())
    near = away < _PATCH
    # The smallest weights. Half a tube has the other half's nodes at -y, with the same weights.
    conditions = np.stack([np.ones(near.sum()), nodes[near].real, nodes[near].imag])
    wanted = np.array([1.0, radius, 0.0])
    if mesh.is_half:
        conditions, wanted = conditions[:2], wanted[:2]
    weights = np.linalg.lstsq(conditions, wanted)[0]
    return TendonPoint(place, tuple(zip(numbers[near].tolist(), weights.tolist(), strict=True)))


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
    # Points of tendons that are no nodes of the mesh have numbers behind those.
    extra = [one for span in spans for one in span.ends if len(one.ties) != 1]
    first = len(mesh.place) + 1
    number = {one: first + count for count, one in enumerate(dict.fromkeys(extra))}
    tip = _tip_plate(mesh, first + len(number)) if options.tip_moment else None
    lines = [f"** {line}" for line in comment.splitlines()]
    lines += ["*NODE,NSET=NALL", *_nodes(mesh.place, 1)]
    if extra:
        lines += ["*NODE,NSET=NTENDON", *_nodes(np.array([one.place for one in number]), first)]
    lines += ["*ELEMENT,TYPE=C3D20R,ELSET=TUBE"]
    for element, row in enumerate(mesh.elements.tolist(), start=1):
        text = [element, *row]
        lines += [",".join(map(str, text[:11])) + ",", ",".join(map(str, text[11:]))]
    lines += _sets(mesh, tip is not None)
    lines += ["*MATERIAL,NAME=TUBE", *material_cards(robot.material)]
    lines += ["*SOLID SECTION,ELSET=TUBE,MATERIAL=TUBE"]
    lines += _springs(mesh, spans, number)
    for point, node in number.items():  # hang it on the nodes of the wall
        terms = [(node, -1.0), *point.ties]
        for axis in ((1, 3) if mesh.is_half else (1, 2, 3)) if point.ties else ():
            lines += ["*EQUATION", str(len(terms))]
            texts = [f"{tied},{axis},{weight:.12g}" for tied, weight in terms]
            lines += [",".join(texts[start : start + 4]) for start in range(0, len(texts), 4)]
    if tip:
        lines += tip
    if options.contact:
        lines += list(_contact(mesh, robot))
    lines += ["*BOUNDARY", "NCLAMP,1,3"] + (["NPLANE,2,2"] if mesh.is_half else [])
    lines += [f"{node},1,3" for point, node in number.items() if not point.ties]
    lines += [f"{node},2,2" for point, node in number.items() if point.ties and mesh.is_half]
    lines += ["*INITIAL CONDITIONS,TYPE=TEMPERATURE", "NALL,0."]
    lines += ["NTENDON,0."] if extra else []
    lines += ["*STEP,NLGEOM,INC=400", "*STATIC", "0.1,1.,1e-6,0.25"]
    # The tension of the springs grows with the temperature, from 0 to 1; nothing else does.
    lines += ["*TEMPERATURE", "NALL,1."] + (["NTENDON,1."] if extra else [])
    if tip:
        first += len(number)
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


def _springs(
    mesh: TubeMesh, spans: list[TendonSpan], extra: Mapping[TendonPoint, int]
) -> list[str]:
    """Springs of constant force: their tension follows the line between their moving ends."""
    lines: list[str] = []
    for number, span in enumerate(spans, start=1):
        ends = [extra[one] if one in extra else one.ties[0][0] for one in span.ends]
        force = mesh.share * span.tension
        name = f"SPAN{number}"
        lines += [f"*ELEMENT,TYPE=SPRINGA,ELSET={name}"]
        lines += [f"{len(mesh.elements) + number},{ends[0]},{ends[1]}"]
        lines += [f"*SPRING,ELSET={name},NONLINEAR"]
        lines += [f"0.,{x:g},0." for x in (-100.0, 100.0)]
        lines += [f"{force:.10g},{x:g},1." for x in (-100.0, 100.0)]
    return lines


def _tip_plate(mesh: TubeMesh, first: int) -> list[str]:
    """A rigid plate on the end of the tube; on half a tube it turns about y alone."""
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


_STEPS = 9
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
    warnings = _warnings(robot)
    pulled: list[int] = []
    tension = np.zeros((0, 1))
    if path is None and not options.tip_moment:
        path = _usual_pull(robot)
        step = len(path) - 1
        warnings.append(
            f"No tension was given: the deck has {path.tension[step, 0]:.4g} N at tendon 1, half "
            "of the tension that closes the first notch."
        )
    if path is not None:
        _check_state(path, step)
        tension = np.asarray(path.span_tension[step])
        pulled = np.flatnonzero(tension[:, 0] > 0.0).tolist()
    mesh = mesh_of(robot, options, pulled)
    spans: list[TendonSpan] = []
    loads: list[str] = []
    for tendon in pulled:
        own = tension[tendon]
        spans += tendon_spans(robot, mesh, tendon, own)
        loads.append(f"tendon {tendon + 1} at {own[0]:.6g} N")
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
    text = deck(robot, mesh, spans, options, "\n".join(head))
    return Document(text, tuple(warnings), facts)


def _usual_pull(robot: Robot) -> EquilibriumPath:
    """Pull the first tendon to half of the tension that closes the first notch.

    Raises:
        InputError: No notch closes.
    """
    tension = closing(robot).tension
    if not np.isfinite(tension).any():
        raise InputError.MISSING_VALUE(_NO_LOAD)
    return simulate(robot, pull(0.0, 0.5 * float(np.nanmin(tension)), _STEPS))


def _check_state(path: EquilibriumPath, step: int) -> None:
    if not path.converged[step]:
        raise InputError.NOT_CONVERGED(f"the deck has no load to carry: {path.reason[step]}")
    if path.load.external and path.load.external[step] != NOTHING:
        raise InputError.UNSUPPORTED(
            "a deck carries the tensions of tendons and an end moment: leave forces, masses and "
            "gravity out of the load"
        )


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
    warnings += [f"The elastic ends of the chain: {one}" for one in unchecked_dimensions(robot)]
    if any(tendon.path == "wall-arc" for tendon in robot.tendon):
        warnings.append(
            "The tendon of the deck runs straight from edge to edge of a notch, not along the arc "
            "of the wall."
        )
    return warnings
