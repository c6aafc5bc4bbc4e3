"""Fitted robots as robot files that say where each value comes from."""

from __future__ import annotations

import os
from collections.abc import Iterable
from math import isfinite
from pathlib import Path

from notchflex.errors import InputError
from notchflex.fit.assessment.diagnosis import with_unit
from notchflex.fit.documents import data_of
from notchflex.fit.estimation.calibration import Calibration
from notchflex.fit.model.constants import Unknown
from notchflex.fit.model.rows import SENSOR
from notchflex.results.files.writing import check_folder, write_text
from notchflex.robot import robot_text
from notchflex.robot.robot import source_of

# More files than that are not named, but counted.
_FILES = 3


def write_fitted(
    found: Calibration, folder: str | os.PathLike[str], *, inputs: Iterable[str | Path] = ()
) -> tuple[Path, ...]:
    """Write every fitted robot as a robot file, named after its label.

    Comments of the file that the robot was read from are kept. A comment beside each fitted value
    names the data and the 95 % interval. Constants of the measurement (`sensor.`) are not written.

    Args:
        found: The fit.
        folder: Folder of the files; made if it is missing. Files of the same names are replaced.
        inputs: Files that must not be replaced.

    Returns:
        The files.

    Raises:
        InputError: A file cannot be written, is one of `inputs`, or is the very file that the
            robot was read from.

    Example:
        >>> write_fitted(found, "fitted")  # doctest: +SKIP
        (PosixPath('fitted/my-wrist.toml'),)
    """
    names = [f"{label}.toml" for label in found.given]
    files = check_folder(str(folder), names, "the folder of fitted robots", inputs=inputs)
    targets = dict(zip(found.given, files, strict=True))
    for label, target in targets.items():
        if target.exists() and _text(target) == source_of(found.given[label]):
            raise InputError.CONFLICT(
                f"{target}: this would replace the file that {label} was read from; choose "
                "another folder."
            )
    try:
        Path(folder).mkdir(exist_ok=True)
    except OSError as problem:
        raise InputError.FILE_UNWRITABLE(
            f"the folder {folder} cannot be made: {problem.strerror}."
        ) from None
    for label, target in targets.items():
        robot = found.robots[label]
        notes = {
            one.path: _note(found, unknown)
            for unknown in found.problem.unknowns
            for one in unknown.sets
            if one.label == label and one.path not in SENSOR
        }
        write_text(target, robot_text(robot, source_of(robot), notes))
    return files


def _note(calibration: Calibration, unknown: Unknown) -> str:
    """The comment beside a fitted value: the data, and how far to trust it."""
    labels = dict.fromkeys(one.label for one in unknown.sets)
    files = [Path(one).name for label in labels for one in data_of(calibration, label)]
    files = list(dict.fromkeys(" ".join(one.split()) for one in files))
    if len(files) > _FILES:
        files = [*files[: _FILES - 1], f"{len(files) - _FILES + 1} more files"]
    trouble = "" if calibration.converged else "; the search did not settle"
    value = with_unit(calibration.values[unknown.name], unknown.unit)
    rule = "" if unknown.path == unknown.sets[0].path else f"`{unknown.path}` = {value}, "
    return f"{', '.join(files)}: {rule}{_trust(calibration, unknown)}{trouble}"


def _trust(calibration: Calibration, unknown: Unknown) -> str:
    interval, unit = calibration.intervals.get(unknown.name), unknown.unit
    if interval is None:
        size = calibration.deviations[unknown.name]
        return f"standard deviation {size:.2g} {unit}".strip() if isfinite(size) else "no interval"
    low, high = interval.lower, interval.upper
    if calibration.tells_no_noise:
        return f"no interval: {interval.reason}"
    if low is None and high is None:
        return "any value fits"
    if low is not None and high is not None:
        ends = f"{low:.5g} to {high:.5g}"
    else:
        ends = f"at most {high:.5g}" if low is None else f"at least {low:.5g}"
    number = calibration.names.index(unknown.name)
    pulls = int(calibration.by_pulls.pulls[number])
    by_pulls = f", by {pulls} whole pulls" if calibration.by_pulls.wider[number] > 1.0 else ""
    return f"{ends} {unit}".strip() + f" (95 %{by_pulls})"


def _text(target: Path) -> str | None:
    try:
        return target.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        return None
