"""The robots that come with the program, by name; imports little, so that listing them is quick."""

import tomllib
from pathlib import Path

READY = Path(__file__).parent / "robot" / "ready"


def ready_names() -> list[str]:
    """Return the names of the ready robots, sorted."""
    return sorted(path.stem for path in READY.glob("*.toml"))


def list_robots() -> dict[str, str]:
    """List the ready robots.

    Returns:
        The title of every ready robot by the name that `load_robot` takes, sorted by name.

    Example:
        >>> list_robots()["pacheco2021-a"]
        'Pacheco 2021, wrist A'
    """
    return {
        name: str(tomllib.loads((READY / f"{name}.toml").read_text(encoding="utf-8"))["name"])
        for name in ready_names()
    }
