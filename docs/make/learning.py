"""Draws the picture of the page on learning: one episode of two scripted policies.

`python docs/make/learning.py`.
"""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np

from notchflex.learning import ScriptedPolicy
from notchflex.plotting.style import BLUE, GREY, VERMILLION, house_style, new_figure, save

IMAGES = Path(__file__).resolve().parents[1] / "images"
STEPS, SEED = 100, 0
POLICIES = {"knows all but friction": (False, VERMILLION), "knows the history": (True, BLUE)}


def one_episode(*, friction: bool) -> dict[str, np.ndarray]:
    """Tip and target along x, distance from the target (mm) and tension (N) of every step."""
    env = gymnasium.make("notchflex/Follow-v0", steps=STEPS)
    settings = env.unwrapped.settings
    policy, rows = ScriptedPolicy(env, friction=friction), []
    observation, _ = env.reset(seed=SEED)
    for _ in range(STEPS):
        aimed = settings.length * observation[-3]
        observation, _, _, _, info = env.step(policy(observation))
        tip, tension = settings.length * observation[1], settings.largest[0] * observation[0]
        rows.append((aimed, tip, info["distance"], tension))
    names = "target", "tip", "distance", "tension"
    return dict(zip(names, np.array(rows).T, strict=True))


def two_policies() -> None:
    """An episode: where the tip is, how far from its target, and the tension."""
    with house_style():
        figure = new_figure(8.6, 3.4)
        axes = figure.subplots(1, 3)
        for name, (friction, colour) in POLICIES.items():
            found = one_episode(friction=friction)
            if not friction:
                axes[0].plot(found["target"], color=GREY, lw=4.0, alpha=0.4, label="target")
            axes[0].plot(found["tip"], color=colour, lw=1.2, label=name)
            axes[1].semilogy(np.maximum(found["distance"], 1e-8), color=colour, lw=1.2)
            axes[2].plot(found["tension"], color=colour, lw=1.2)
            print(f"{name}: median {np.median(found['distance']):.2g} mm")
        labels = "tip position x [mm]", "distance from the target [mm]", "tension [N]"
        for one, label in zip(axes, labels, strict=True):
            one.set(xlabel="step", ylabel=label)
        figure.legend(loc="outside lower center", ncols=3)
        save(figure, IMAGES / "learning.svg")


if __name__ == "__main__":
    two_policies()
