"""Who may talk to the viewer: whoever has its token; others are refused before any data."""

import asyncio
import http.client
import os
import shutil
import socket
import subprocess
import sys
from urllib.parse import quote

import pytest

import notchflex as nf
from refusals import refused

viser = pytest.importorskip("viser", reason="the extra `viewer` is not installed")


@pytest.fixture(scope="module")
def served():
    from notchflex.viewer.server import serve

    server, address = serve("127.0.0.1", 18300)
    server.scene.add_frame("/robot")
    yield server.get_port(), address.rpartition("=")[2]
    server.stop()


def page(port, path="/", **headers):
    """Status, text and cookie of a plain request."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    text = answer.read().decode("utf-8", "replace")
    connection.close()
    return answer.status, text, (answer.getheader("Set-Cookie") or "").partition(";")[0]


def stream(port, origin, query="", cookie=None):
    """Status of a WebSocket, and the bytes of its first message."""
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    options = {"origin": origin, "max_size": None}
    if cookie:
        options["additional_headers"] = {"Cookie": cookie}
    address, protocol = f"ws://127.0.0.1:{port}/{query}", [f"viser-v{viser.__version__}"]
    try:
        with connect(address, subprotocols=protocol, **options) as socket_:
            return 101, len(socket_.recv(timeout=20))
    except InvalidStatus as refused:
        return refused.response.status_code, 0


def test_who_has_the_token_is_answered(served):
    port, token = served
    status, _, cookie = page(port, f"/?token={token}")
    assert status == 200
    assert cookie == f"notchflex-{port}={token}"
    assert page(port, Cookie=f"other=1; {cookie}")[0] == 200
    own = f"http://127.0.0.1:{port}"
    for origin in (own, None):
        assert stream(port, origin, cookie=cookie)[0] == 101
        assert stream(port, origin, f"?token={token}")[1] > 0


@pytest.mark.parametrize("given", ["", "x", "ü"])
def test_who_has_not_is_refused_before_any_data(served, given):
    port, _ = served
    path = f"/?token={quote(given)}"
    status, text, cookie = page(port, path)
    assert (status, cookie) == (403, "")
    assert "token" in text
    assert page(port, Cookie=f"notchflex-{port}={quote(given)}; =;;a")[0] == 403
    for origin in (f"http://127.0.0.1:{port}", None):
        assert stream(port, origin) == (403, 0)
        assert stream(port, origin, path[1:]) == (403, 0)


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://evil.example:{port}",
        "https://127.0.0.1:{port}",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "http://127.0.0.1:{port}@evil.example:{port}",
        "null",
    ],
)
def test_another_page_is_refused_even_with_the_cookie(served, origin):
    """As a page of another port of this machine, to which a browser sends the cookie."""
    port, token = served
    cookie, origin = f"notchflex-{port}={token}", origin.format(port=port)
    assert stream(port, origin, cookie=cookie) == (403, 0)
    assert page(port, Origin=origin, Cookie=cookie)[0] == 403


def test_another_user_of_the_machine_is_refused(served):
    """A second user id reaches the port, but is told nothing."""
    if os.geteuid() != 0:
        pytest.skip("only root can run a program as another user")
    port, _ = served
    code = f"""
import http.client
one = http.client.HTTPConnection("127.0.0.1", {port}, timeout=20)
one.request("GET", "/")
print(one.getresponse().status)
"""
    python = shutil.which("python3", path="/usr/bin") or sys.executable
    other = subprocess.run(
        ["/usr/bin/env", "-i", python, "-c", code],
        user=65534, group=65534, extra_groups=[], cwd="/", capture_output=True, text=True,
    )  # fmt: skip
    if "Permission denied" in other.stderr:
        pytest.skip("the other user cannot run Python")
    assert other.stdout.strip() == "403", other.stderr


def test_a_viser_that_cannot_be_checked_is_not_served(monkeypatch):
    # As if viser took `serve` from another place.
    import types

    import viser.infra._infra as infra
    import websockets

    plain = types.SimpleNamespace(serve=websockets.asyncio.server.serve)
    other = types.SimpleNamespace(
        asyncio=types.SimpleNamespace(server=plain), datastructures=websockets.datastructures
    )
    monkeypatch.setattr(infra, "websockets", other)
    from notchflex.viewer.server import serve

    with refused("MISSING_PACKAGE"):
        serve("127.0.0.1", 18340)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", 18340), timeout=1).close()


def test_serving_leaves_websockets_as_it_was(served):
    import websockets.asyncio.server as module

    assert module.serve.__module__ == module.__name__


def test_the_viewer_is_served_so_and_takes_no_path_from_a_page(tmp_path, monkeypatch):
    from notchflex.viewer import Viewer

    viewer = Viewer(nf.load_robot("pacheco2021-a"), port=18360)
    try:
        at = viewer.server.get_port()
        assert stream(at, None) == (403, 0)
        assert viewer.address.startswith(f"http://127.0.0.1:{at}/?token=")
    finally:
        viewer.server.stop()


def test_a_list_takes_only_what_is_in_it():
    from types import SimpleNamespace

    from notchflex.viewer.page import Input
    from notchflex.viewer.tasks import Tasks

    chosen, listeners = [], []
    handle = SimpleNamespace(value="a", options=("a", "b"), on_update=listeners.append)
    tasks = Tasks()
    Input(SimpleNamespace(tasks=tasks), handle, chosen.append)
    for value in ("b", "/etc/passwd"):
        handle.value = value
        asyncio.run(listeners[0](SimpleNamespace(client=1)))
        while (task := tasks.take()) is not None:
            task()
    assert chosen == ["b"]
