"""Address and access of the page: only who knows its token is answered.

Every user of the machine reaches 127.0.0.1, and so does a page of any site in a browser. The token
is random and part of the printed address. The page keeps it as a cookie, which a browser does not
send for other sites; a page of another port of the same machine is told by its `Origin`.

viser 1.1 has no setting for a check and hands its own `process_request` to `websockets`. Its server
thread looks `websockets.asyncio.server.serve` up when it starts, so that public function is
replaced until the server runs; nothing of viser is changed. If viser starts in another way,
`serve` notices that no check is installed, and refuses to continue.
"""

from __future__ import annotations

import contextlib
import functools
import hmac
import http
import importlib.util
import io
import ipaddress
import secrets
import socket
from collections.abc import Callable, Generator
from http.cookies import CookieError, SimpleCookie
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from notchflex import InputError

if TYPE_CHECKING:
    import viser

HOST, PORT = "127.0.0.1", 8080
INSTALL = "pip install 'notchflex[viewer]'"
NEEDED = ("viser", "trimesh", "manifold3d", "matplotlib", "plotly")


def check_installed() -> None:
    """Check that what the viewer needs is installed.

    Raises:
        InputError: Something is missing; the message says how to install it.
    """
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        plural = "are" if len(missing) > 1 else "is"
        raise InputError.MISSING_PACKAGE(
            f"the viewer needs {', '.join(missing)}, which {plural} not installed: {INSTALL}"
        )


def exposed(host: str) -> str:
    """Return a warning if other machines can reach a host; else "".

    Example:
        >>> exposed("127.0.0.1"), exposed("0.0.0.0")[:28]
        ('', 'the viewer serves on 0.0.0.0')
    """
    with contextlib.suppress(ValueError):
        if host == "localhost" or ipaddress.ip_address(host).is_loopback:
            return ""
    return (
        f"the viewer serves on {host}, not on {HOST} alone, and without encryption: whoever reads "
        "the network or the printed address can use it"
    )


def check_host(host: str, port: int) -> None:
    """Check that a host and a port can be served on.

    Raises:
        InputError: The host is not an address of this machine, or the port is invalid.
    """
    if not 0 < port < 65536:
        raise InputError.OUT_OF_RANGE(f"a port is a whole number from 1 to 65535; got {port}")
    try:
        kind = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(kind, socket.SOCK_STREAM) as probe:
            probe.bind((host, 0))
    except (OSError, UnicodeError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise InputError.NO_CONNECTION(
            f"nothing can be served on {host!r}: {reason}; give an address of this machine, such "
            f"as {HOST}"
        ) from None


_starting = Lock()


def serve(host: str, port: int) -> tuple[viser.ViserServer, str]:
    """Begin to serve on a host and a port, or the next free one; without messages.

    Returns:
        The server, and the address with its token.

    Raises:
        InputError: This version of viser cannot be guarded; nothing is served.
    """
    import viser

    token = secrets.token_urlsafe(24)
    with _guarded(token) as guarded, contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if server.get_port() not in guarded:
        server.stop()
        raise InputError.MISSING_PACKAGE(
            f"viser {viser.__version__} does not let requests be checked, so nothing is served; "
            f"install the version that notchflex asks for: {INSTALL}"
        )
    # A page could ask for a public address, through a server of others.
    server.request_share_url = lambda verbose=True: None
    name = f"[{host}]" if ":" in host else host
    return server, f"http://{name}:{server.get_port()}/?token={token}"


@contextlib.contextmanager
def _guarded(token: str) -> Generator[list[int]]:
    """Check the requests of servers that start inside the `with`; yield their ports."""
    from websockets.asyncio import server as module

    plain = module.serve
    ports: list[int] = []

    def guarded_serve(handler: Any, address: str, port: int, **options: Any) -> Any:
        answer = options.pop("process_request", None)
        ports.append(port)
        check = functools.partial(_answer, token, f"notchflex-{port}", answer)
        return plain(handler, address, port, process_request=check, **options)

    with _starting:
        module.serve = guarded_serve  # type: ignore[assignment,misc]
        try:
            yield ports
        finally:
            module.serve = plain  # type: ignore[misc]


def _answer(
    token: str,
    cookie: str,
    answer: Callable[[Any, Any], Any] | None,
    connection: Any,
    request: Any,
) -> Any:
    """Refuse a request, or pass it on; the page that is opened with the token gets a cookie."""
    headers = request.headers
    in_address = parse_qs(urlsplit(request.path).query).get("token", [""])[-1]
    cookies = SimpleCookie()
    with contextlib.suppress(CookieError):
        cookies.load("; ".join(headers.get_all("Cookie")))
    in_cookie = cookies[cookie].value if cookie in cookies else ""
    known = [hmac.compare_digest(one.encode(), token.encode()) for one in (in_address, in_cookie)]
    own_page = {f"http://{host}" for host in headers.get_all("Host")}
    if not any(known) or not own_page.issuperset(headers.get_all("Origin")):
        text = "Open the address that notchflex printed; it holds a token.\n"
        return connection.respond(http.HTTPStatus.FORBIDDEN, text)
    response = None if answer is None else answer(connection, request)
    if response is not None and known[0]:
        kept = f"{cookie}={token}; Path=/; HttpOnly; SameSite=Strict"
        response.headers["Set-Cookie"] = kept
    return response
