"""Asking for readings, one at a time, on a terminal or from a pipe."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from notchflex.errors import InputError

BACK = ("<", "back")
"""What a person types to be asked the previous question again."""

HEADER = (
    f"Enter takes the value in brackets. {BACK[0]} or {BACK[1]} goes back to the previous "
    "question, and Ctrl+C ends without writing anything. A number may be a sum, such as 1.62-0.22."
)

Result = TypeVar("Result")


class _GoBack(Exception):  # noqa: N818
    """A person wants to answer the previous question again: no error."""


@dataclass(frozen=True)
class Question:
    """One reading that is asked for.

    Attributes:
        option: The option that answers it, for example `--depth`.
        text: What is asked, with its unit.
        read: Turns the answer into a value; raises `InputError` with what is allowed.
        default: The answer taken when none is given; None where one is needed.
        hint: How to measure it, shown once before it is asked.
    """

    option: str
    text: str
    read: Callable[[str], Any]
    default: str | None = None
    hint: str = ""


class Interview:
    """Takes answers from options first, then from a person or a pipe.

    Args:
        given: Option to what the command line said; None where it said nothing.
        accept_defaults: Take every default without asking.
    """

    def __init__(self, given: dict[str, str | None], *, accept_defaults: bool = False) -> None:
        self.given = given
        self.accept_defaults = accept_defaults
        self.defaulted: set[str] = set()
        self.person = sys.stdin is not None and sys.stdin.isatty()
        # What was typed so far, and how much of it has been asked for since the last way back.
        self._typed: list[str] = []
        self._asked = 0

    def conduct(self, questions: Callable[[Interview], Result]) -> Result:
        """Return what the answers make; a person may go back from question to question.

        Args:
            questions: Asks one question after the other by `ask`. It begins anew whenever the
                person goes back; what was typed before is then not asked again.

        Raises:
            InputError: As `ask`.
        """
        told = False
        while True:
            self.defaulted.clear()
            self._asked = 0
            try:
                return questions(self)
            except _GoBack:
                if self._typed:
                    self._typed.pop()
                elif not told:
                    self._tell("This is the first question.")
                    told = True

    def ask(self, question: Question) -> Any:
        """Return the value of an answer; a person who errs is asked again.

        Raises:
            InputError: A bad answer that was not typed by a person, or none where one is needed.
        """
        said = self.given.get(question.option)
        if said is not None:
            return self._read(question, said)
        if question.default is not None and self.accept_defaults:
            return self._default(question)
        self._asked += 1
        if self._asked <= len(self._typed):
            return self._value(question, self._typed[self._asked - 1])
        if self.person and self._asked == 1:
            self._tell(HEADER)
        if question.hint and self.person:
            self._tell(question.hint)
        while True:
            answer = self._line(question)
            if self.person and answer in BACK:
                raise _GoBack
            try:
                value = self._value(question, answer)
            except InputError as problem:
                if not self.person:
                    raise
                self._tell(str(problem))
                continue
            self._typed.append(answer)
            return value

    def _value(self, question: Question, answer: str) -> Any:
        if not answer and question.default is not None:
            return self._default(question)
        return self._read(question, answer)

    def _line(self, question: Question) -> str:
        shown = f" ({question.default})" if question.default is not None else ""
        # A pipe needs no prompt, and what is printed would only be noise in a log.
        *before, prompt = _lines(f"{question.text}{shown}:") if self.person else [""]
        for line in before:
            print(line)
        try:
            return input(f"{prompt} " if prompt else "").strip()
        except UnicodeDecodeError:
            raise InputError.BAD_SYNTAX(
                f"{question.text}: the answer is no text in {sys.stdin.encoding}."
            ) from None
        except EOFError:
            if question.default is not None:
                return ""
            raise InputError.MISSING_VALUE(
                f"No answer to: {question.text}. Give {question.option}, or a line of input."
            ) from None

    def _default(self, question: Question) -> Any:
        self.defaulted.add(question.option)
        return self._read(question, question.default or "")

    @staticmethod
    def _tell(text: str) -> None:
        for line in _lines(text, "  "):
            print(line)

    @staticmethod
    def _read(question: Question, answer: str) -> Any:
        try:
            return question.read(answer.strip())
        except InputError as problem:
            raise InputError(f"{question.option} {answer}: {problem}", problem.code) from None


def _lines(text: str, indent: str = "") -> list[str]:
    """Break a text at its words for the width of the terminal; long words stay whole."""
    # Room for the answer behind the last line.
    width = max(30, shutil.get_terminal_size((80, 24)).columns - 12)
    return textwrap.wrap(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
