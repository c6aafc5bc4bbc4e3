"""`notchflex completion`: verbs and options completed by the shell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import flag
from notchflex.support import write_document

Shell = Literal["bash", "zsh", "fish", "powershell"]


def completion(
    shell: Annotated[
        Shell | None,
        Parameter(help="bash, zsh, fish or powershell; the current one if left out."),
    ] = None,
    /,
    *,
    install: Annotated[
        bool,
        flag(
            "Write the script to its folder for this user, and a line that loads it to the "
            "start-up file of the shell; prints the path."
        ),
    ] = False,
) -> None:
    """Print the script that completes verbs and options in a shell, or install it."""
    from cyclopts.completion.detect import ShellDetectionError

    from notchflex.cli.app import build

    app = build()
    try:
        if not install:
            write_document(_with_files(app.generate_completion(shell=shell)))
            return
        written: Path = app.install_completion(shell=shell)
        written.write_text(_with_files(written.read_text(encoding="utf-8")), encoding="utf-8")
    except ShellDetectionError:
        raise InputError.MISSING_VALUE(
            "the current shell is not known; name it: notchflex completion bash (or zsh, fish, "
            "powershell)."
        ) from None
    except OSError as problem:
        raise InputError.FILE_UNWRITABLE(
            f"the script cannot be written: {problem.filename}: {problem.strerror}."
        ) from None
    terminal.output().print(
        f"Written: {written}. It works in every shell that is started from now on.", soft_wrap=True
    )


def _with_files(script: str) -> str:
    """Let bash propose files where nothing else fits: robots and data are files too."""
    return script.replace("complete -F _notchflex", "complete -o default -F _notchflex")
