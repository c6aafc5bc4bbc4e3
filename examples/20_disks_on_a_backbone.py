"""What do tendons that converge, or wind round the backbone, do to a robot of disks?"""

import numpy as np

import notchflex as nf

robot = nf.load_robot("disks-two-segments")
disks = np.arange(1, 21) / 20
tendons = {
    "parallel": nf.Tendon(10.0, path="straight"),
    "converging": nf.Tendon(10.0, path="straight", disk_radius=tuple(10.0 - 6.0 * disks)),
    "winding": nf.Tendon(10.0, path="straight", disk_direction_deg=tuple(180.0 * disks)),
}
for name, tendon in tendons.items():
    state = nf.solve(robot.replace(tendon=(tendon,)), nf.Load(tension=3.0))
    x, y, z = state.tip_position
    print(f"{name}: tip at {x:.1f}, {y:.1f}, {z:.1f} mm, {state.stroke[0]:.2f} mm of tendon drawn")
