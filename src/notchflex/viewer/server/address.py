"""The address of the viewer, and whether other machines can reach it."""

from __future__ import annotations

import importlib.util
import ipaddress
import socket

from notchflex.errors import InputError

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
