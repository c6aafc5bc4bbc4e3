"""What only the whole robot can tell: parts that do not fit each other."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from notchflex.robot.kinds import Notch, openings_along
from notchflex.robot.tendon import Tendon

if TYPE_CHECKING:
    from notchflex.robot.robot import Robot

MOST_NOTCHES = 10_000


def robot_problems(robot: "Robot") -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a robot: the name of a value, and a sentence about it."""
    number = robot.number_of_notches
    if number > MOST_NOTCHES:
        yield ("notch", f"makes {number} notches; at most {MOST_NOTCHES} are allowed.")
        return
    of_notches = list(_notch_problems(robot))
    yield from of_notches
    for i, tendon in enumerate(robot.tendon, start=1):
        if tendon.radius > robot.tube.outer_radius:
            yield (
                f"tendon[{i}].radius",
                f"is {tendon.radius} mm, outside the wall; it must be at most the outer "
                f"radius, {robot.tube.outer_radius} mm.",
            )
        if tendon.end_body is not None and tendon.end_body > number:
            yield (
                f"tendon[{i}].end_body",
                f"is {tendon.end_body}; the robot has the bodies 1 to {number}, one after each "
                "notch.",
            )
        elif not of_notches:
            for key, text in _tendon_problems(robot, tendon):
                yield (f"tendon[{i}].{key}", text)
    if robot.tolerance and not of_notches:
        from notchflex.robot.value_names import tolerance_problems  # it makes robots

        yield from tolerance_problems(robot)


def _notch_problems(robot: "Robot") -> Iterator[tuple[str, str]]:
    """Check notches in their tube, and beside their neighbours."""
    first = 1
    last: Notch | None = None  # the notch right before the table
    row: list[tuple[str, str]] = []  # what one notch lacks its neighbours often lack too
    for notch in robot.notch:
        for key, text in notch.problems(robot.tube):
            yield f"notch[{first}].{key}", text
        if last and not row:
            row = [(f"notch[{first}].{key}", text) for key, text in notch.row_problems(last)]
        first += notch.repeat
        last = notch.expanded()[-1]
    yield from row


def _tendon_problems(robot: "Robot", tendon: Tendon) -> Iterator[tuple[str, str]]:
    """Check a tendon against the notches that it crosses, and the body that it ends in."""
    end = tendon.end_body or robot.number_of_notches
    problems: dict[tuple[str, str], None] = {}  # equal notches say the same
    first = 1
    for notch in robot.notch:
        if first <= end:
            problems |= dict.fromkeys(notch.tendon_problems(tendon))
        first += notch.repeat
    yield from problems
    if problems or tendon.end_body is None:
        return
    bodies = [number for number, _ in openings_along(robot.notches, tendon.direction_deg)]
    if end not in bodies:
        near = [n for n in bodies if n < end][-1:] + [n for n in bodies if n > end][:1]
        yield (
            "end_body",
            f"is {end}, which has no wall on the tendon's side of the tube; the tendon runs "
            f"through the {'bodies' if len(near) > 1 else 'body'} "
            f"{' and '.join(map(str, near))} there.",
        )
