"""A ROS 2 node around `robot_core`: messages in, messages out, SI units throughout."""

from __future__ import annotations

import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from robot_core import RobotCore
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

import notchflex as nf

BASE, TIP = "base_link", "tip"
NAMESPACE = "notchflex"


class NotchflexNode(Node):
    """A simulated robot that is commanded, steered, and told what its sensors read."""

    def __init__(self) -> None:
        super().__init__(NAMESPACE)
        name = self.declare_parameter("robot", "pacheco2021-a").value
        drive = self.declare_parameter("drive", "tension").value
        rate = self.declare_parameter("rate", 50.0).value
        self.core = RobotCore(nf.load_robot(name), drive)
        self.joints = self.create_publisher(JointState, "~/joint_states", 10)
        self.pose = self.create_publisher(PoseStamped, "~/tip_pose", 10)
        self.wrench = self.create_publisher(WrenchStamped, "~/tip_wrench", 10)
        # Of commands and targets that wait only the last one counts.
        self.create_subscription(Float64MultiArray, "~/commands", self.on_command, 1)
        self.create_subscription(PoseStamped, "~/target", self.on_target, 1)
        self.create_subscription(JointState, "~/measured", self.on_measured, 10)
        self.create_timer(1.0 / rate, self.publish_state)
        # The force takes part of a second, in which the rest goes on.
        beside = MutuallyExclusiveCallbackGroup()
        self.create_timer(1.0, self.publish_wrench, callback_group=beside)

    def on_command(self, message: Float64MultiArray) -> None:
        """Go to tensions (N) or strokes (m)."""
        self.warn("command", self.core.command(list(message.data)))

    def on_target(self, message: PoseStamped) -> None:
        """Bring the tip to a position (m); the orientation is left free."""
        if message.header.frame_id not in ("", BASE):
            self.warn("target", f"frame {message.header.frame_id!r} is not {BASE}")
            return
        place = message.pose.position
        self.warn("target", self.core.steer([place.x, place.y, place.z]))

    def on_measured(self, message: JointState) -> None:
        """Take measured strokes (m) and tensions (N)."""
        read = self.core.read(list(message.name), list(message.position), list(message.effort))
        self.warn("measured", read)

    def publish_state(self) -> None:
        """Publish joints and tip."""
        values, tip = self.core.joints(), self.core.tip()
        joints, pose = JointState(), PoseStamped()
        joints.header.stamp = pose.header.stamp = self.get_clock().now().to_msg()
        joints.header.frame_id = pose.header.frame_id = BASE
        joints.name, joints.position, joints.effort = values.name, values.position, values.effort
        place, turn = pose.pose.position, pose.pose.orientation
        place.x, place.y, place.z = tip.position
        turn.x, turn.y, turn.z, turn.w = tip.orientation
        self.joints.publish(joints)
        self.pose.publish(pose)

    def publish_wrench(self) -> None:
        """Publish the force that the readings tell, if they tell one."""
        felt = self.core.feel()
        if felt is None:
            return
        message = WrenchStamped()
        message.header.stamp, message.header.frame_id = self.get_clock().now().to_msg(), TIP
        force = message.wrench.force
        force.x, force.y, force.z = felt.force
        self.wrench.publish(message)

    def warn(self, what: str, code: str) -> None:
        """Log why something was not done."""
        if code:
            self.get_logger().warning(f"{what}: {code}")


def main() -> None:
    """Run the node until it is interrupted."""
    rclpy.init()
    node = NotchflexNode()
    try:
        rclpy.spin(node, executor=MultiThreadedExecutor(2))
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
