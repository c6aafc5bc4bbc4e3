"""Address and access of the page: other pages in the same browser are refused.

A page of another site can send requests to 127.0.0.1, and after DNS rebinding even under its own
name. Browsers send the page in `Origin` and the name that it used in `Host`, and a page can
forge neither.

viser 1.1 has no setting for a check and hands its own `process_request` to `websockets`. Its server
thread looks `websockets.asyncio.server.serve` up when it starts, so that public function is
replaced until the server runs; nothing of viser is changed. If viser starts in another way,
`serve` notices that no check is installed, and refuses to continue.
"""

from __future__ import annotations

import contextlib
import functools
import http
import importlib.util
import io
import ipaddress
import socket
from collections.abc import Callable, Generator, Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from notchflex.errors import InputError

if TYPE_CHECKING:
    import viser

HOST, PORT = "127.0.0.1", 8080
INSTALL = "pip install 'notchflex[viewer]'"
NEEDED = ("viser", "trimesh", "manifold3d", "matplotlib")


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


def is_this_machine_only(host: str) -> bool:
    """Return whether only programs on this machine can reach a host.

    Example:
        >>> is_this_machine_only("127.0.0.1"), is_this_machine_only("0.0.0.0")
        (True, False)
    """
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def exposed(host: str) -> str:
    """Return a warning if other machines can reach a host; else ""."""
    if is_this_machine_only(host):
        return ""
    return (
        f"the viewer serves on {host}, not on {HOST} alone: whoever reaches this machine over the "
        "network sees the robot, loads it and can send other robots; there is no password"
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


_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_HTTP = 80  # browsers leave this port out
_starting = Lock()


def serve(host: str, port: int) -> viser.ViserServer:
    """Begin to serve on a host and a port, or the next free one; without messages.

    Raises:
        InputError: This version of viser cannot be guarded; nothing is served.
    """
    import viser

    with _guarded(host) as guarded, contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if server.get_port() not in guarded:
        server.stop()
        raise InputError.MISSING_PACKAGE(
            f"viser {viser.__version__} does not let requests be checked, so nothing is served; "
            f"install the version that notchflex asks for: {INSTALL}"
        )
    # A page could ask for a public address, through a server of others.
    server.request_share_url = lambda verbose=True: None
    return server


@contextlib.contextmanager
def _guarded(host: str) -> Generator[list[int]]:
    """Check the requests of servers that start inside the `with`; yield their ports."""
    from websockets.asyncio import server as module

    plain = module.serve
    ports: list[int] = []

    def guarded_serve(handler: Any, address: str, port: int, **options: Any) -> Any:
        answer = options.pop("process_request", None)
        ports.append(port)
        check = functools.partial(_answer, host, port, answer)
        return plain(handler, address, port, process_request=check, **options)

    with _starting:
        module.serve = guarded_serve  # type: ignore[assignment,misc]
        try:
            yield ports
        finally:
            module.serve = plain  # type: ignore[misc]


def _answer(
    host: str, port: int, answer: Callable[[Any, Any], Any] | None, connection: Any, request: Any
) -> Any:
    """Refuse a request, or pass it on."""
    headers = request.headers
    reason = refusal(host, port, headers.get_all("Host"), headers.get_all("Origin"))
    if reason is not None:
        return connection.respond(http.HTTPStatus.FORBIDDEN, f"{reason}\n")
    return None if answer is None else answer(connection, request)


def refusal(host: str, port: int, asked_for: Sequence[str], asked_by: Sequence[str]) -> str | None:
    """Return why a request to a served host and port is refused, or None if it is allowed.

    `asked_for` are the values of the header `Host`, `asked_by` those of `Origin`, which only
    browsers send.

    Example:
        >>> refusal("127.0.0.1", 8080, ["localhost:8080"], ["http://localhost:8080"]) is None
        True
        >>> refusal("127.0.0.1", 8080, ["evil.example:8080"], []) is None
        False
    """
    remedy = f"open http://{bracketed(host)}:{port}, with this port also through a tunnel"
    if len(asked_for) != 1 or not _is_served(host, port, asked_for[0]):
        names = ", ".join(map(repr, asked_for)) or "(missing)"
        return f"Host {names} is not the address of this viewer; {remedy}"
    if len(asked_by) > 1:
        return f"the request names several origins; {remedy}"
    for origin in asked_by:
        scheme, _, address = origin.partition("://")
        # Where every address is served, a page of another address must not pass for this one.
        another = _is_wildcard(host) and _parts(address) != _parts(asked_for[0])
        if scheme != "http" or another or not _is_served(host, port, address):
            return f"Origin {origin!r} is another page; {remedy}"
    return None


def bracketed(host: str) -> str:
    """Return a host for an address: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


def _is_served(host: str, port: int, address: str) -> bool:
    """Return whether an address such as `localhost:8080` is served."""
    name, at = _parts(address)
    if at != port:
        return False
    if name == host.lower() or name in _LOOPBACK:
        return True
    # On all addresses: any number will do, but of names only this machine's own, because
    # rebinding needs a name.
    machine = socket.gethostname().lower()
    return _is_wildcard(host) and (
        _number(name) is not None or name in (machine, f"{machine}.local")
    )


def _parts(address: str) -> tuple[str, int]:
    """Return name and port of an address; "" and 0 if it is invalid."""
    try:
        split = urlsplit(f"//{address}")
        port = split.port
    except ValueError:
        return "", 0
    if split.hostname is None or split.netloc != address or "@" in address:
        return "", 0
    return split.hostname, _HTTP if port is None else port


def _number(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _is_wildcard(host: str) -> bool:
    number = _number(host)
    return number is not None and number.is_unspecified
