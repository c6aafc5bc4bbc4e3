"""Where results go: paths are checked before anything is computed; standard output.

Also what to do with a stream that can no longer be written: later text goes nowhere, so that the
rest of the work (files, warnings, the exit code) is done as if nobody had been listening.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO

from notchflex._imports import need
from notchflex._replacing import AnyPath, is_replaceable, replacing, unwritable
from notchflex.errors import InputError


def write_document(text: str) -> None:
    """Write a document (JSON, CSV) to standard output, as UTF-8 whatever the terminal takes.

    A reader that has gone (`notchflex schema | head`) is not a failure.

    Args:
        text: What to write.
    """
    stream = sys.stdout
    try:
        stream.flush()
        buffer = getattr(stream, "buffer", None)
        if buffer is None:  # a StringIO in its place
            stream.write(text)
        else:
            buffer.write(text.encode("utf-8", errors="replace"))
        stream.flush()
    except BrokenPipeError:
        let_go(stream)


def let_go(stream: TextIO) -> None:
    """Send what a stream still holds, and all that is written to it later, nowhere.

    Python would otherwise complain once more when it flushes the stream at exit.

    Args:
        stream: Standard output or standard error.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


STANDARD_OUTPUT = "-"
PAPER = (".png", ".svg", ".pdf")
BROWSER = (".html",)
MOVING = (".gif",)
_DRAWN_BY = {".html": ("matplotlib", "plotly"), ".gif": ("matplotlib", "PIL")}
"""What has to be installed for a kind of picture, where that is more than matplotlib."""


def check_output(target: str, option: str, *, inputs: Iterable[AnyPath] = ()) -> None:
    """Raise if a file cannot be written at `target`; nothing is created or changed.

    Args:
        target: A path, or `-` for standard output.
        option: The option that named it, for the message.
        inputs: Files that are read; an output must not replace one of them.

    Raises:
        InputError: The folder is missing, the path is a folder or read-only, or it is an input.
    """
    if target == STANDARD_OUTPUT:
        return
    if not target.strip():
        raise InputError.MISSING_VALUE(f"{option} needs the name of a file, and got an empty one.")
    if "\0" in target:
        raise InputError.FILE_UNWRITABLE(
            f"{option} {target!r} cannot be written: it holds a null character."
        )
    path = Path(target)
    with unwritable(f"{option} {target!r} cannot be written"):
        obstacle = _obstacle(path)
        for source in [] if obstacle else inputs:
            if Path(source).exists() and path.exists() and path.samefile(source):
                raise InputError.CONFLICT(
                    f"{option} {target}: this would replace the file that is read; choose another."
                )
    if obstacle:
        raise InputError.FILE_UNWRITABLE(f"{option} {target}: {obstacle}.")


def _obstacle(path: Path) -> str:
    """Say why a file cannot be written, "" if it can."""
    folder = path.parent
    if path.is_dir():
        return "this is a folder; give the name of a file to write in it"
    if not folder.exists():
        return f"the folder {folder} does not exist; make it first or choose another"
    if not folder.is_dir():
        return f"{folder} is a file, not a folder"
    if path.exists() and not os.access(path, os.W_OK):
        return "this file may not be written; choose another"
    if is_replaceable(path) and not _folder_takes_files(folder):
        return f"no file may be written in the folder {folder}; choose another"
    return ""


def check_folder(
    folder: str, names: Iterable[str], option: str, *, inputs: Iterable[AnyPath] = ()
) -> tuple[Path, ...]:
    """Raise if files cannot be written in a folder, which may be missing; nothing is changed.

    Args:
        folder: The folder; if it is missing, the one that it would be made in must be there.
        names: Names of the files.
        option: The option that named the folder, for the message.
        inputs: Files that are read; none of them may be replaced.

    Returns:
        The paths of the files.

    Raises:
        InputError: A file cannot be written there, has no name of a file, or is an input.
    """
    if not folder.strip():
        raise InputError.MISSING_VALUE(
            f"{option} needs the name of a folder, and got an empty one."
        )
    if folder == STANDARD_OUTPUT:
        raise InputError.FILE_FORMAT(
            f"{option} - : files cannot go to standard output; name a folder."
        )
    files: list[Path] = []
    for name in names:
        if Path(name).name != name or "\0" in name:
            raise InputError.FILE_UNWRITABLE(
                f"{option} {folder}: a file cannot be called {name!r}."
            )
        files.append(Path(folder) / name)
    exists, sources = "\0" not in folder and os.path.exists(folder), list(inputs)
    for target in files if exists else [folder]:
        check_output(str(target), option, inputs=sources)
    return tuple(files)


def check_picture(
    target: str,
    option: str,
    *,
    inputs: Iterable[AnyPath] = (),
    kinds: tuple[str, ...] = PAPER + BROWSER,
) -> None:
    """Raise if a picture cannot be written at `target`: as `check_output`, and its kind too.

    Args:
        target: A path.
        option: The option that named it, for the message.
        inputs: Files that are read; an output must not replace one of them.
        kinds: The suffixes that this picture may have.

    Raises:
        InputError: The suffix is none of them, or what draws the picture is not installed.
    """
    if target == STANDARD_OUTPUT:
        raise InputError.FILE_FORMAT(
            f"{option} - : a picture cannot go to standard output; name a file, "
            "for example wrist.png."
        )
    suffix = Path(target).suffix.lower()
    if suffix not in kinds:
        listed = f"{', '.join(kinds[:-1])} or {kinds[-1]}"
        raise InputError.FILE_FORMAT(
            f"{option} {target}: got {suffix_of(target)}; a picture is written as {listed}."
        )
    check_output(target, option, inputs=inputs)
    for module in _DRAWN_BY.get(suffix, ("matplotlib",)):
        need(module, "plot", option)


def suffix_of(file: AnyPath) -> str:
    """Return what suffix a file has, in words."""
    suffix = Path(file).suffix.lower()
    return f"the suffix {suffix}" if suffix else "no suffix"


def check_distinct(outputs: dict[str, str | None]) -> None:
    """Raise if two options name the same file, or both standard output.

    Args:
        outputs: Option to its target; None where the option was not given.

    Raises:
        InputError: Two targets are the same.
    """
    seen: dict[str, str] = {}
    for option, target in outputs.items():
        if target is None:
            continue
        # What holds a null character names no file: `check_output` tells that.
        plain = target == STANDARD_OUTPUT or "\0" in target
        name = target if plain else os.path.realpath(target)
        if name in seen:
            where = "standard output" if target == STANDARD_OUTPUT else target
            raise InputError.CONFLICT(
                f"{seen[name]} and {option} both write to {where}; give them different files."
            )
        seen[name] = option


def write_text(target: AnyPath, text: str) -> None:
    """Write UTF-8 text to a file, whole or not at all, or to standard output for `-`.

    Args:
        target: Path, or `-`.
        text: What to write.

    Raises:
        InputError: The file cannot be written.
    """
    if str(target) == STANDARD_OUTPUT:
        write_document(text)
        return
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="replace", newline="\n")


def _folder_takes_files(folder: Path) -> bool:
    """Say whether a file can be made in a folder, by making one without a name and dropping it."""
    # Asking for permissions is not enough: a read-only file system or a full quota grants them.
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
