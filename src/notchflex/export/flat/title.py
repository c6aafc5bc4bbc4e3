"""The title block: what the shop must know about a pattern."""

from __future__ import annotations

from notchflex import __version__
from notchflex.export.flat.pattern import FlatPattern
from notchflex.results.same_robot import robot_digest
from notchflex.robot import Robot


def plain_name(robot: Robot) -> str:
    """Return the name of a robot in one line, without characters that no file takes."""
    words = "".join(letter if letter.isprintable() else " " for letter in robot.name)
    return " ".join(words.split()) or "robot"


def title_lines(pattern: FlatPattern) -> list[str]:
    """Return the lines of the title block, in plain ASCII where the robot's name is."""
    robot, options = pattern.robot, pattern.options
    tube, material = robot.tube, robot.material
    lines = [
        plain_name(robot),
        f"tube: outer diameter {tube.outer_diameter:.6g} mm, inner diameter "
        f"{tube.inner_diameter:.6g} mm; material of the model: {material.kind}",
        _kerf_line(pattern),
        *_wall_lines(pattern),
        f"cut in the order of the numbers: 1 at the tip to {len(pattern.cuts)} at the base; "
        f"CUT_OFF last, at x = {-options.shank:.6g} mm",
        f"x: along the axis [mm], 0 at the base of the robot, tube end at {pattern.end:.6g} mm",
        _y_line(pattern),
        _seam_line(pattern),
    ]
    if options.corner_radius:
        lines.append(f"radius of the corners of the cuts: {options.corner_radius:.6g} mm")
    if any(notch.precurvature_deg for notch in robot.notches):
        lines.append("precurvature is not in this pattern: it is of the straight tube")
    lines.append(f"notchflex {__version__}, robot {robot_digest(robot)}")
    return lines


def _kerf_line(pattern: FlatPattern) -> str:
    kerf, polishing = pattern.options.kerf, pattern.options.polishing
    if not pattern.options.inside:
        return "KERF: NOT COMPENSATED - nominal edges of the cuts; compensate on the machine"
    parts = []
    if kerf:
        parts.append(f"{0.5 * kerf:.6g} mm for half the kerf of {kerf:.6g} mm")
    if polishing:
        parts.append(f"{polishing:.6g} mm for electropolishing")
    state = "COMPENSATED" if kerf else "NOT COMPENSATED"
    return f"KERF: {state} - the path runs inside the edges by {' and '.join(parts)}"


def _wall_lines(pattern: FlatPattern) -> list[str]:
    """Say which cuts have radial walls, and which need an axis beside the tube axis."""
    radial = [one.number for one in pattern.cuts if one.placed.cut.radial]
    offset = [one.number for one in pattern.cuts if not one.placed.cut.radial]
    lines = []
    if radial:
        lines.append(f"cuts {_ranges(radial)}: ON-AXIS, radial walls; a two-axis machine cuts them")
    if offset:
        lines.append(
            f"cuts {_ranges(offset)}: OFF-AXIS, walls straight across the tube; outer edges are "
            "drawn, a two-axis machine cannot cut them"
        )
    return lines


def _y_line(pattern: FlatPattern) -> str:
    if pattern.options.y_unit == "deg":
        what = "angle round the tube [deg]"
    else:
        what = f"outer radius {pattern.robot.tube.outer_radius:.6g} mm x angle [mm]"
    return f"y: {what}, 0 at direction 0, positive counter-clockwise as seen from the tip"


def _seam_line(pattern: FlatPattern) -> str:
    options = pattern.options
    how = "outlines that cross it run past it"
    if options.seam == "split":
        how = "outlines that cross it are split; their edges on the seam lie in the waste"
    return f"seam at {options.seam_deg:.6g} deg: {how}"


def _ranges(numbers: list[int]) -> str:
    """Return numbers in order as text.

    Example:
        >>> _ranges([1, 2, 3, 7])
        '1-3, 7'
    """
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(str(p[0]) if len(p) == 1 else f"{p[0]}-{p[-1]}" for p in parts)
