"""How much less does a wrist bend in the body than on the bench?"""

import numpy as np

import notchflex as nf

# The plateau was measured at 22 deg C; a data sheet prints the temperature of its test.
bench = nf.load_robot("pacheco2021-a-true").with_value("material.reference_temperature", 22.0)
tensions = (0.8, 1.0, 1.2, 1.5)
angles = {}
for temperature in (22.0, 37.0):
    loads = [nf.Load(tension, temperature=temperature) for tension in tensions]
    angles[temperature] = np.degrees(nf.simulate(bench, loads).total_angle)
for tension, cold, warm in zip(tensions, *angles.values(), strict=True):
    print(f"{tension} N: {cold:.1f} deg at 22 deg C, {warm:.1f} deg at 37 deg C")
