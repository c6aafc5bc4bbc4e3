"""Where the viewer serves, and whether others can reach it there."""

from __future__ import annotations

import importlib.util
import ipaddress
import socket

from notchflex.errors import InputError

HOST, PORT = "127.0.0.1", 8080
INSTALL = "pip install 'notchflex[viewer]'"
NEEDED = ("viser", "trimesh", "manifold3d", "matplotlib")


def check_installed() -> None:
    """Raise if what the viewer needs is not installed.

    Raises:
        InputError: It is not; the message says how to install it.
    """
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        plural = "are" if len(missing) > 1 else "is"
        raise InputError.MISSING_PACKAGE(
            f"the viewer needs {', '.join(missing)}, which {plural} not installed: {INSTALL}"
        )


def is_this_machine_only(host: str) -> bool:
    """Whether only programs of this machine can reach what is served on a host.

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
    """Return the sentence that warns of a host; empty where there is nothing to warn of."""
    if is_this_machine_only(host):
        return ""
    return (
        f"the viewer serves on {host}, not on {HOST} alone: whoever reaches this machine over the "
        "network sees the robot, loads it and can send other robots; there is no password"
    )


def check_host(host: str, port: int) -> None:
    """Raise if nothing can be served on a host.

    Raises:
        InputError: The host is no address of this machine, or the port is none.
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


__all__ = ["HOST", "PORT", "check_host", "check_installed", "exposed", "is_this_machine_only"]
