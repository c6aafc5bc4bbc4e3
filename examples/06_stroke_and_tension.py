"""My motor commands the stroke in mm: how far does the wrist bend, and what is the tension?"""

from math import degrees

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
path = nf.simulate(wrist, nf.stroke_path(0.0, 3.0, steps=31).release()).raise_if_failed()

# At equal stroke loading and unloading give nearly the same angle, but different tensions.
for millimetres in (1.0, 2.0, 3.0):
    out = round(millimetres / 0.1)
    there, back = path[out], path[-1 - out]
    print(
        f"{millimetres} mm: {degrees(there.total_angle):.2f} deg at {there.tension[0]:.3f} N, "
        f"unloading {degrees(back.total_angle):.2f} deg at {back.tension[0]:.3f} N"
    )
