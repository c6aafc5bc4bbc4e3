"""`notchflex sweep`: many robots from a plan file, in pieces that are gone on with."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import converted, flag
from notchflex.cli.arguments.pieces import Scheduler, Workers
from notchflex.cli.outputs import OUTPUT, JsonFile, Outputs, Quiet
from notchflex.cli.terminal import DONE, NOT_CONVERGED
from notchflex.support import check_picture, parse_whole

if TYPE_CHECKING:
    from notchflex.sweeping import Estimate, Sweep

_PART = "two whole numbers, such as 7/100 for the seventh of a hundred parts"


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
    x, comma, y = (word.strip() for word in text.partition(","))
    if not (x and comma and y) or "," in y:
        raise InputError.BAD_SYNTAX("give the names of two columns, X,Y.")
    return x, y


def sweep(
    plan: Annotated[
        str,
        Parameter(
            metavar="PLAN.toml|DIR",
            help="Plan file (`notchflex new NAME --sweep` writes one); or the folder of a sweep, "
            "to look at it.",
        ),
    ],
    /,
    *,
    output: Annotated[
        str | None,
        Parameter(
            name=("--output", "-o"),
            group=OUTPUT,
            metavar="DIR",
            help="Folder of the sweep: sweep.json, pieces/*.parquet and at the end summary.json. "
            "With `--plot`, the file of the picture.",
        ),
    ] = None,
    dry_run: Annotated[
        bool, flag("Solve some rows, tell how long the sweep takes and how large it is, and end.")
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    part: Annotated[
        tuple[int, int],
        converted(_part, "K/N"),
        Parameter(
            help="Only this part of the pieces: for array jobs without a scheduler.",
            show_default=False,
        ),
    ] = (1, 1),
    plot: Annotated[
        tuple[str, str] | None,
        converted(_axes, "X,Y"),
        Parameter(
            group=OUTPUT,
            help="Draw one column of a sweep over another, to the file that `-o` names.",
        ),
    ] = None,
    json: JsonFile = None,
    quiet: Quiet = False,
) -> int:
    """Solve many robots that differ by a few numbers, and keep the results as files.

    A sweep that was stopped goes on where it was: give the same call again. What the files hold
    does not depend on who works on them. Prints counts and quantiles of every kept quantity.
    """
    if not plan.strip():
        raise InputError.MISSING_VALUE("a plan file is needed, and got an empty name.")
    is_folder = "\0" not in plan and Path(plan).is_dir()
    if is_folder:
        given = {
            "--dry-run": dry_run,
            "--workers": workers is not None,
            "--scheduler": scheduler is not None,
            "--part": part != (1, 1),
        }
        for option in (name for name, there in given.items() if there):
            raise InputError.CONFLICT(
                f"{option} is for plan files, and {plan} is a folder, which is only read; to go on "
                "with a sweep give its plan file and -o."
            )
        return _look(plan, output, plot, json, quiet)
    if plot is not None:
        raise InputError.CONFLICT(
            "--plot draws a sweep that is there: give its folder in place of the plan file."
        )
    outputs = Outputs([plan], quiet=quiet, json=json)
    if workers is not None and scheduler is not None:
        raise InputError.CONFLICT("--workers and --scheduler exclude each other; give one of them.")
    if dry_run:
        with terminal.working("solving some rows"):
            terminal.use_compile_cache()
            from notchflex.sweeping import estimate

            expected = estimate(plan, workers=workers)
        outputs.write_json(expected._asdict)
        if outputs.prints_tables:
            _print_estimate(expected)
        return DONE
    if output is None:
        raise InputError.MISSING_VALUE("-o is missing: give the folder of the sweep, -o DIR.")
    with terminal.rate(f"sweeping {plan}") as show:
        terminal.use_compile_cache()
        import notchflex.sweeping as sweeping

        try:
            found = sweeping.sweep(
                plan, output, workers=workers, scheduler=scheduler, part=part, progress=show
            )
        except KeyboardInterrupt:
            words = ["notchflex", "sweep", plan, "-o", output]
            given = {"workers": workers, "scheduler": scheduler}
            words += [w for k, v in given.items() if v is not None for w in (f"--{k}", str(v))]
            words += [] if part == (1, 1) else ["--part", "{}/{}".format(*part)]
            terminal.note(f"finished pieces are kept; go on with: {shlex.join(words)}")
            raise
    return _report(found, outputs)


def _look(
    folder: str,
    output: str | None,
    plot: tuple[str, str] | None,
    json: str | None,
    quiet: bool,
) -> int:
    """Print a sweep that is there, or draw it."""
    if plot is None and output is not None:
        raise InputError.CONFLICT(
            f"{folder} is the folder of a sweep; -o is for plan files, or for --plot."
        )
    if plot is not None:
        if output is None:
            raise InputError.MISSING_VALUE("-o is missing: give the file of the picture, -o FILE.")
        check_picture(output, "-o")
    outputs = Outputs(quiet=quiet, json=json, files={} if output is None else {"-o": output})
    with terminal.working(f"reading {folder}"):
        from notchflex.sweeping import read_sweep

        found = read_sweep(folder)
    if plot is not None and output is not None:
        with terminal.working(f"drawing {output}"):
            from notchflex.plotting import sweep_picture

            sweep_picture(found, *plot).save(output)
        if json is None:
            return DONE
    return _report(found, outputs)


def _report(found: Sweep, outputs: Outputs) -> int:
    """Write and print what is summed up of a sweep; return the exit code."""
    outputs.write_json(found.document)
    if outputs.prints_tables:
        from notchflex.cli.tables.sweep_table import print_sweep

        print_sweep(found)
    unsolved = sum(found.counts[code] for code in ("NOT_CONVERGED", "INVALID_ROBOT"))
    if unsolved:
        terminal.warn(f"{unsolved} of {found.rows} rows have no result; `code` says why.")
    if found.rows and unsolved == found.rows:
        terminal.error("no row has a result.")
        return NOT_CONVERGED
    return DONE


def _print_estimate(expected: Estimate) -> None:
    from notchflex.cli.tables.sweep_table import print_estimate

    print_estimate(expected)
