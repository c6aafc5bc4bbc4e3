"""The verbs, their exit codes, and the messages of bad input.

Each verb is a module of its own, imported only when it is called: `notchflex --help` reads none of
them, and only those that compute import JAX.
"""

from __future__ import annotations

import gc
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from cyclopts import (
    App,
    CycloptsError,
    MissingArgumentError,
    Parameter,
    RepeatArgumentError,
)

from notchflex import InputError, InputWarning, __version__
from notchflex.cli import terminal
from notchflex.cli.terminal import BAD_INPUT, DONE, INTERNAL_ERROR, INTERRUPTED
from notchflex.support import let_go

ABOUT = """Statics of tendon-driven notched-tube robots.

Shapes, tensions and strains of notched-tube wrists under their tendons, with
history-dependent friction, superelastic material and closing notches. Robots
are described in TOML files in mm, N, MPa and degrees; `notchflex robots` lists
those that come with the program.
"""

EPILOGUE = """[bold]Examples[/bold]

    notchflex show pacheco2021-a
    notchflex simulate pacheco2021-a --tension 0:3:31,3:0:31 --plot wrist.png
    notchflex new my-wrist

Exit codes: 0 done, 1 not converged, 2 bad input.
"""

VERBS = {
    "robots": (
        "List the robots that come with the program.",
        "notchflex robots",
    ),
    "show": (
        "Show every notch of a robot: section, closing angle and force, strain at closing.",
        "notchflex show pacheco2021-c\n"
        "    notchflex show pacheco2021-a --set notch.depth=1.38 --json -\n"
        "    notchflex show gao2017 --plot drawing.svg",
    ),
    "schema": (
        "Print the JSON Schema of robot files, for editors that check and complete them.",
        "notchflex schema > robot.schema.json",
    ),
    "new": (
        "Ask for the calliper readings of a wrist and write a commented robot file.",
        "notchflex new my-wrist\n"
        "    notchflex new my-wrist --outer-diameter 1.62 --inner-diameter 1.40 --cut on-axis \\\n"
        "        --notches 4 --depth 1.36,1.39,1.42,1.45 --height 1.0 --uncut-length 1.0",
    ),
    "simulate": (
        "Pull the tendons of a robot through a series of tensions or strokes.",
        "notchflex simulate pacheco2021-a --tension 0:3:31,3:0:31 --plot wrist.png\n"
        "    notchflex simulate pacheco2021-a --stroke 0:2:21 --set friction.coefficient=0.1\n"
        "    notchflex simulate two-axis-wrist --tension 1=0:1:11 --tension 2=0.1 --json -\n"
        "    notchflex simulate pacheco2021-a --tension 0:3:301 --columns gap,closed\n"
        "    notchflex simulate pacheco2021-a --tension 0:3:31 --beside pacheco2021-b \\\n"
        '        --beside "slick: friction.coefficient=0" --plot beside.html\n'
        "    notchflex simulate gao2017 --tension 0:8:9,8:0:9 --tip-mass 20 --plot loop.gif\n"
        "    notchflex simulate liu2022 --tension 1=9 --tip-force 0,0,-0.5 --refinement 1",
    ),
    "view": (
        "Show a robot in the browser, with sliders for its tendons and loads.",
        "notchflex view pacheco2021-a --open\n    notchflex view two-axis-wrist --port 9000",
    ),
    "follow": (
        "Find the tensions or strokes that bring the tip to one target after the other.",
        "notchflex simulate pacheco2021-a --tension 0.5:1:6,1:0.5:6 --csv loop.csv\n"
        "    cut -d, -f16,18 loop.csv > targets.csv\n"
        "    notchflex follow pacheco2021-a targets.csv --plot follow.png\n"
        "    notchflex follow pacheco2021-a targets.csv --approach least --most-tension 2",
    ),
    "compare": (
        "Compare a robot with measured angles and tip positions.",
        "notchflex simulate pacheco2021-a --tension 0:2:9,2:0:9 --csv loop.csv\n"
        "    notchflex compare pacheco2021-a loop.csv --path --set friction.coefficient=0.1 \\\n"
        "        --plot compare.png",
    ),
    "calibrate": (
        "Find constants of robots from measurements, with confidence intervals.",
        "notchflex simulate pacheco2021-a --tension 0.2:1.6:8 --csv a.csv\n"
        "    notchflex simulate pacheco2021-b --tension 0.2:1.2:6 --csv b.csv\n"
        "    notchflex calibrate pacheco2021-a=a.csv --fit friction.coefficient -o fitted\n"
        "    notchflex calibrate pacheco2021-a=a.csv pacheco2021-b=b.csv \\\n"
        "        --fit material.elastic_modulus --leave-out robot --plot fit.png",
    ),
    "measure": (
        "Measure the angle of every notch in photographs of a bent robot, or its notches as cut.",
        "notchflex measure pull_0.5N.jpg pull_1N.jpg --robot pacheco2021-a \\\n"
        '        --pattern "pull_{tension}N" -o measured.csv\n'
        "    notchflex measure straight.jpg turned.jpg --robot pacheco2021-a --cut --turn 20 \\\n"
        "        -o cut.csv --write-robot as-cut.toml",
    ),
    "board": (
        "Draw a board of markers that gives photographs their scale.",
        "notchflex board 4x3,marker=5,gap=1.5 -o board.svg",
    ),
    "tolerance": (
        "Find out what tolerances do: worst case, yield, which dimension to control.",
        "notchflex new limits --tolerance\n"
        "    notchflex tolerance pacheco2021-a limits.toml\n"
        "    notchflex tolerance pacheco2021-a limits.toml --draws 10000 --plot tolerances.png \\\n"
        "        --csv robots.csv --json -",
    ),
    "sweep": (
        "Solve many robots that differ by a few numbers, and keep the results as files.",
        "notchflex new plan --sweep\n"
        "    notchflex sweep plan.toml --dry-run\n"
        "    notchflex sweep plan.toml -o swept\n"
        "    notchflex sweep swept --plot notch.depth,total_angle_deg -o swept.png",
    ),
    "design": (
        "Choose dimensions so that a robot meets a specification.",
        "notchflex new wish --design\n"
        "    notchflex design wish.toml -o designed\n"
        "    notchflex design wish.toml -o robust --robust\n"
        "    notchflex design wish.toml --json - --quiet",
    ),
    "friction-rig": (
        "Find the coefficient of friction from two hanging weights.",
        "echo weight_1_g,weight_2_g,turn_1_deg,turn_2_deg > readings.csv\n"
        "    echo 100,63.1,90,85 >> readings.csv\n"
        "    echo 200,126.8,88,86 >> readings.csv\n"
        "    notchflex friction-rig readings.csv --plot friction.png",
    ),
    "sense": (
        "Find the force on a robot from tensions and strokes of its tendons.",
        "notchflex simulate pacheco2021-a --tension 0.1:0.8:8 --tip-force 0.02,0,0 --csv read.csv\n"
        "    notchflex sense pacheco2021-a read.csv --plot force.png\n"
        "    notchflex sense pacheco2021-a read.csv --components xz --with tip --tip-noise 0.05",
    ),
    "workspace": (
        "Explore where the tip of a robot can go, during loading and unloading.",
        "notchflex workspace two-axis-wrist --states 20000 --plot workspace.png\n"
        "    notchflex workspace pacheco2021-a --limit strain=0.04 --states 4000 --json -\n"
        "    notchflex workspace pacheco2021-a --states 4000 --beside pacheco2021-b",
    ),
    "fatigue": (
        "Find the strain cycle of every notch, and its margin below a limit line.",
        "notchflex fatigue pacheco2021-a-true --tension 0:0.5:6,0.5:0:6 \\\n"
        "        --set fatigue.line=cao2020 --plot cycle.png",
    ),
    "export": (
        "Write files for the laser, for CAD and for simulators.",
        "notchflex export pacheco2021-a --dxf wrist.dxf --two-axis\n"
        "    notchflex export two-axis-wrist --svg wrist.svg --kerf 0.025 --seam split",
    ),
    "bench": (
        "Time the solver on this machine.",
        "notchflex bench --json bench.json\n    notchflex bench --only wrist",
    ),
    "doctor": (
        "Check the installation: versions, device, extras, a sum that some JAX versions get wrong.",
        "notchflex doctor\n    notchflex doctor --json -",
    ),
    "completion": (
        "Complete verbs and options in the shell.",
        "notchflex completion --install\n    notchflex completion zsh > _notchflex",
    ),
}
"""Verb to its one-line help and its examples."""

_MODULES = {
    "robots": "robot_files",
    "schema": "robot_files",
    "new": "robot_files",
    "board": "measure",
    "fatigue": "simulate",
    "bench": "installation",
    "doctor": "installation",
    "completion": "installation",
}
"""Verbs that share a file; the others have one of their own name."""

_CODES: dict[type[CycloptsError], Callable[[str], InputError]] = {
    MissingArgumentError: InputError.MISSING_VALUE,
    RepeatArgumentError: InputError.CONFLICT,
}


def _default_of_help(value: object) -> str | None:
    return None if value is None or value is False or value == () else str(value)


def build() -> App:
    """Return the command line application; the verbs are loaded when they are called."""
    app = App(
        name="notchflex",
        version=__version__,
        help=ABOUT,
        help_epilogue=EPILOGUE,
        default_parameter=Parameter(negative=(), show_default=_default_of_help),
        help_format="rich",  # reading markdown takes a fifth of the time of `--help`
        console=terminal.output(),
        error_console=terminal.messages(),
        result_action="return_value",
        exit_on_error=False,
        suppress_keyboard_interrupt=False,  # `run` reports it
        print_error=False,
    )
    for order, (verb, (text, examples)) in enumerate(VERBS.items()):
        name = verb.replace("-", "_")
        plural = "s" if examples.count("notchflex ") > 1 else ""
        app.command(
            f"notchflex.cli.verbs.{_MODULES.get(verb, name)}:{name}",
            name=verb,
            help=text,
            sort_key=order,
            help_format="markdown",
            help_epilogue=f"**Example{plural}**\n\n    {examples}\n",
        )
    return app


def execute(tokens: Sequence[str]) -> int:
    """Run a verb.

    Args:
        tokens: What stands after `notchflex`.

    Returns:
        The exit code: 0 done, 1 not converged.

    Raises:
        InputError: Bad input: of the verb, or of an option that does not exist or is missing.
    """
    try:
        return build()(tokens) or DONE
    except CycloptsError as problem:
        if isinstance(problem.__cause__, InputError):  # from a converter of our own
            raise problem.__cause__ from None
        verb = next((token for token in tokens if token in VERBS), "")
        words = " ".join(str(problem).split())
        if verb and tokens[0].startswith("-"):
            words = f"Options stand behind the command: notchflex {verb} {tokens[0]} ..."
        words += "" if words.endswith((".", "?", "!")) else "."
        help_ = " ".join(["notchflex", *([verb] if verb else []), "--help"])
        code = _CODES.get(type(problem), InputError.UNKNOWN_NAME)
        raise code(f"{words} See {help_}.") from None


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: What stands after `notchflex`; None for those of this process.

    Returns:
        The exit code: 0 done, 1 not converged, 2 bad input (with one clear message).
    """
    terminal.quiet = False
    try:
        code = execute(list(sys.argv[1:] if arguments is None else arguments))
        sys.stdout.flush()
        return code
    except InputError as problem:
        terminal.error(str(problem))
    except KeyboardInterrupt as problem:
        terminal.error(f"interrupted; {str(problem) or 'nothing more is written'}.")
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone
        let_go(sys.stdout)
        return DONE
    except OSError as problem:
        if problem.filename is not None:  # only a write to a stream has no name
            raise
        let_go(sys.stdout)
        terminal.error(f"standard output cannot be written: {problem.strerror or problem}.")
    return BAD_INPUT


def main() -> None:
    """Run the command line and end the process with its exit code."""
    terminal.prepare_streams()
    # Modules make objects that stay; to search them for cycles every 700 takes 0.1 s.
    gc.set_threshold(100_000, *gc.get_threshold()[1:])
    shown = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *place: Any) -> None:
        if issubclass(category, InputWarning | FutureWarning):
            terminal.warn(str(message))
        else:
            shown(message, category, *place)

    warnings.showwarning = show
    try:
        code = run()
    except Exception:
        # Python would end with code 1, which means "not converged" here.
        traceback.print_exc()
        terminal.error("this is a bug in notchflex; please report it with the lines above.")
        code = INTERNAL_ERROR
    if code == INTERRUPTED:
        # Threads that compile would crash while Python shuts down. All output is written.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    # Python searches everything for cycles as it shuts down, which takes 0.3 s with JAX loaded.
    gc.freeze()
    sys.exit(code)
