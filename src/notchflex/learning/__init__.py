"""Environments of gymnasium for learning to control a robot (`pip install 'notchflex[learn]'`).

Importing this module registers `notchflex/Follow-v0` and `notchflex/Reach-v0`. `gymnasium.make`
imports it by itself where the identifier begins with its name:
`gymnasium.make("notchflex.learning:notchflex/Follow-v0")`.
"""

from notchflex.support import need

need("gymnasium", "learn", "notchflex.learning")

from notchflex.learning.environments import (  # noqa: E402  # noqa: E402
    FollowEnv,
    FollowVectorEnv,
    ReachEnv,
    ReachVectorEnv,
    register_environments,
)
from notchflex.learning.scripted import ScriptedPolicy  # noqa: E402

register_environments()

__all__ = ["FollowEnv", "FollowVectorEnv", "ReachEnv", "ReachVectorEnv", "ScriptedPolicy"]
