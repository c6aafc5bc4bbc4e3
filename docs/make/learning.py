"""Draws the picture of the page on learning: one episode of two scripted policies.

`python docs/make/learning.py`.
"""

from __future__ import annotations

import gymnasium
import numpy as np
from matplotlib.axes import Axes
from pictures import picture

from notchflex.learning import ScriptedPolicy
from notchflex.plotting.style import BLUE, GREY, VERMILLION

STEPS, SEED = 100, 0


def episode(*, friction: bool) -> np.ndarray:
    """Target and tip along x, distance from the target (mm) and tension (N) of every step."""
    env = gymnasium.make("notchflex/Follow-v0", steps=STEPS)
    settings = env.unwrapped.settings
    policy, rows = ScriptedPolicy(env, friction=friction), []
    observation, _ = env.reset(seed=SEED)
    for _ in range(STEPS):
        aimed = settings.length * observation[-3]
        observation, _, _, _, info = env.step(policy(observation))
        tip, tension = settings.length * observation[1], settings.largest[0] * observation[0]
        rows.append((aimed, tip, info["distance"], tension))
    return np.array(rows).T


@picture("learning.svg", 8.6, 3.4, 3)
def main(*axes: Axes) -> None:
    """An episode: where the tip is, how far from its target, and the tension."""
    for name, friction, colour in (
        ("knows all but friction", False, VERMILLION),
        ("knows the history", True, BLUE),
    ):
        target, tip, distance, tension = episode(friction=friction)
        if not friction:
            axes[0].plot(target, color=GREY, lw=4.0, alpha=0.4, label="target")
        axes[0].plot(tip, color=colour, lw=1.2, label=name)
        axes[1].semilogy(np.maximum(distance, 1e-8), color=colour, lw=1.2)
        axes[2].plot(tension, color=colour, lw=1.2)
        print(f"{name}: median {np.median(distance):.2g} mm")
    labels = "tip position x [mm]", "distance from the target [mm]", "tension [N]"
    for place, label in zip(axes, labels, strict=True):
        place.set(xlabel="step", ylabel=label)
    axes[0].figure.legend(loc="outside lower center", ncols=3)


if __name__ == "__main__":
    main()
