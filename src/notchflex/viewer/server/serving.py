"""A viser server that answers only those who asked for it by its address.

viser 1.1 has no setting for this and hands its own `process_request` to `websockets`. Its server
thread looks `websockets.asyncio.server.serve` up when it starts, so that public function is
replaced until the server stands; nothing of viser is changed. Were viser to start in another way,
`serve` would not see the check put in place, and refuses to go on.
"""

from __future__ import annotations

import contextlib
import functools
import http
import io
from collections.abc import Callable, Generator
from threading import Lock
from typing import TYPE_CHECKING, Any

from notchflex.errors import InputError
from notchflex.viewer.server.address import INSTALL
from notchflex.viewer.server.origin import refusal

if TYPE_CHECKING:
    import viser

_starting = Lock()


def serve(host: str, port: int) -> viser.ViserServer:
    """Begin to serve, in silence and without a way round the host.

    Args:
        host: Address to serve on.
        port: Port to serve on, or the next one that is free.

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
    """Let servers that are started inside the `with` check requests; yields their ports."""
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
    """Refuse a request, or let it be answered as it would be."""
    headers = request.headers
    reason = refusal(host, port, headers.get_all("Host"), headers.get_all("Origin"))
    if reason is not None:
        return connection.respond(http.HTTPStatus.FORBIDDEN, f"{reason}\n")
    return None if answer is None else answer(connection, request)


__all__ = ["serve"]
