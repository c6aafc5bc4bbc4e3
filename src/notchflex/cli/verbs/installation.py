"""Verbs about the installation: `doctor`, `bench` and `completion`."""

from __future__ import annotations

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
    outputs.write(lambda: report, lambda: _print(report))
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
    device, cache = report["device"], report["compile_cache"]
    kept = "compiled in every process, not kept"
    if cache["folder"]:
        kept = (
            f"{cache['programs']} compiled, {cache['bytes'] / 1e6:.1f} MB of at most "
            f"{cache['most_bytes'] / 1e6:.0f}, in {cache['folder']}"
        )
    versions = report["packages"].items()
    sections = {
        f"notchflex {report['version']}": {
            "python": f"{report['python']}, {report['executable']}",
            "system": report["system"],
            **{name: version or "not installed" for name, version in versions},
        },
        "\nJAX": {
            "device": f"{device['kind']}: {', '.join(device['names'])}",
            "floats": "64 bits" if device["x64"] else "32 bits",
            "backend": _BACKENDS[report["backend"]["name"]].format(**report["backend"]),
            "known sum": "right" if report["healthy"] else "WRONG",
            "programs": kept,
            "shipped": f"{cache['shipped']} programs of typical calls; only a wheel carries them",
        },
        "\nExtras": {name: _extra_words(extra) for name, extra in report["extras"].items()},
    }
    for title, rows in sections.items():
        terminal.output().print(title, style="bold")
        names = [name.ljust(14) for name in rows]
        tables.show([("", names, ""), ("", rows.values(), "")], gap=2, colour="cyan")


def _extra_words(extra: dict[str, Any]) -> str:
    versions = [f"{name} {version}" for name, version in extra["packages"].items() if version]
    missing = [name for name, version in extra["packages"].items() if not version]
    return f"{', '.join(missing)} missing: {extra['install']}" if missing else ", ".join(versions)


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

    def show() -> None:
        lines: list[dict[str, Any]] = []
        for row in rows:
            time = {"time": _time(row.us), "LU135": row.lu135, "target": row.target}
            lines.append({"what": row.name, **time})
            lines += [{"what": f"  {row.note}"}] if row.note else []
        peers = [
            {
                "others": name,
                "what": what,
                "time": " to ".join(_time(1e3 * end) for end in dict.fromkeys(ms)),
            }
            for name, what, ms in timing.PEERS
        ]
        for table in (lines, peers):
            tables.show(tables.records(table, time=">"), gap=2, colour="cyan")
            print()
        print(f"Others: {timing.MEASURED}.")

    outputs.write(lambda: timing.bench_document(rows), show)


def _time(us: float | None) -> str:
    if us is None:
        return ""
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if us >= size:
            return f"{us / size:.3g} {unit}"
    return f"{us:.3g} us"


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
