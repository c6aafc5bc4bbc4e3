"""Output files of a verb: options, checks before anything is computed, and writing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.cli.arguments.conversion import flag
from notchflex.support import (
    BROWSER,
    PAPER,
    STANDARD_OUTPUT,
    check_distinct,
    check_output,
    check_picture,
    need,
)

if TYPE_CHECKING:
    from notchflex.plotting import Picture

OUTPUT = Group("Output", sort_key=9)
_BINARY = {"--nc": ("xarray", "h5netcdf", "h5py"), "--parquet": ("polars",)}
"""Options of binary files, and the packages that write these."""


def output_file(option: str, text: str) -> Parameter:
    """Return the parameter of an option that names a file to write."""
    return Parameter(
        name=option, group=OUTPUT, allow_leading_hyphen=True, metavar="FILE", help=text
    )


_PICTURE = "Draw a picture to this .png, .svg or .pdf file, or to an interactive .html file"
JsonFile = Annotated[
    str | None,
    output_file("--json", "Write the result as JSON to this file; `-` prints it and nothing else."),
]
CsvFile = Annotated[
    str | None,
    output_file(
        "--csv", "Write the result as a CSV table to this file; `-` prints it and nothing else."
    ),
]
PlotFile = Annotated[str | None, output_file("--plot", f"{_PICTURE}.")]
MovingPlotFile = Annotated[
    str | None, output_file("--plot", f"{_PICTURE}, or to an animated .gif file.")
]
Quiet = Annotated[
    bool,
    flag(
        "Print no tables, notes or progress: only warnings, errors, and what `-` asks for.",
        group=OUTPUT,
    ),
]


class Outputs:
    """The results that a call asks for.

    Args:
        inputs: Files that are read; no output may replace one of them.
        quiet: Whether `--quiet` was given.
        pictures: Suffixes that `--plot` may have.
        files: By option, further files that are written and were checked before.
        targets: What `--json`, `--csv`, `--plot` and others name; None where not given.
    """

    def __init__(
        self,
        inputs: Iterable[str | Path] = (),
        *,
        quiet: bool = False,
        pictures: tuple[str, ...] = PAPER + BROWSER,
        files: Mapping[str, str] | None = None,
        **targets: str | None,
    ) -> None:
        terminal.be_quiet(quiet)
        self.targets = {name: target for name, target in targets.items() if target is not None}
        options = {f"--{name.replace('_', '-')}": target for name, target in self.targets.items()}
        check_distinct({**options, **(files or {})})
        inputs = list(inputs)
        for option, target in options.items():
            if option == "--plot":
                check_picture(target, option, inputs=inputs, kinds=pictures)
            else:
                check_output(target, option, inputs=inputs)
            if option in _BINARY and target == STANDARD_OUTPUT:
                raise InputError.FILE_FORMAT(
                    f"{option} - : a binary file cannot go to standard output; name a file."
                )
            for module in _BINARY.get(option, ()):
                need(module, "data", option)
        self.prints_tables = not quiet and STANDARD_OUTPUT not in self.targets.values()

    def write_json(self, document: Callable[[], Any]) -> None:
        """Write the document of `--json`, if it was given."""
        if target := self.targets.get("json"):
            from notchflex.support import write_json

            write_json(target, document())

    def write_csv(self, columns: Callable[[], Mapping[str, Any]]) -> None:
        """Write the columns of `--csv`, if it was given."""
        if target := self.targets.get("csv"):
            from notchflex.support import write_columns

            write_columns(target, columns())

    def draw(self, result: Any) -> None:
        """Draw and write the usual picture of a result, if `--plot` was given."""

        def picture() -> Picture:
            from notchflex.plotting import picture

            return picture(result)

        self.save_picture(picture)

    def save_picture(self, picture: Callable[[], Picture]) -> None:
        """Draw and write the picture of `--plot`, if it was given."""
        if target := self.targets.get("plot"):
            with terminal.working(f"drawing {target}"):
                picture().save(target)
