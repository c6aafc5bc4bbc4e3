"""How much tension and stroke does the sheath before a wrist take, straight and bent?"""

from math import degrees

import notchflex as nf

# One metre of sheath with a steel wire of 0.3 mm leads to the wrist.
wrist = nf.load_robot("pacheco2021-a").with_values(
    {
        "tendon.sheath_length": 1000.0,  # mm
        "tendon.sheath_friction": 0.15,
        "tendon.sheath_bend_deg": 180.0,
        "tendon.sheath_wire_stiffness": 14137.0,  # N, E A
    }
)

# Pull at the drive, and let go until base and tip move.
loop = nf.simulate(wrist, [nf.Load(tension=t) for t in (1.5, 1.0, 0.8, 0.6, 0.58, 0.5)])
for state in loop:
    drive, base = state.tension[0], state.base_tension[0]
    lost = state.stroke[0] - state.base_stroke[0]
    angle = degrees(state.total_angle)
    print(f"drive {drive:.2f} N, base {base:.3f} N, wire {lost:.4f} mm longer: {angle:.2f} deg")

# The same pull with the shaft straight, at a right angle and in a loop.
for bend in (0.0, 90.0, 360.0):
    bent = nf.solve(wrist, nf.Load(tension=1.5, sheath_bend_deg=bend))
    print(f"bent by {bend:3.0f} deg: {degrees(bent.total_angle):5.1f} deg")
