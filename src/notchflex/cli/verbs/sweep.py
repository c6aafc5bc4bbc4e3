"""`notchflex sweep`: many robots from a plan file, in pieces, resumed where it was stopped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import tables, terminal
from notchflex.cli.options import OUTPUT, Folder, Outputs, Work, converted
from notchflex.cli.terminal import DONE
from notchflex.support import check_picture, parse_whole

if TYPE_CHECKING:
    from notchflex.sweeping import Estimate, Sweep

_QUANTILES = {"smallest": 0.0, "2.5 %": 0.025, "median": 0.5, "97.5 %": 0.975, "largest": 1.0}


def _part(text: str) -> tuple[int, int]:
    first, _, count = text.partition("/")
    read = parse_whole(1, what="K/N, such as 7/100 for the seventh of a hundred parts: ")
    return read(first.strip()), read(count.strip())


def _axes(text: str) -> tuple[str, str]:
    x, _, y = map(str.strip, text.partition(","))
    if not (x and y):
        raise InputError.BAD_SYNTAX("give the names of two columns, X,Y.")
    return x, y


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
    if Path(plan).is_dir():
        if dry_run or part or work != Work():
            raise InputError.CONFLICT(
                f"{plan} is a folder, which is only read: --dry-run, --workers, --scheduler and "
                "--part are for plan files; to go on with a sweep give its plan file and -o."
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
        outputs.write(expected, lambda expected: expected._asdict(), _print_estimate)
        return DONE
    if output is None:
        raise InputError.MISSING_VALUE("-o is missing: give the folder of the sweep, -o DIR.")
    text = f"sweeping {plan}"
    with terminal.progress(text) as progress:
        import notchflex.sweeping as sweeping

        def show(done: int, total: int, unsolved: int, _: int) -> None:
            progress(text, done, total, f"{unsolved} unsolved")

        swept = sweeping.sweep(plan, output, **vars(work), part=part or (1, 1), progress=show)
    return _report(swept, outputs)


def _look(folder: str, output: str | None, plot: tuple[str, str] | None, outputs: Outputs) -> int:
    """Print a sweep that is there, or draw it."""
    if (plot is None) != (output is None):
        raise InputError.CONFLICT(
            f"{folder} is the folder of a sweep: give --plot X,Y and -o FILE, or none of them."
        )
    if output is not None:
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
    outputs.write(swept, lambda swept: swept.document(), _print)
    unsolved = sum(swept.counts[code] for code in ("NOT_CONVERGED", "INVALID_ROBOT"))
    if unsolved:
        terminal.warn(f"{unsolved} of {swept.rows} rows have no result; `code` says why.")
    if swept.rows and unsolved == swept.rows:
        return terminal.failed("no row has a result.")
    return DONE


def _print(swept: Sweep) -> None:
    """Print counts, and quantiles of every kept quantity."""
    counts = ", ".join(f"{count} {code}" for code, count in swept.counts.items() if count)
    rows = f"{swept.rows} rows"
    if not swept.finished:
        rows += f" of {swept.manifest.rows}, {len(swept.pieces)} of {swept.manifest.pieces} pieces"
    terminal.line(f"{swept.plan.name}: {rows}; {counts or 'none'}")
    if swept.rows:
        quantiles = [swept.quantiles(name, [*_QUANTILES.values()]) for name in swept.columns]
        columns = dict(zip(_QUANTILES, zip(*quantiles, strict=True), strict=True))
        forms = dict.fromkeys(columns, ".5g")
        tables.show({"quantity": swept.columns, **columns}, forms=forms, wide=True)


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
    tables.show({"": rows.keys(), " ": rows.values()})


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
