"""The manifest of a sweep: plan and robot, and all else that its bytes depend on."""

from __future__ import annotations

from notchflex.pieces.manifest import Manifest
from notchflex.robot import Robot
from notchflex.robot.robot import from_table, to_table
from notchflex.sweeping.model import SweepModel
from notchflex.sweeping.plan.parts import SweepPlan
from notchflex.sweeping.plan.reading import plan_from_table, plan_table
from notchflex.tolerancing.piece_study import piece_rows

KIND = "sweep"


class SweepManifest(Manifest):
    """Manifest of a sweep."""

    @classmethod
    def of(cls, plan: SweepPlan, robot: Robot, model: SweepModel) -> SweepManifest:
        """Make the manifest of a plan.

        Args:
            plan: The plan.
            robot: The robot that it names.
            model: The model of both.
        """
        table = plan_table(plan)
        return cls.made(
            KIND,
            plan.rows,
            plan.piece or piece_rows(plan.rows, model),
            plan={key: value for key, value in table.items() if key != "robot"},
            robot=to_table(robot),
            columns=list(model.columns),
        )

    @property
    def plan(self) -> SweepPlan:
        """The plan; its robot is only a name."""
        return plan_from_table({**self.document["plan"], "robot": self.document["robot"]["name"]})

    @property
    def robot(self) -> Robot:
        """The robot that is varied."""
        return from_table(self.document["robot"])
