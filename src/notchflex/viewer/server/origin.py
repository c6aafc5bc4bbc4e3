"""Checks the addresses of a request: the defence against other pages in the same browser.

A page of another site can send requests to 127.0.0.1, and after DNS rebinding even under its own
name. Browsers send the page in `Origin` and the name that it used in `Host`, and a page can
forge neither.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Sequence
from urllib.parse import urlsplit

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_HTTP = 80  # browsers leave this port out


def refusal(host: str, port: int, asked_for: Sequence[str], asked_by: Sequence[str]) -> str | None:
    """Return why a request is refused, or None if it is allowed.

    Args:
        host: Address that is served on, as the user gave it.
        port: Port that is served on.
        asked_for: Values of the header `Host`.
        asked_by: Values of the header `Origin`; only browsers send it.

    Example:
        >>> refusal("127.0.0.1", 8080, ["localhost:8080"], ["http://localhost:8080"]) is None
        True
        >>> refusal("127.0.0.1", 8080, ["evil.example:8080"], []) is None
        False
    """
    remedy = f"open http://{bracketed(host)}:{port}, with this port also through a tunnel"
    if len(asked_for) != 1 or not _is_served(host, port, asked_for[0]):
        return f"Host {_quoted(asked_for)} is not the address of this viewer; {remedy}"
    if len(asked_by) > 1:
        return f"the request names several origins; {remedy}"
    for origin in asked_by:
        scheme, _, address = origin.partition("://")
        if scheme != "http" or not _is_served(host, port, address):
            return f"Origin {_quoted(asked_by)} is another page; {remedy}"
        # Where every address is served, a page of another address must not pass for this one.
        if _is_wildcard(host) and _parts(address) != _parts(asked_for[0]):
            return f"Origin {_quoted(asked_by)} is another page; {remedy}"
    return None


def bracketed(host: str) -> str:
    """Return a host for an address: IPv6 in brackets."""
    return f"[{host}]" if ":" in host else host


def _is_served(host: str, port: int, address: str) -> bool:
    """Return whether an address such as `localhost:8080` is served."""
    parts = _parts(address)
    if parts is None or parts[1] != port:
        return False
    name = parts[0]
    if name == host.lower() or name in _LOOPBACK:
        return True
    # On all addresses: any number will do, but of names only this machine's own, because
    # rebinding needs a name.
    return _is_wildcard(host) and (_is_number(name) or name in _own_names())


def _parts(address: str) -> tuple[str, int] | None:
    """Return name and port of an address; None if it is invalid."""
    try:
        found = urlsplit(f"//{address}")
        port = found.port
    except ValueError:
        return None
    if found.hostname is None or found.netloc != address or "@" in address:
        return None
    return found.hostname, _HTTP if port is None else port


def _is_number(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_wildcard(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def _own_names() -> set[str]:
    name = socket.gethostname().lower()
    return {name, f"{name}.local"}


def _quoted(values: Sequence[str]) -> str:
    return ", ".join(repr(value) for value in values) or "(missing)"
