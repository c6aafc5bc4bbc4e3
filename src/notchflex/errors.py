"""What the package raises, and a code with text and remedy for every kind of failure."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import TypeVar


class _Coded(Enum):
    """A code with a text that says what is wrong and a remedy that says what to do."""

    def __init__(self, text: str, remedy: str) -> None:
        self.text, self.remedy = text, remedy

    def __str__(self) -> str:
        return self.name


class Failure(_Coded):
    """Why a step of a path has no equilibrium. `.text` says what happened, `.remedy` what to do.

    Its name is the `reason_code` of a result; braces in a text stand for numbers of that result.

    Example:
        >>> Failure.TOO_FEW_MODES.remedy
        'take smaller loads, or a refinement of 1, 2 or 3'
    """

    NOT_TRIED = (
        "not tried, because step {failed} of the path did not converge",
        "see the reason of that step",
    )
    BENT_TOO_FAR = (
        "a notch is bent by more than half a turn, so sharply that a fibre would have no length "
        "left, beyond the ends of its table, or too far about several axes at once",
        "take smaller loads or, where it bends about several axes, a refinement of 1, 2 or 3",
    )
    TOO_FEW_MODES = (
        "the strain modes miss the moment of the loads by {percent:.0f} % of the largest: the "
        "robot is bent beyond what this model is for",
        "take smaller loads, or a refinement of 1, 2 or 3",
    )
    FRICTION_LOCKS = (
        "a tendon turns so sharply at an edge that its friction would hold any pull (coefficient "
        "* tan(turning / 2) is 1 or more), where the friction law says nothing",
        "take smaller loads, or a smaller coefficient",
    )
    NOTCHES_CLOSED = (
        "every notch closed: the robot can't shorten the tendon further, so this stroke fixes no "
        "tension",
        "command a smaller stroke, or a tension, or give the tendon a finite axial_stiffness",
    )
    STROKE_OUT_OF_REACH = (
        "the robot can't shorten tendon {tendon} by so much, so this stroke fixes no tension",
        "command a smaller stroke, or a tension, or give the tendon a finite axial_stiffness",
    )
    STROKES_CONTRADICT = (
        "the strokes of tendons {tendons} contradict each other: no shape lets inextensible "
        "tendons be drawn so far at once, so they fix no tension",
        "command other strokes, or a tension, or give the tendons a finite axial_stiffness",
    )
    INDETERMINATE_TENSIONS = (
        "the strokes of inextensible tendons depend on each other, so that many tensions, and "
        "shapes, answer them; a change of a stroke by a micrometre selects others",
        "give the tendons a finite axial_stiffness, or command a tension of one of them",
    )
    TENDON_EDGES_MEET = (
        "the edges of tendon {tendon}'s channel meet in notch {notch}: the tendon has no free "
        "length left there, and the model does not go farther",
        "take smaller loads, or a tendon nearer to the axis",
    )
    LOSS_LEAVES_SLACK = (
        "the constant loss of friction is {loss:.4g} N over all edges of tendon {tendon}: below "
        "that tension, or somewhat more, it is slack behind some of them, and a stroke hardly "
        "fixes its tension",
        "command a tension, or a smaller constant_loss",
    )
    NO_EQUILIBRIUM = (
        "no equilibrium found beyond {percent:.3g} % of the way from the state before (imbalance "
        "{residual:.2g})",
        "take smaller steps, or the robot has no equilibrium there",
    )
    TARGET_OUT_OF_REACH = (
        "the target is out of reach; the nearest that was found misses it by {error}",
        "choose a target nearer to what the robot can do, or leave some of its entries free",
    )
    LIMITS_PREVENT = (
        "the limits do not allow the target; the nearest within them misses it by {error}",
        "widen the limits, or choose another target",
    )
    SEARCH_STOPPED = (
        "the search for the target stopped before its end; the best that was found misses it by "
        "{error}",
        "take smaller steps between targets, or allow more solves",
    )


class ErrorCode(_Coded):
    """Kinds of invalid input: the `.code` of an `InputError`. The message itself names the place.

    Example:
        >>> import notchflex as nf
        >>> try:
        ...     nf.load_robot("no such robot")
        ... except nf.InputError as error:
        ...     print(error.code.name)
        UNKNOWN_NAME
    """

    INVALID_INPUT = ("the input cannot be used", "change what the message names")
    UNKNOWN_NAME = (
        "there is no robot, quantity, option, key or kind of this name",
        "use one of the names that the message lists",
    )
    WRONG_TYPE = ("a value is of another kind than is needed", "give what the message asks for")
    BAD_SYNTAX = (
        "a text is not written in the form that is needed",
        "write it as the message shows",
    )
    NOT_A_NUMBER = ("a text stands where a number is needed", "write a number")
    NOT_FINITE = ("a number is NaN or infinite", "give finite numbers only")
    OUT_OF_RANGE = ("a number is outside its range", "give a number in the range of the message")
    WRONG_SHAPE = (
        "an array, list or table has another number of entries than is needed",
        "give as many as there are tendons, notches, steps or rows, as the message says",
    )
    MISSING_VALUE = ("a value or option that is needed is missing", "give it")
    CONFLICT = ("two inputs exclude each other or are given twice", "leave one of them out")
    NO_DATA = ("there is nothing to work on", "give at least one of what the message names")
    TOO_FEW_DATA = ("the data do not determine the result", "measure more, or fit less")
    UNSUPPORTED = (
        "the model, the file or this machine does not allow it",
        "use what the message names instead",
    )
    INVALID_ROBOT = (
        "a robot description has a value that is missing or not allowed",
        "change the keys that the message names; see the page on robot files",
    )
    INVALID_SPECIFICATION = (
        "a specification, such as that of a design, has a value that is missing or not allowed",
        "change the keys that the message names",
    )
    STATE_OF_ANOTHER_ROBOT = (
        "a state or a file belongs to another robot, or to other values of this one",
        "use it with its own robot, or start from rest",
    )
    FILE_NOT_FOUND = ("there is no such file or folder", "check the path")
    FILE_UNREADABLE = ("a file cannot be read", "check its permissions, encoding and format")
    FILE_UNWRITABLE = ("a file cannot be written", "choose another place")
    FILE_FORMAT = ("a file or its suffix is of another kind than is needed", "give another file")
    FILE_DAMAGED = ("a file was changed or is incomplete", "write the file again")
    TABLE_COLUMNS = ("a table lacks a column or names one twice", "change its header")
    TABLE_ROWS = ("a table has a row with too many or too few entries, or none", "change that row")
    MISSING_PACKAGE = (
        "an optional package is not installed, or in another version",
        "install the extra that the message names",
    )
    NOT_CONVERGED = ("a solve that the result needs did not converge", "take smaller loads")
    PROCESS_FAILED = ("a process that was started failed", "read its message")
    NO_CONNECTION = ("the viewer cannot be served or does not answer", "choose another address")


_Error = TypeVar("_Error", bound="InputError")


class _OfCodes(type):
    """Class of errors that `InputError.UNKNOWN_NAME(message)` makes with the code of that name."""

    def __getattr__(cls: Callable[..., _Error], name: str) -> Callable[[str], _Error]:
        if name not in ErrorCode.__members__:
            raise AttributeError(name)
        return lambda message: cls(message, ErrorCode[name])


class InputError(ValueError, metaclass=_OfCodes):
    """An input is outside what is allowed.

    The message is one sentence, or one per problem: what was got, what is allowed, what to do.
    The command line prints it as it is and exits with code 2. The package raises it with a code:
    `raise InputError.OUT_OF_RANGE("cores must be 1 or more; got 0")`.

    Attributes:
        code: The kind of error, an `ErrorCode`.
    """

    def __init__(self, message: str, code: ErrorCode = ErrorCode.INVALID_INPUT) -> None:
        super().__init__(message)
        self.code = code


class InputWarning(UserWarning):
    """A value that is allowed, and was probably not meant; its text asks what was.

    Attributes:
        code: Always "UNLIKELY_VALUE".
        name: Name of the value, such as `material.elastic_modulus`.
        value: What it is, in the unit of the robot file.
        meant: What may have been meant; None where nothing is near.
    """

    code = "UNLIKELY_VALUE"

    def __init__(self, text: str, name: str, value: float, meant: float | None) -> None:
        super().__init__(text)
        self.name, self.value, self.meant = name, value, meant


class RobotFileError(InputError):
    """A robot file, or the name of a ready robot, cannot be used; the message names it."""


class ConvergenceError(RuntimeError):
    """A result was asked to be converged and is not.

    Attributes:
        code: What stopped the solver, a `Failure`.
    """

    def __init__(self, message: str, code: Failure | None = None) -> None:
        super().__init__(message)
        self.code = code
