"""Who may talk to the viewer: pages of other sites are refused before they are sent anything."""

import http.client
import socket

import pytest

import notchflex as nf
from notchflex.viewer.server import refusal
from refusals import refused

viser = pytest.importorskip("viser", reason="the extra `viewer` is not installed")


@pytest.fixture(scope="module")
def port():
    from notchflex.viewer.server import serve

    server = serve("127.0.0.1", 18300)
    server.scene.add_frame("/robot")
    yield server.get_port()
    server.stop()


def page(port, host=None, origin=None):
    """Status and text of a plain request."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest("GET", "/", skip_host=True)
    for name, value in (("Host", host), ("Origin", origin)):
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text


def stream(port, host, origin):
    """Status of a WebSocket, and all bytes that come in the second after."""
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    raw = socket.create_connection(("127.0.0.1", port), timeout=20)
    options = {"sock": raw, "origin": origin, "max_size": None}
    protocol = [f"viser-v{viser.__version__}"]
    try:
        with connect(f"ws://{host}/", subprotocols=protocol, **options) as socket_:
            return 101, len(socket_.recv(timeout=20))
    except InvalidStatus as refused:
        return refused.response.status_code, 0
    finally:
        raw.close()


def test_the_page_itself_is_welcome(port):
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"LOCALHOST:{port}", f"[::1]:{port}"):
        assert page(port, host)[0] == 200
        status, sent = stream(port, host, f"http://{host}")
        assert status == 101
        assert sent > 0
    assert stream(port, f"localhost:{port}", None)[0] == 101  # a program, not a browser


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://evil.example:{port}",
        "https://127.0.0.1:{port}",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "http://127.0.0.1:{port}.evil.example",
        "http://127.0.0.1:{port}@evil.example:{port}",
        "null",
    ],
)
def test_a_page_of_another_site_is_refused_before_any_data(port, origin):
    origin = origin.format(port=port)
    assert stream(port, f"127.0.0.1:{port}", origin) == (403, 0)
    status, text = page(port, f"127.0.0.1:{port}", origin)
    assert status == 403
    assert f"http://127.0.0.1:{port}" in text  # what to do


@pytest.mark.parametrize(
    "host", ["evil.example:{port}", "127.0.0.1:1", "127.0.0.1", "0.0.0.0:{port}"]
)
def test_another_name_for_this_address_is_refused(port, host):
    host = host.format(port=port)
    assert page(port, host)[0] == 403
    assert stream(port, host, f"http://{host}") == (403, 0)
    assert stream(port, host, None) == (403, 0)


def test_a_request_that_names_no_host_is_refused(port):
    assert page(port)[0] == 403


def test_a_host_that_was_given_is_accepted_with_its_port():
    assert refusal("192.168.0.7", 8080, ["192.168.0.7:8080"], ["http://192.168.0.7:8080"]) is None
    assert refusal("lab.example", 8080, ["lab.example:8080"], ["http://lab.example:8080"]) is None
    assert refusal("lab.example", 80, ["lab.example"], ["http://lab.example"]) is None
    for host in ("lab.example", "lab.example:8081", "192.168.0.8:8080"):
        assert "Host" in refusal("lab.example", 8080, [host], [])


@pytest.mark.parametrize("wildcard", ["0.0.0.0", "::"])
def test_on_all_addresses_any_number_will_do_but_no_other_name_and_no_other_page(wildcard):
    for host in ("192.168.0.7:8080", "[fe80::1]:8080", f"{socket.gethostname()}:8080"):
        assert refusal(wildcard, 8080, [host], [f"http://{host}"]) is None
        assert "Origin" in refusal(wildcard, 8080, [host], ["http://10.0.0.1:8080"])
    assert "Host" in refusal(wildcard, 8080, ["evil.example:8080"], [])


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


def test_serving_leaves_websockets_as_it_was(port):
    import websockets.asyncio.server as module

    assert module.serve.__module__ == module.__name__


def test_the_viewer_is_served_so(monkeypatch):
    from notchflex.viewer import Viewer

    viewer = Viewer(nf.load_robot("pacheco2021-a"), port=18360)
    try:
        at = viewer.server.get_port()
        assert stream(at, f"127.0.0.1:{at}", "http://evil.example") == (403, 0)
    finally:
        viewer.server.stop()
