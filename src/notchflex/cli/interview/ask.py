"""Asking for readings, one at a time, on a terminal or from a pipe."""

from __future__ import annotations

import ast
import math
import operator
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from notchflex import InputError
from notchflex.robot.value_names import parse_value

BACK = ("<", "back")
"""What a person types to be asked the previous question again."""

HEADER = (
    f"Enter takes the value in brackets. {BACK[0]} or {BACK[1]} goes back to the previous "
    "question, and Ctrl+C ends without writing anything. A number may be a sum, such as 1.62-0.22."
)

Result = TypeVar("Result")


class _GoBack(Exception):  # noqa: N818
    """A person wants to answer the previous question again: not an error."""


@dataclass(frozen=True)
class Question:
    """One reading that is asked for.

    Attributes:
        option: The option that answers it, for example `--depth`.
        text: What is asked, with its unit.
        read: Converts the answer to a value; raises `InputError` with what is allowed.
        default: The answer taken when none is given; None where one is needed.
        hint: How to measure it, shown once before it is asked.
    """

    option: str
    text: str
    read: Callable[[str], Any]
    default: str | None = None
    hint: str = ""

    def value(self, answer: str) -> Any:
        """Convert an answer; errors begin with the option and the answer."""
        try:
            return self.read(answer.strip())
        except InputError as problem:
            hint = (
                " For decimal commas, separate numbers by semicolons, or write a point: 1.9."
                if re.search(r"\d,\d", answer) and ";" not in answer
                else ""
            )
            raise InputError(f"{self.option} {answer}: {problem}{hint}", problem.code) from None


class Interview:
    """Takes answers from options first, then from a person or a pipe.

    Args:
        answers: Option to its value on the command line; None where it was not given.
        accept_defaults: Take every default without asking.
    """

    def __init__(self, answers: Mapping[str, str | None], *, accept_defaults: bool = False) -> None:
        self.answers = answers
        self.accept_defaults = accept_defaults
        self.defaulted: set[str] = set()
        self.used: set[str] = set()
        self.person = sys.stdin is not None and sys.stdin.isatty()
        # What was typed so far, and how much of it has been asked for since the last way back.
        self._typed: list[str] = []
        self._asked = 0

    def set_values(self, section: str, *, but: Container[str]) -> dict[str, Any]:
        """Return the values of `--set` for a section, numbers as such, without some keys."""
        start = f"--set {section}."
        values = {
            option.removeprefix(start): parse_value(answer)
            for option, answer in self.answers.items()
            if option.startswith(start) and answer and option.removeprefix(start) not in but
        }
        self.used |= {f"{start}{key}" for key in values}
        return values

    def conduct(self, questions: Callable[[Interview], Result]) -> Result:
        """Return what the answers make; a person may go back from question to question.

        Args:
            questions: Asks one question after the other by `ask`. It begins anew whenever the
                person goes back; what was typed before is then not asked again.

        Raises:
            InputError: As `ask`.
        """
        warned = False
        while True:
            self.defaulted.clear()
            self._asked = 0
            try:
                return questions(self)
            except _GoBack:
                if self._typed:
                    self._typed.pop()
                elif not warned:
                    _show("This is the first question.")
                    warned = True

    def ask(self, question: Question) -> Any:
        """Return the value of an answer; a person who errs is asked again.

        Raises:
            InputError: A bad answer that was not typed by a person, or none where one is needed.
        """
        answer = self.answers.get(question.option)
        if answer is not None:
            self.used.add(question.option)
            return question.value(answer)
        if question.default is not None and self.accept_defaults:
            return self._value(question, "")
        self._asked += 1
        if self._asked <= len(self._typed):
            return self._value(question, self._typed[self._asked - 1])
        if self.person and self._asked == 1:
            _show(HEADER)
        if question.hint and self.person:
            _show(question.hint)
        while True:
            answer = self._line(question)
            if self.person and answer in BACK:
                raise _GoBack
            try:
                value = self._value(question, answer)
            except InputError as problem:
                if not self.person:
                    raise
                _show(str(problem))
                continue
            self._typed.append(answer)
            return value

    def _value(self, question: Question, answer: str) -> Any:
        if not answer and question.default is not None:
            self.defaulted.add(question.option)
            answer = question.default
        return question.value(answer)

    def _line(self, question: Question) -> str:
        shown = f" ({question.default})" if question.default is not None else ""
        # A pipe needs no prompt, which would only be noise in a log.
        *before, prompt = _lines(f"{question.text}{shown}:") if self.person else [""]
        for line in before:
            print(line)
        try:
            return input(f"{prompt} " if prompt else "").strip()
        except UnicodeDecodeError:
            raise InputError.BAD_SYNTAX(
                f"{question.text}: the answer is not text in {sys.stdin.encoding}."
            ) from None
        except EOFError:
            if question.default is not None:
                return ""
            raise InputError.MISSING_VALUE(
                f"No answer to: {question.text}. Give {question.option}, or a line of input."
            ) from None


def _show(text: str) -> None:
    for line in _lines(text, "  "):
        print(line)


def _lines(text: str, indent: str = "") -> list[str]:
    """Break a text at its words for the width of the terminal, with room for the answer."""
    width = max(30, shutil.get_terminal_size((80, 24)).columns - 12)
    return textwrap.wrap(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


_OPERATIONS: dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_BOUNDS = {
    "above": (operator.gt, "greater than"),
    "at_least": (operator.ge, "at least"),
    "below": (operator.lt, "less than"),
    "at_most": (operator.le, "at most"),
}


def reading(text: str, **bounds: float) -> float:
    """Return a typed number, with a decimal point or comma; sums such as `1.62-0.22` are evaluated.

    Args:
        text: A number, or numbers joined by + - * /.
        **bounds: `above`, `at_least`, `below`, `at_most`: limits of the number.

    Raises:
        InputError: Not a number, not finite, or outside its bounds.

    Example:
        >>> round(reading("1.62-0.22", above=0, below=1.62), 9)
        1.4
    """
    try:
        plain = re.sub(r"(?<=\d),(?=\d)", ".", text).replace("−", "-")
        value = _evaluate(ast.parse(plain, mode="eval").body)
    except (ValueError, SyntaxError, ZeroDivisionError, OverflowError, RecursionError, MemoryError):
        raise InputError.NOT_A_NUMBER(
            f"got {_got(text)}; give a number such as 1.62, or a sum: 1.62-0.22."
        ) from None
    checks = [(*_BOUNDS[word], bounds[word]) for word in _BOUNDS if word in bounds]
    if not math.isfinite(value) or not all(holds(value, bound) for holds, _, bound in checks):
        allowed = " and ".join(f"{words} {bound:g}" for _, words, bound in checks)
        wanted = f"a finite number {allowed}".strip()
        raise InputError.OUT_OF_RANGE(f"got {value:g}; give {wanted}.")
    # Nobody reads callipers to a nanometre; this drops the noise of 1.62-0.22.
    return round(value, 9)


def readings(text: str, count: int, **bounds: float) -> list[float]:
    """Return one number for each of `count` notches; a single one holds for all.

    Raises:
        InputError: As `reading`, or another number of numbers.
    """
    parts = separated(text)
    if len(parts) not in (1, count):
        raise InputError.WRONG_SHAPE(
            f"got {len(parts)} numbers; give one for all, or {count} joined by commas, base to tip."
        )
    values = [reading(part, **bounds) for part in parts]
    return values * count if len(values) == 1 else values


def separated(text: str) -> list[str]:
    """Split numbers at semicolons where there are some, so that commas may be decimal, or commas.

    Example:
        >>> separated("1,36; 1,39"), separated("1.36, 1.39")
        (['1,36', '1,39'], ['1.36', '1.39'])
    """
    return [part.strip() for part in text.split(";" if ";" in text else ",")]


def choice(text: str, allowed: tuple[str, ...]) -> str:
    """Return one of the allowed words; its beginning is enough.

    Raises:
        InputError: Not one of them, or the beginning of several.
    """
    matches = [word for word in allowed if word == text] or [
        word for word in allowed if text and word.startswith(text.lower())
    ]
    if len(matches) != 1:
        raise InputError.UNKNOWN_NAME(f"got {_got(text)}; give {' or '.join(allowed)}.")
    return matches[0]


def whole(text: str, *, at_least: int, at_most: int) -> int:
    """Return a whole number within bounds.

    Raises:
        InputError: Not a whole number, or outside its bounds.
    """
    try:
        value = int(text)
    except ValueError:
        raise InputError.NOT_A_NUMBER(f"got {_got(text)}; give a whole number.") from None
    if not at_least <= value <= at_most:
        raise InputError.OUT_OF_RANGE(f"got {value}; give {at_least} to {at_most}.")
    return value


def _got(text: str) -> str:
    return repr(text) if text else "nothing"


def _evaluate(node: ast.expr) -> float:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_evaluate(operand)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _evaluate(operand)
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _OPERATIONS:
            return _OPERATIONS[type(operation)](_evaluate(left), _evaluate(right))
        case _:
            raise ValueError("not a sum of numbers")
