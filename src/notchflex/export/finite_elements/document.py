"""The document of a deck of finite elements."""

from __future__ import annotations

import numpy as np

from notchflex import __version__
from notchflex.errors import InputError
from notchflex.export.document import FileDocument, Subject
from notchflex.export.finite_elements.deck import deck
from notchflex.export.finite_elements.meshes import mesh_of
from notchflex.export.finite_elements.options import DeckOptions
from notchflex.export.finite_elements.tendon_spans import TendonSpan, tendon_spans
from notchflex.loads.external import NOTHING
from notchflex.mechanics.chain import unchecked_dimensions
from notchflex.results import EquilibriumPath
from notchflex.results.same_robot import robot_digest
from notchflex.robot import ArcNotch, Linear

_WHICH = {
    True: "mm, N, MPa. Half of the tube: x toward the notches, y across, z along; y = 0 is a plane "
    "of symmetry, z = 0 is held. Forces in this file are half of those of the tube.",
    False: "mm, N, MPa. The whole tube: x toward direction 0, y toward 90 deg, z along; z = 0 is "
    "held.",
}


def deck_document(subject: Subject, options: DeckOptions) -> FileDocument:
    """Make a deck of a robot under the tensions of its tendons.

    Raises:
        InputError: Nothing is loaded, or the robot is of another form than the mesh can have.
    """
    robot = subject.robot
    pulled: list[int] = []
    tension = np.zeros((0, 1))
    if subject.path is not None:
        _check_state(subject.path, subject.step)
        tension = np.asarray(subject.path.span_tension[subject.step])
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
        raise InputError.MISSING_VALUE(
            "a deck of finite elements needs a load: give a tension above 0 N"
        )
    warnings = _warnings(subject)
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
    return FileDocument(deck(robot, mesh, spans, options, "\n".join(head)), warnings, facts)


def _check_state(path: EquilibriumPath, step: int) -> None:
    if not path.converged[step]:
        raise InputError.NOT_CONVERGED(f"the deck has no load to carry: {path.reason[step]}")
    if path.load.external and path.load.external[step] != NOTHING:
        raise InputError.UNSUPPORTED(
            "a deck carries the tensions of tendons and an end moment: leave forces, masses and "
            "gravity out of the load"
        )


def _warnings(subject: Subject) -> tuple[str, ...]:
    robot = subject.robot
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
    if subject.path is not None and any(tendon.path == "wall-arc" for tendon in robot.tendon):
        warnings.append(
            "The tendon of the deck runs straight from edge to edge of a notch, not along the arc "
            "of the wall."
        )
    return tuple(warnings)
