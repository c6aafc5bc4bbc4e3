"""The examples that `--help` shows run as they are written, in an empty folder."""

import os
import re
import subprocess
import sys
import textwrap

import pytest

from notchflex.cli.app import VERBS, run

# What never ends by itself, takes minutes, writes into the home folder, or needs photographs.
NOT_RUN = ("--open", "--port", "notchflex bench", "--install", "notchflex measure")


def script(verb):
    """The examples of a verb as the lines of a shell, those that cannot be run here left out."""
    text = textwrap.dedent(f"    {VERBS[verb][1]}").replace("\\\n", "")
    return [line for line in text.splitlines() if not any(word in line for word in NOT_RUN)]


@pytest.mark.parametrize("verb", VERBS)
def test_help_shows_the_examples(verb, capsys):
    run([verb, "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    for line in textwrap.dedent(f"    {VERBS[verb][1]}").splitlines():
        assert line.split()[-1] in shown


def test_columns_that_are_cut_from_a_table_are_those_of_the_tip(capsys):
    run(["simulate", "pacheco2021-a", "--tension", "1", "--csv", "-"])
    names = capsys.readouterr().out.splitlines()[0].split(",")
    (places,) = re.findall(r"cut -d, -f(\S+)", VERBS["follow"][1])
    assert [names[int(place) - 1] for place in places.split(",")] == ["tip_x_mm", "tip_z_mm"]


@pytest.mark.nightly
@pytest.mark.parametrize("verb", [verb for verb in VERBS if script(verb)])
def test_examples_run_as_written(verb, tmp_path):
    tool = tmp_path / "bin" / "notchflex"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m notchflex "$@"\n')
    tool.chmod(0o755)
    place = tmp_path / "empty"
    place.mkdir()
    variables = os.environ | {"PATH": f"{tool.parent}:{os.environ['PATH']}", "HOME": str(tmp_path)}
    for line in script(verb):
        done = subprocess.run(
            ["sh", "-c", line], cwd=place, env=variables, capture_output=True, text=True,
            stdin=subprocess.DEVNULL, check=False, timeout=500,
        )  # fmt: skip
        if verb == "new" and "\\" not in line and "--cut" not in line:
            assert done.returncode == 2  # it asks, and here nobody answers
            assert "No answer to: " in done.stderr
            continue
        assert done.returncode == 0, (line, done.stderr)
