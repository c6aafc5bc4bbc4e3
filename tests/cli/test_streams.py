"""Standard streams of every condition: gone, closed, full, or of another encoding."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

FULL = Path("/dev/full")
SIMULATE = "simulate pacheco2021-a --tension 0:0.5:3"


@pytest.fixture
def shell(tmp_path):
    """Run a line of bash; `notchflex` stands for the command. Return what subprocess returns."""

    def runner(line, **variables):
        return subprocess.run(
            ["bash", "-c", f'notchflex() {{ "{sys.executable}" -m notchflex "$@"; }}; {line}'],
            capture_output=True,
            cwd=tmp_path,
            env={**os.environ, **variables},
            timeout=300,
            check=False,
        )

    return runner


@pytest.mark.parametrize("verb", ["robots", "schema", "--help", SIMULATE, f"{SIMULATE} --json -"])
def test_a_reader_that_goes_away_is_no_failure(shell, verb):
    done = shell(f"notchflex {verb} | true; exit ${{PIPESTATUS[0]}}")
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr


def test_files_are_written_and_failures_told_after_the_reader_has_gone(shell, tmp_path):
    done = shell(
        "notchflex simulate pacheco2021-a --stroke 0,4 --json - --csv a.csv | true; "
        "exit ${PIPESTATUS[0]}"
    )
    assert done.returncode == 1
    assert b"not converged" in done.stderr
    assert (tmp_path / "a.csv").exists()


@pytest.mark.skipif(not FULL.exists(), reason="there is no /dev/full")
@pytest.mark.parametrize(
    "line", ["robots >/dev/full", "schema >/dev/full", f"{SIMULATE} --json /dev/full"]
)
def test_a_full_disk_is_told(shell, line):
    done = shell(f"notchflex {line}")
    assert done.returncode == 2
    assert b"cannot be written: No space left on device" in done.stderr
    assert b"Traceback" not in done.stderr


def test_closed_streams(shell):
    assert shell("notchflex robots >&-").returncode == 0
    assert shell("notchflex show none.toml 2>&-").returncode == 2
    done = shell("notchflex new x <&-")
    assert done.returncode == 2
    assert b"No answer to: Outer diameter" in done.stderr


@pytest.mark.nightly
@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_other_encodings_get_the_nearest_characters(shell, tmp_path, encoding):
    made = shell(
        "notchflex new ü --title 'Größe Ω' --outer-diameter 1.62 --inner-diameter 1.40 "
        "--cut on-axis --notches 2 --depth 1.36 --height 1 --uncut-length 1 --yes"
    )
    assert made.returncode == 0
    done = shell("notchflex show ü.toml", PYTHONIOENCODING=encoding)
    assert done.returncode == 0
    assert b"mm4" in done.stdout
    document = shell("notchflex show ü.toml --json -", PYTHONIOENCODING=encoding).stdout
    assert json.loads(document.decode("utf-8"))["name"] == "Größe Ω"


def test_answers_in_another_encoding_are_told(shell):
    done = shell(r"printf '\xff\n' | notchflex new x", PYTHONIOENCODING="utf-8:strict")
    assert done.returncode == 2
    assert b"is not text in utf-8" in done.stderr


@pytest.mark.nightly
def test_the_command_that_new_proposes_can_be_pasted(shell):
    made = shell(
        "notchflex new 'q ü' --outer-diameter 1.62 --inner-diameter 1.40 --cut on-axis "
        "--notches 2 --depth 1.36 --height 1 --uncut-length 1 --yes",
        PYTHONIOENCODING="utf-8",
    )
    proposed = made.stdout.decode("utf-8").partition("Look at it with: ")[2].strip()
    assert shell(proposed).returncode == 0
