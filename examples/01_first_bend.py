"""How far does this wrist bend when I pull its tendon?"""

from math import degrees

import notchflex as nf

# A ready robot; the path of a robot file of your own does as well.
wrist = nf.load_robot("pacheco2021-a")

# From 0 to 3 N in steps of 0.1 N.  Each step goes on from the one before.
path = nf.simulate(wrist, nf.pull(0.0, 3.0, steps=31))

for newton in (0.5, 1.0, 1.5):
    state = path[round(newton / 0.1)]
    x, _, z = state.tip_position
    print(f"{newton} N: {degrees(state.total_angle):5.1f} deg, tip at x {x:.2f}, z {z:.2f} mm")
