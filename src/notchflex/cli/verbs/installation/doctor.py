"""`notchflex doctor`: what this installation consists of, and whether it computes right."""

from __future__ import annotations

import platform
import re
import sys
from collections.abc import Iterable
from importlib import metadata
from typing import Annotated, Any

from cyclopts import Parameter

from notchflex import __version__
from notchflex.cli import terminal
from notchflex.cli.outputs import JsonFile, Outputs, Quiet
from notchflex.cli.terminal import DONE
from notchflex.support import install_command

WRONG_SUMS = 1
"""Exit code where JAX computes wrong numbers."""

DEVELOPMENT = ("test", "dev", "docs", "all")
"""Extras for developers, or of all others together."""

_BACKENDS = {
    "native": "native: lanewise and LLVM {llvm} compile for {processor}",
    "xla": "xla: NOTCHFLEX_BACKEND asks for it; programs are some ten times slower",
}


def doctor(
    *,
    clear_cache: Annotated[
        bool,
        Parameter(
            help="Remove the compiled programs kept on disk; they are compiled again when needed."
        ),
    ] = False,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> int:
    """Check the installation: versions, the device of JAX, extras, the kept programs.

    JAX 0.10.2 and 0.11.0 compute wrong sums on the processor; one such sum is computed and
    compared. The exit code is 1 where it is wrong: no number of this program can be trusted then.
    """
    outputs = Outputs(quiet=quiet, json=json)
    if clear_cache:
        from notchflex.solver.programs import store

        removed = store.clear()
        terminal.note(f"removed {removed.programs} programs, {removed.size / 1e6:.1f} MB")
    with terminal.working("computing a known sum"):
        report = examination()
    outputs.write_json(lambda: report)
    if outputs.prints_tables:
        _print(report)
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
    from notchflex.solver.programs import store

    terminal.use_compile_cache()
    from lanewise import target
    from notchflex._jax import jax
    from notchflex.cli.verbs.installation.canary import canary
    from notchflex.solver.programs.compiled import backend

    llvm, processor, _ = target().split(" ", 2)
    sum_of_squares = canary()
    folder, kept = store.program_folder(), store.usage()
    return {
        "program": "notchflex",
        "version": __version__,
        "healthy": sum_of_squares.sings,
        "python": platform.python_version(),
        "executable": sys.executable,
        "system": platform.platform(),
        "packages": _versions(requirements()[""]),
        "device": {
            "kind": jax.default_backend(),
            "names": [str(device) for device in jax.devices()],
            "x64": bool(jax.config.jax_enable_x64),  # pyright: ignore[reportAttributeAccessIssue]
        },
        "backend": {
            "name": backend(),
            "llvm": llvm,
            "processor": processor,
        },
        "canary": {"expected": sum_of_squares.expected, "computed": sum_of_squares.computed},
        "extras": _extras(),
        "compile_cache": {
            "folder": None if folder is None else str(folder),
            "programs": kept.programs,
            "bytes": kept.size,
            "most_bytes": store.MAX_BYTES,
            "shipped": store.count_shipped(),
        },
    }


def requirements(lines: Iterable[str] | None = None) -> dict[str, list[str]]:
    """Return the packages that each extra asks for; "" has what every installation needs.

    Example:
        >>> lines = ["numpy>=2", "h5py>=3; extra == 'data'", "notchflex[data]; extra == 'all'"]
        >>> requirements(lines)
        {'': ['numpy'], 'data': ['h5py'], 'all': []}
    """
    if lines is None:
        try:
            lines = metadata.requires("notchflex") or []
        except metadata.PackageNotFoundError:
            lines = []
    report: dict[str, list[str]] = {"": []}
    for line in lines:
        what, _, when = line.partition(";")
        name = re.match(r"[\w.-]+", what.strip())
        extra = re.search(r"extra\s*==\s*[\"']([\w-]+)[\"']", when)
        packages = report.setdefault(extra[1] if extra else "", [])
        if name and name[0] != "notchflex":
            packages.append(name[0])
    return report


def _versions(packages: Iterable[str]) -> dict[str, str | None]:
    """Version of each package, None where it is not installed; JAX's library too."""
    names = list(dict.fromkeys(packages))
    if "jax" in names:
        names.insert(names.index("jax") + 1, "jaxlib")
    return {name: _version(name) for name in names}


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _extras() -> dict[str, Any]:
    return {
        extra: {
            "packages": (versions := _versions(packages)),
            "installed": all(version is not None for version in versions.values()),
            "install": install_command(extra),
        }
        for extra, packages in requirements().items()
        if extra and extra not in DEVELOPMENT and packages
    }


def _print(report: dict[str, Any]) -> None:
    console = terminal.output()

    def section(title: str, rows: Iterable[tuple[str, str]]) -> None:
        console.print(title, style="bold")
        cells = [(name.ljust(14), words) for name, words in rows]
        console.print(terminal.table(["", ""], cells, gap=2, colour="cyan"))

    missing = "not installed"
    device = report["device"]
    backend, cache = report["backend"], report["compile_cache"]
    section(
        f"notchflex {report['version']}",
        [
            ("python", f"{report['python']}, {report['executable']}"),
            ("system", report["system"]),
            *((name, version or missing) for name, version in report["packages"].items()),
        ],
    )
    section(
        "\nJAX",
        [
            ("device", f"{device['kind']}: {', '.join(device['names'])}"),
            ("floats", "64 bits" if device["x64"] else "32 bits"),
            ("backend", _BACKENDS[backend["name"]].format(**backend)),
            ("known sum", "right" if report["healthy"] else "WRONG"),
            (
                "programs",
                f"{cache['programs']} compiled, {cache['bytes'] / 1e6:.1f} MB of at most "
                f"{cache['most_bytes'] / 1e6:.0f}, in {cache['folder']}",
            )
            if cache["folder"]
            else ("programs", "compiled in every process, not kept"),
            ("shipped", f"{cache['shipped']} programs of typical calls; only a wheel carries them"),
        ],
    )
    section("\nExtras", [(name, _extra_words(extra)) for name, extra in report["extras"].items()])


def _extra_words(extra: dict[str, Any]) -> str:
    versions = [f"{name} {version}" for name, version in extra["packages"].items() if version]
    gone = [name for name, version in extra["packages"].items() if not version]
    if not gone:
        return ", ".join(versions)
    return f"{', '.join(gone)} missing: {extra['install']}"
