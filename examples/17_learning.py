"""What can a policy gain that learns how friction holds the wrist back?"""

import gymnasium
import numpy as np

from notchflex.learning import ScriptedPolicy

# A target moves as the tip of a wrist does that is pulled at random, up and down.
env = gymnasium.make("notchflex/Follow-v0", robot="pacheco2021-a", steps=40)

for friction in (False, True):
    policy, missed = ScriptedPolicy(env, friction=friction), []
    observation, info = env.reset(seed=2)
    for _ in range(40):
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        missed.append(info["distance"])
    knows = "the history" if friction else "all but friction"
    print(f"knows {knows}: misses by {np.median(missed):.3f} mm (median)")

# For learning, many wrists in one call.
envs = gymnasium.make_vec("notchflex/Follow-v0", num_envs=256, steps=40, history=4)
observations, infos = envs.reset(seed=0)
observations, rewards, terminated, truncated, infos = envs.step(np.ones((256, 1)))
print(f"{len(rewards)} wrists, {observations.shape[1]} numbers observed of each")
