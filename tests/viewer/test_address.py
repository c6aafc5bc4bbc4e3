"""Where the viewer serves, who is told, and what is said where the extra is missing."""

import importlib.util
import subprocess
import sys

import pytest

from notchflex import InputError
from notchflex.viewer import HOST, check_host, check_installed, exposed
from refusals import refused


def test_this_machine_only_by_default_and_a_warning_otherwise():
    assert HOST == "127.0.0.1"
    for host in (HOST, "localhost", "::1", "127.0.0.2"):
        assert exposed(host) == ""
    for host in ("0.0.0.0", "::", "192.168.0.7", "example.org"):
        assert host in exposed(host)
        assert "without encryption" in exposed(host)


def test_the_default_of_the_viewer_is_this_machine():
    import inspect

    from notchflex.cli.verbs.view import view

    viewer = pytest.importorskip("notchflex.viewer.viewer")
    assert inspect.signature(viewer.Viewer.__init__).parameters["host"].default == HOST
    assert inspect.signature(view).parameters["host"].default == HOST


@pytest.mark.parametrize(
    ("host", "port", "code"),
    [
        ("192.0.2.1", 8080, "NO_CONNECTION"),
        ("no host", 8080, "NO_CONNECTION"),
        (HOST, 0, "OUT_OF_RANGE"),
    ],
)
def test_what_cannot_be_served_is_told(host, port, code):
    with refused(code):
        check_host(host, port)


@pytest.mark.parametrize(
    ("missing", "verb"), [(("viser",), "is"), (("trimesh", "manifold3d"), "are")]
)
def test_a_missing_extra_is_one_sentence_with_the_way_to_get_it(monkeypatch, missing, verb):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name in missing else found(name)
    )
    with pytest.raises(InputError) as told:
        check_installed()
    text = str(told.value)
    assert "pip install 'notchflex[viewer]'" in text
    assert f"{missing[-1]}, which {verb} not installed" in text
    assert "\n" not in text


def test_without_the_extra_the_command_line_says_so():
    code = (
        "import sys; sys.modules['viser'] = None\n"
        "import importlib.util as u; f = u.find_spec\n"
        "u.find_spec = lambda n, *a: None if n == 'viser' else f(n, *a)\n"
        "from notchflex.cli import run; sys.exit(run(['view', 'pacheco2021-a']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "pip install 'notchflex[viewer]'" in done.stderr


@pytest.mark.parametrize("port", ["-1", "0", "http", "99999", "8080.5"])
def test_a_bad_port_is_told(port):
    from notchflex.cli import run

    assert run(["view", "pacheco2021-a", "--port", port]) == 2


def test_importing_the_package_of_the_viewer_needs_nothing_of_it():
    code = (
        "import sys, notchflex.viewer, notchflex.cli.verbs.view\n"
        "print({'viser', 'jax', 'matplotlib', 'trimesh'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=100
    )
    assert done.stdout.strip() == "set()"
