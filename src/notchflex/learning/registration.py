"""The identifiers under which gymnasium makes the environments."""

from __future__ import annotations

IDENTIFIERS = {"notchflex/Follow-v0": "Follow", "notchflex/Reach-v0": "Reach"}
"""Each with the beginning of the names of its classes."""


def register_environments() -> None:
    """Register all environments in gymnasium; those that are registered stay.

    The environments count their steps themselves, so that gymnasium adds no limit: a vector
    environment would have none.
    """
    from gymnasium.envs.registration import register, registry

    for name, begin in IDENTIFIERS.items():
        if name not in registry:
            register(
                id=name,
                entry_point=f"notchflex.learning:{begin}Env",
                vector_entry_point=f"notchflex.learning:{begin}VectorEnv",
            )
