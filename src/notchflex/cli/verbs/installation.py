"""Verbs about the installation: `doctor`, `bench` and `completion`."""

from __future__ import annotations

import contextlib
import platform
import re
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from notchflex import InputError, __version__
from notchflex.cli import tables, terminal
from notchflex.cli.options import Outputs
from notchflex.cli.terminal import DONE
from notchflex.support import install_command, write_document

_REQUIREMENT = re.compile(r"^([\w.-]+)(?:.*extra\s*==\s*[\"']([\w-]+))?")
"""Name of a package, and the extra that asks for it."""

WRONG_SUMS = 1
"""Exit code where JAX computes wrong numbers."""

_WITH = {"jax": ("jax", "jaxlib")}
"""Packages that are shown with what they bring."""

DEVELOPMENT = ("test", "dev", "docs", "all")
"""Extras for developers, or of all others together."""

_BACKENDS = {
    "native": "native: lanewise and LLVM {llvm} compile for {processor}",
    "xla": "xla: NOTCHFLEX_BACKEND asks for it; programs are some ten times slower",
}


def doctor(
    *,
    clear_cache: Annotated[bool, Parameter(negative="--no-clear-cache")] = False,
    outputs: Outputs = Outputs(),
) -> int:
    """Check the installation: versions, the device of JAX, extras, the kept programs.

    JAX 0.10.2 and 0.11.0 compute wrong sums on the processor; one such sum is computed and
    compared. The exit code is 1 where it is wrong: no number of this program can be trusted then.

    Args:
        clear_cache: Remove the compiled programs kept on disk; they are compiled again when needed.
    """
    outputs.check()
    if clear_cache:
        from notchflex.solver.programs import store

        removed = store.clear()
        terminal.note(f"removed {removed.programs} programs, {removed.size / 1e6:.1f} MB")
    with terminal.progress("computing a known sum"):
        report = examination()
    outputs.write(report, dict[str, Any], _print)
    if report["healthy"]:
        return DONE
    canary = report["canary"]
    terminal.error(
        f"JAX {report['packages']['jax']} computes wrong numbers on this machine: a sum that is "
        f"{canary['expected']:.0f} came out as {canary['computed']:.0f}. Install another version: "
        "pip install 'jax!=0.10.2,!=0.11.0'"
    )
    return WRONG_SUMS


def examination() -> dict[str, Any]:
    """Return the findings of `doctor` as plain values."""
    from lanewise import target
    from notchflex._jax import jax
    from notchflex.solver.programs import store
    from notchflex.solver.programs.compiled import backend

    llvm, processor, _ = target().split(" ", 2)
    expected, computed = canary()
    folder, kept = store.program_folder(), store.usage()
    return {
        "program": "notchflex",
        "version": __version__,
        "healthy": expected == computed,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": platform.platform(),
        "packages": _versions(requirements()[""]),
        "device": {
            "kind": jax.default_backend(),
            "names": [str(device) for device in jax.devices()],
            "x64": bool(jax.config.jax_enable_x64),  # pyright: ignore[reportAttributeAccessIssue]
        },
        "backend": {"name": backend(), "llvm": llvm, "processor": processor},
        "canary": {"expected": expected, "computed": computed},
        "extras": _extras(),
        "compile_cache": {
            "folder": None if folder is None else str(folder),
            "programs": kept.programs,
            "bytes": kept.size,
            "most_bytes": store.MAX_BYTES,
            "shipped": len([*store.SHIPPED.glob("*.xz")]),
        },
    }


def requirements() -> dict[str, list[str]]:
    """Return the packages that each extra asks for; "" has what every installation needs."""
    report: dict[str, list[str]] = {}
    for line in metadata.requires("notchflex") or []:
        name, extra = _REQUIREMENT.findall(line)[0]
        if name != "notchflex":
            report.setdefault(extra, []).append(name)
    return report


def _versions(packages: Iterable[str]) -> dict[str, str | None]:
    """Version of each package, None where it is not installed; JAX's library too."""
    names = [name for package in packages for name in _WITH.get(package, (package,))]
    installed: dict[str, str | None] = dict.fromkeys(names)
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            installed[name] = metadata.version(name)
    return installed


def _extras() -> dict[str, Any]:
    return {
        extra: {
            "packages": (versions := _versions(packages)),
            "installed": None not in versions.values(),
            "install": install_command(extra),
        }
        for extra, packages in requirements().items()
        if extra and extra not in DEVELOPMENT
    }


def _print(report: dict[str, Any]) -> None:
    device, cache = report["device"], report["compile_cache"]
    sections = {
        f"notchflex {report['version']}": {
            "python": f"{report['python']}, {report['executable']}",
            "system": report["system"],
            **report["packages"],
        },
        "\nJAX": {
            "device": f"{device['kind']}: {', '.join(device['names'])}",
            "floats": "64 bits" if device["x64"] else "32 bits",
            "backend": _BACKENDS[report["backend"]["name"]].format(**report["backend"]),
            "known sum": "right" if report["healthy"] else "WRONG",
            "programs": f"{cache['programs']} compiled, {cache['bytes'] / 1e6:.1f} MB of at most "
            f"{cache['most_bytes'] / 1e6:.0f}, in {cache['folder'] or 'no folder: not kept'}",
            "shipped": f"{cache['shipped']} programs of typical calls; only a wheel carries them",
        },
        "\nExtras": {name: _extra_words(extra) for name, extra in report["extras"].items()},
    }
    for title, rows in sections.items():
        terminal.line(title, "bold")
        tables.show({"": [name.ljust(14) for name in rows], " ": rows.values()}, colour="cyan")


def _extra_words(extra: dict[str, Any]) -> str:
    missing = [name for name, version in extra["packages"].items() if version is None]
    if missing:
        return f"{', '.join(missing)} missing: {extra['install']}"
    return ", ".join(f"{name} {version}" for name, version in extra["packages"].items())


def canary() -> tuple[float, float]:
    """Return what a sum should be, and what JAX makes of it in the way in which it went wrong.

    jax-ml/jax#39103: compiled by JAX 0.10.2 and 0.11.0 for the processor, the last of many squared
    norms comes out too small.

    Example:
        >>> canary()
        (268435456.0, 268435456.0)
    """
    from notchflex._jax import jax, jnp

    last = 16_384.0
    rows = jnp.zeros((16_385, 3)).at[:, 0].set(jnp.arange(last + 1.0))
    squares = jax.jit(jax.vmap(lambda row: jnp.sum((jnp.eye(3) @ row) ** 2)))(rows)
    return last**2, float(squares[-1])


def bench(
    *,
    only: Annotated[str | None, Parameter(metavar="TEXT")] = None,
    outputs: Outputs = Outputs(),
) -> None:
    """Time the solver on this machine.

    Times are medians in multiples of LU135, one solution of 135 linear equations by NumPy on one
    core in the same run. All cases take some minutes, on a machine that should be otherwise idle.

    Args:
        only: Time only cases with this text in their name: `wrist`.
    """
    outputs.check()
    with terminal.progress("timing") as progress:
        from notchflex import bench as timing

        rows = timing.measured(only, lambda case: progress("timing", 0, 0, case))

    def show(document: dict[str, Any]) -> None:
        lines: list[dict[str, Any]] = []
        for row in document["rows"]:
            lines += [row, *([{"name": f"  {row['note']}"}] if row["note"] else [])]
        tables.show(lines, "name us lu135 target", {"us": ".4g"}, colour="cyan")
        terminal.line("")
        tables.show(document["peers"]["rows"], colour="cyan")
        terminal.show(f"Others: {timing.MEASURED}.")

    outputs.write(timing.bench_document(rows), dict[str, Any], show)


def completion(
    shell: Literal["bash", "zsh", "fish", "powershell"] | None = None, /, *, install: bool = False
) -> None:
    """Print the script that completes verbs and options in a shell, or install it.

    Args:
        shell: bash, zsh, fish or powershell; the current one if left out.
        install: Write the script to its folder for this user, and a line that loads it to the
            start-up file of the shell; prints the path.
    """
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
