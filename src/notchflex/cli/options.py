"""Options that several verbs have: how they are read, output files, loads, folders of pieces.

What an option means stands in the docstring of its verb, or of its class, for `--help`. Whatever
reads or checks arguments raises `InputError` for what cannot be used.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter, Token

from notchflex import InputError
from notchflex.cli import terminal
from notchflex.support import (
    BROWSER,
    PAPER,
    STANDARD_OUTPUT,
    AnyPath,
    BodyForceOption,
    TendonCommand,
    Vector,
    check_distinct,
    check_folder,
    check_output,
    check_picture,
    need,
    parse_number,
    parse_spec,
    parse_vector,
    parse_whole,
    read_body_force,
    read_command,
    replacing,
)

if TYPE_CHECKING:
    from notchflex.pieces import PieceFolder

Bounds = tuple[float | None, float | None]


def converted(
    read: Callable[[str], Any],
    metavar: str,
    *,
    several: bool = False,
    hyphen: bool = True,
    **more: Any,
) -> Parameter:
    """Return the parameter of an option that a function reads.

    Args:
        read: Turns one word into a value; raises `InputError` with what is wrong and allowed. The
            option and the word are put before it.
        metavar: What `--help` shows for the word.
        several: Whether the option may be given several times; its value is then a tuple.
        hyphen: Whether the word may begin with a hyphen, as negative numbers do.
        **more: Further arguments of `Parameter`.
    """

    def convert_one(token: Token) -> Any:
        try:
            return read(token.value)
        except InputError as problem:
            value = token.value if len(token.value) < 200 else f"{token.value[:80]}..."
            words = [word for word in (token.keyword, value or "''") if word]
            raise InputError(f"{' '.join(words)}: {problem}", problem.code) from None

    def convert(_type: Any, tokens: Sequence[Token]) -> Any:
        values = tuple(map(convert_one, tokens))
        return values if several else values[0]

    return Parameter(
        converter=convert,
        n_tokens=1,
        accepts_keys=False,
        metavar=f"{metavar}..." if several else metavar,
        allow_leading_hyphen=hyphen,
        **more,
    )


def number(form: str, metavar: str, least: float = -math.inf) -> Parameter:
    """Return the parameter of an option with a finite number."""
    return converted(partial(parse_number, form=form, least=least), metavar)


def integer(low: int, high: int | None = None) -> Parameter:
    """Return the parameter of an option with a whole number."""
    return converted(parse_whole(low, high), "N")


def vector(what: str, metavar: str = "X,Y,Z") -> Parameter:
    """Return the parameter of an option with three numbers."""
    return converted(parse_vector(what), metavar)


def named(form: str, read: Callable[[str], Any], metavar: str = "SPEC", **more: Any) -> Parameter:
    """Return the parameter of an option `NAME=VALUES` that is given once for each of some names.

    Args:
        form: What is allowed, for the message.
        read: Reads the values.
        metavar: What `--help` shows for the word.
        **more: Further arguments of `Parameter`.
    """

    def read_pair(text: str) -> tuple[str, Any]:
        name, _, values = (word.strip() for word in text.partition("="))
        if not (name and values):
            raise InputError.BAD_SYNTAX(f"give {form}.")
        return name, read(values)

    return converted(read_pair, metavar, several=True, **more)


def once(option: str, names: Iterable[str]) -> None:
    """Refuse an option that is given twice for one name."""
    names = list(names)
    for name in names:
        if names.count(name) > 1:
            raise InputError.CONFLICT(f"{option} {name} is given twice; give it once.")


def low_high(form: str, *, alone_is_high: bool = False) -> Callable[[str], Bounds]:
    """Return a reader of `LOW:HIGH`, one of which may be left out.

    Args:
        form: What is allowed, for the message.
        alone_is_high: Whether a number without a colon is the upper limit.
    """

    def read(text: str) -> Bounds:
        low, colon, high = text.rpartition(":")
        if not (colon or alone_is_high) or not text.strip(" :"):
            raise InputError.BAD_SYNTAX(f"give {form}.")
        lower, upper = (parse_number(word, form) if word.strip() else None for word in (low, high))
        return lower, upper

    return read


def exclude(first: str, second: str) -> InputError:
    """Return the error of two options that exclude each other."""
    return InputError.CONFLICT(f"{first} and {second} exclude each other; give one of them.")


Refinement = Annotated[
    int,
    integer(0, 3),
    Parameter(help="0 to 3: more strain modes and fibres, to check the accuracy."),
]

# Outputs

OUTPUT = Group("Output", sort_key=9)
_BINARY = {"--nc": ("xarray", "h5netcdf", "h5py"), "--parquet": ("polars",)}
"""Options of binary files, and the packages that write these."""

File = Annotated[str | None, Parameter(group=OUTPUT, allow_leading_hyphen=True, metavar="FILE")]
"""A file to write."""
ShortFile = Annotated[File, Parameter(name="-o")]
Folder = Annotated[str | None, Parameter(name=("--output", "-o"), group=OUTPUT, metavar="FOLDER")]
"""A folder to write files into."""
StateFile = Annotated[
    str | None,
    Parameter(
        metavar="FILE",
        help="Start from a state that `--save-state` wrote, with its friction history.",
    ),
]
Columns = Annotated[
    tuple[tuple[str, str], ...],
    named(
        "NAME=HEADER, such as tension=Kraft",
        str,
        "NAME=HEADER",
        name="--column",
        help='Which column of the data is what: `tension="Kraft [N]"`, `stroke=...`, `total=...`, '
        "`notch_1=...`, `tip_x_mm=...`. Headers such as `Force [mN]` are understood without it.",
    ),
]


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class Outputs:
    """The results that a call asks for.

    Attributes:
        json: Write the result as JSON; `-` prints it and nothing else.
        quiet: Print only warnings, errors, and what `-` asks for.
    """

    json: File = None
    quiet: bool = False

    def check(
        self,
        inputs: Iterable[str | Path] = (),
        *,
        pictures: tuple[str, ...] = PAPER + BROWSER,
        files: Mapping[str, str] | None = None,
        folder: tuple[str, str | None, Sequence[str]] = ("", None, ()),
    ) -> Sequence[Path]:
        """Check all files before anything is computed.

        Args:
            inputs: Files that are read; no output may replace one of them.
            pictures: Suffixes that `--plot` may have.
            files: By option, further files that are written.
            folder: Option and name of a folder, and the files that are written into it.

        Returns:
            The files in the folder.
        """
        terminal.quiet = self.quiet
        inputs, targets = list(inputs), {**self.targets, **(files or {})}
        option, name, names = folder
        inside = () if name is None else check_folder(name, names, option, inputs=inputs)
        check_distinct({**targets, **{f"{option} ({file.name})": str(file) for file in inside}})
        for option, target in targets.items():
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
        return inside

    @property
    def targets(self) -> dict[str, str]:
        """The files that were named, by option."""
        files = {name: file for name, file in vars(self).items() if isinstance(file, str)}
        return {f"--{name.replace('_', '-')}": file for name, file in files.items()}

    @property
    def prints_tables(self) -> bool:
        """Whether standard output is for people."""
        return not self.quiet and STANDARD_OUTPUT not in self.targets.values()

    def write(
        self,
        result: Any,
        document: Callable[[Any], Any],
        show: Callable[[Any], object] | None = None,
        title: str | None = None,
        **writers: Callable[..., object],
    ) -> None:
        """Write and print what was asked for.

        Args:
            result: What was computed.
            document: Makes the document of `--json` of it.
            show: Prints its tables.
            title: Heading of the usual picture; that of its kind if None.
            **writers: By option, what writes the result to another file: a function of result and
                file. That of `plot` also takes what shows progress, and by default draws the usual
                picture.
        """
        from notchflex.support import write_json

        for option, target in self.targets.items():
            name = option.strip("-").replace("-", "_")
            if name == "json":
                write_json(target, document(result))
            elif name == "plot":
                text = f"drawing {target}"
                with terminal.progress(text, compiles=False) as progress:
                    if name in writers:
                        writers[name](result, target, partial(progress, text))
                    else:
                        from notchflex.plotting import picture

                        picture(result, title=title).save(target)
            elif name in writers:
                writers[name](result, target)
        if show and self.prints_tables:
            show(result)


def as_csv(columns: Callable[[Any], Mapping[str, Any]]) -> Callable[[Any, str], None]:
    """Return what writes the columns of a result as CSV."""
    from notchflex.support import write_columns

    return lambda result, target: write_columns(target, columns(result))


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class DrawnOutputs(Outputs):
    """Results that are drawn, too.

    Attributes:
        plot: Draw a picture: .png, .svg, .pdf or (interactive) .html.
    """

    plot: File = None


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class TableOutputs(DrawnOutputs):
    """Results with one row for each step.

    Attributes:
        csv: Write the result as a CSV table to this file; `-` prints it and nothing else.
    """

    csv: File = None


@Parameter(name="*", group=OUTPUT)
@dataclass(frozen=True)
class PathOutputs(TableOutputs):
    """Results that end in a state.

    Attributes:
        save_state: Write the last state to this file, for `--from-state`.
    """

    save_state: File = None


def save_state(result: Any, target: str) -> None:
    """Write the last state of a result."""
    with replacing(target) as temporary:
        result.state.save(temporary)


# Loads

LOADS = Group(
    "External loads", sort_key=8, help="They act before the first step and stay as they are."
)


def tendon_command(option: str, *, negative: bool = False) -> Parameter:
    """Return the parameter of an option `SPEC` or `TENDON=SPEC` that may be given several times."""
    return converted(partial(read_command, option, negative), "SPEC", several=True)


Tensions = Annotated[tuple[TendonCommand, ...], tendon_command("--tension")]
Strokes = Annotated[tuple[TendonCommand, ...], tendon_command("--stroke", negative=True)]
Spools = Annotated[tuple[TendonCommand, ...], tendon_command("--spool", negative=True)]


@Parameter(name="*", group=LOADS)
@dataclass(frozen=True)
class ExternalLoads:
    """Loads that act on all steps, beside the tendons.

    Attributes:
        tip_force: Force X,Y,Z at the tip [N], in the world.
        tip_moment: Moment X,Y,Z at the tip [N mm], in the world.
        tip_point: Where the tip force acts and the tip mass hangs: X,Y,Z from the tip [mm], in the
            frame of the tip.
        body_force: Force on a rigid body [N]: 0 is the base, 1 the body beyond the first notch. The
            point of application after @ [mm] is in the frame of the body; its origin if left out.
            May be given several times.
        tip_mass: Mass that hangs at the tip [g]; along 0,0,-9.81 without --gravity.
        gravity: Gravity X,Y,Z in the world [m/s2]; the robot's own weight counts where
            material.density is known.
        temperature: Temperature [deg C]: one, or one for each step.
        sheath_bend_deg: Total angle by which the sheaths are bent [deg].
        following: Forces and moments turn with the body they act on, and are given in its frame.
    """

    tip_force: Annotated[Vector | None, vector("forces in N")] = None
    tip_moment: Annotated[Vector | None, vector("moments in N mm")] = None
    tip_point: Annotated[Vector | None, vector("coordinates in mm")] = None
    body_force: Annotated[
        tuple[BodyForceOption, ...],
        converted(read_body_force, "BODY:X,Y,Z[@X,Y,Z]", several=True),
    ] = ()
    tip_mass: Annotated[
        float | None, number("a finite number of grams, 0 or more", "G", least=0.0)
    ] = None
    gravity: Annotated[Vector | None, vector("accelerations in m/s2")] = None
    temperature: Annotated[list[float] | None, converted(parse_spec, "SPEC")] = None
    sheath_bend_deg: Annotated[
        float | None, number("a finite angle in degrees, 0 or more", "DEG", least=0.0)
    ] = None
    following: bool = False

    def __post_init__(self) -> None:
        """Refuse an option that has no effect without another one."""
        if self.following and not (self.tip_force or self.tip_moment or self.body_force):
            raise InputError.CONFLICT(
                "--following: nothing turns; give --tip-force, --tip-moment or --body-force."
            )
        if self.tip_point and self.tip_force is None and self.tip_mass is None:
            point = ",".join(f"{value:g}" for value in self.tip_point)
            raise InputError.CONFLICT(
                f"--tip-point {point}: nothing acts there; give --tip-force or --tip-mass."
            )

    def arguments(self) -> dict[str, Any]:
        """Return these loads as arguments of `notchflex.Load` and of `LoadPath.loaded`."""
        from notchflex import BodyForce

        given = {name: value for name, value in vars(self).items() if value not in (None, ())}
        if forces := given.pop("body_force", ()):
            given["body_forces"] = [
                BodyForce(**force._asdict(), following=self.following) for force in forces
            ]
        if self.temperature and len(self.temperature) == 1:
            (given["temperature"],) = self.temperature
        given["following"] = self.following and bool(self.tip_force or self.tip_moment)
        return given


NO_LOADS = ExternalLoads()

# Folders of pieces

PIECES = Group("In pieces", sort_key=7)


@Parameter(name="*", group=PIECES)
@dataclass(frozen=True)
class Work:
    """Who works on a long computation.

    Attributes:
        workers: Work in so many processes; by default in threads of one, one per core.
        scheduler: Work with those of a dask scheduler that see the same folder, such as
            tcp://10.0.0.1:8786 (`cluster`).
    """

    workers: Annotated[int | None, integer(1, 1024)] = None
    scheduler: Annotated[str | None, Parameter(metavar="ADDRESS")] = None

    def __post_init__(self) -> None:
        """Refuse options that exclude each other."""
        if self.workers is not None and self.scheduler is not None:
            raise exclude("--workers", "--scheduler")


@Parameter(name="*", group=PIECES)
@dataclass(frozen=True)
class InPieces(Work):
    """A long computation that keeps finished pieces in a folder.

    Attributes:
        folder: Keep finished pieces in this folder (extra `data`): the same call resumes where it
            was stopped.
    """

    folder: Annotated[str | None, Parameter(metavar="DIR")] = None

    def chosen(self, kind: str, inputs: Iterable[AnyPath]) -> PieceFolder | None:
        """Return the folder, None if none is given; nothing is written.

        Args:
            kind: What is computed, as in the manifest.
            inputs: Files that are read.

        Raises:
            InputError: Options that need the folder, or a folder that cannot be used.
        """
        if self.folder is None:
            for name in ("workers", "scheduler"):
                if getattr(self, name) is not None:
                    raise InputError.MISSING_VALUE(
                        f"--{name} needs --folder DIR, where all workers put their pieces."
                    )
            return None
        from notchflex.pieces import PieceFolder, check_target

        check_target(self.folder, kind, "--folder", [os.fspath(file) for file in inputs])
        return PieceFolder(self.folder, self.workers, self.scheduler)


NO_FOLDER = InPieces()
