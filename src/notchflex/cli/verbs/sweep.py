"""`notchflex sweep`: many robots from a plan file, in pieces, resumed where it was stopped."""

from __future__ import annotations

import shlex
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import OUTPUT, Folder, Outputs, Work, converted
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import check_picture, parse_whole

if TYPE_CHECKING:
    from rich.table import Table

    from notchflex.sweeping import Estimate, Sweep

_PART = "two whole numbers, such as 7/100 for the seventh of a hundred parts"

_QUANTILES = (
    [0.0, 0.025, 0.25, 0.5, 0.75, 0.975, 1.0],
    [0.0, 0.025, 0.5, 0.975, 1.0],
    [0.0, 0.5, 1.0],
    [0.0, 1.0],
)
"""What a table shows where the quantiles of the plan are many, or do not fit."""


def _part(text: str) -> tuple[int, int]:
    first, slash, count = text.partition("/")
    if not slash:
        raise InputError.BAD_SYNTAX(f"give {_PART}.")
    read = parse_whole(1)
    numbers = read(first.strip()), read(count.strip())
    if not numbers[0] <= numbers[1] <= 10**9:
        raise InputError.OUT_OF_RANGE(f"there is no part {text}; give {_PART}.")
    return numbers


def _axes(text: str) -> tuple[str, str]:
    names = [word.strip() for word in text.split(",")]
    if len(names) != 2 or not all(names):
        raise InputError.BAD_SYNTAX("give the names of two columns, X,Y.")
    return names[0], names[1]


def sweep(
    plan: Annotated[str, Parameter(metavar="PLAN.toml|DIR")],
    /,
    *,
    output: Annotated[Folder, Parameter(metavar="DIR")] = None,
    dry_run: bool = False,
    work: Work = Work(),
    part: Annotated[tuple[int, int] | None, converted(_part, "K/N")] = None,
    plot: Annotated[
        tuple[str, str] | None, converted(_axes, "X,Y"), Parameter(group=OUTPUT)
    ] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Solve many robots that differ by a few numbers, and keep the results as files.

    A sweep that was stopped goes on where it was: give the same call again. What the files hold
    does not depend on who works on them. Prints counts and quantiles of every kept quantity.

    Args:
        plan: Plan file (`notchflex new NAME --sweep` writes one); or the folder of a sweep, to look
            at it.
        output: Folder of the sweep: sweep.json, pieces/*.parquet and at the end summary.json. With
            `--plot`, the file of the picture.
        dry_run: Solve some rows, tell how long the sweep takes and how large it is, and end.
        part: Only this part of the pieces: for array jobs without a scheduler.
        plot: Draw one column of a sweep over another, to the file that `-o` names.
    """
    if not plan.strip():
        raise InputError.MISSING_VALUE("a plan file is needed, and got an empty name.")
    if "\0" not in plan and Path(plan).is_dir():
        options = {"--dry-run": dry_run, "--workers": work.workers, "--scheduler": work.scheduler}
        for option in (name for name, value in (options | {"--part": part}).items() if value):
            raise InputError.CONFLICT(
                f"{option} is for plan files, and {plan} is a folder, which is only read; to go on "
                "with a sweep give its plan file and -o."
            )
        return _look(plan, output, plot, outputs)
    if plot is not None:
        raise InputError.CONFLICT(
            "--plot draws a sweep that is there: give its folder in place of the plan file."
        )
    outputs.check([plan])
    if dry_run:
        with terminal.progress("solving some rows"):
            from notchflex.sweeping import estimate

            expected = estimate(plan, workers=work.workers)
        outputs.write(expected._asdict, lambda: _print_estimate(expected))
        return DONE
    if output is None:
        raise InputError.MISSING_VALUE("-o is missing: give the folder of the sweep, -o DIR.")
    text, start = f"sweeping {plan}", monotonic()
    with terminal.progress(text) as progress:
        import notchflex.sweeping as sweeping

        def show(done: int, total: int, unsolved: int, before: int) -> None:
            rate = (done - before) / max(monotonic() - start, 1e-9)
            progress(text, done, total, f"{rate:.3g} rows/s, {unsolved} unsolved")

        try:
            swept = sweeping.sweep(plan, output, **vars(work), part=part or (1, 1), progress=show)
        except KeyboardInterrupt:
            words = ["notchflex", "sweep", plan, "-o", output]
            for option, value in vars(work).items():
                words += [] if value is None else [f"--{option}", str(value)]
            words += [] if part is None else ["--part", "{}/{}".format(*part)]
            terminal.note(f"finished pieces are kept; go on with: {shlex.join(words)}")
            raise
    return _report(swept, outputs)


def _look(folder: str, output: str | None, plot: tuple[str, str] | None, outputs: Outputs) -> int:
    """Print a sweep that is there, or draw it."""
    if plot is None and output is not None:
        raise InputError.CONFLICT(
            f"{folder} is the folder of a sweep; -o is for plan files, or for --plot."
        )
    if plot is not None:
        if output is None:
            raise InputError.MISSING_VALUE("-o is missing: give the file of the picture, -o FILE.")
        check_picture(output, "-o")
    outputs.check(files={} if output is None else {"-o": output})
    with terminal.progress(f"reading {folder}", compiles=False):
        from notchflex.sweeping import read_sweep

        swept = read_sweep(folder)
    if plot is not None and output is not None:
        with terminal.progress(f"drawing {output}", compiles=False):
            from notchflex.plotting import sweep_picture

            sweep_picture(swept, *plot).save(output)
        if outputs.json is None:
            return DONE
    return _report(swept, outputs)


def _report(swept: Sweep, outputs: Outputs) -> int:
    """Write and print what is summed up of a sweep; return the exit code."""
    outputs.write(swept.document, lambda: print_sweep(swept))
    unsolved = sum(swept.counts[code] for code in ("NOT_CONVERGED", "INVALID_ROBOT"))
    if unsolved:
        terminal.warn(f"{unsolved} of {swept.rows} rows have no result; `code` says why.")
    if swept.rows and unsolved == swept.rows:
        terminal.error("no row has a result.")
        return NOT_CONVERGED
    return DONE


def print_sweep(swept: Sweep) -> None:
    """Print counts, and quantiles of every kept quantity: as many as fit beside its name."""
    console = terminal.output(terminal.width())
    counts = ", ".join(f"{count} {code}" for code, count in swept.counts.items() if count)
    rows = f"{swept.rows} rows"
    if not swept.finished:
        rows += f" of {swept.manifest.rows}, {len(swept.pieces)} of {swept.manifest.pieces} pieces"
    console.print(f"{swept.plan.name}: {rows}; {counts or 'none'}")
    if not swept.rows:
        return
    wanted = sorted({0.0, 1.0, *swept.plan.output.quantiles})
    fitting = [_quantiles(swept, shown) for shown in (wanted, *_QUANTILES) if len(shown) < 10]
    fits = (table for table in fitting if tables.width_of(table) <= console.width)
    console.print(next(fits, fitting[-1]))


def _quantiles(swept: Sweep, shown: list[float]) -> Table:
    """Return a table of quantiles of every kept quantity."""
    heads = {0.0: "smallest", 1.0: "largest", 0.5: "median"}
    quantiles = zip(*(swept.quantiles(name, shown) for name in swept.columns), strict=True)
    columns = {
        heads.get(part, f"{100 * part:g} %"): values
        for part, values in zip(shown, quantiles, strict=True)
    }
    forms = dict.fromkeys(columns, ".5g")
    return tables.table(tables.frame({"quantity": swept.columns, **columns}, **forms), gap=2)


def _print_estimate(expected: Estimate) -> None:
    """Print what a sweep will take."""
    from rich.filesize import decimal

    cores = f"{expected.workers} core{'s' * (expected.workers != 1)}"
    rows = {
        "rows": f"{expected.rows}",
        "pieces": f"{expected.pieces} of {expected.piece_rows} rows",
        "time": f"about {duration(expected.seconds)} on {cores}",
        "one row": f"{1e6 * expected.row_seconds:.3g} µs on one core",
        "files": f"about {decimal(int(expected.bytes))}; {decimal(int(expected.free))} are free",
        "without a result": f"{expected.unsolved} of {expected.solved} rows that were solved",
    }
    tables.show([("", rows.keys(), ""), ("", rows.values(), "")], gap=2)


def duration(seconds: float) -> str:
    """Return a time in words: seconds, minutes, hours or days.

    Example:
        >>> duration(90.0), duration(7200.0)
        ('1.5 min', '2.0 h')
    """
    for size, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.1f} s"
