"""How much does a weight at the tip change the bend?"""

from math import degrees

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")  # it stands on its base: z is up

weights = (0.0, 2.0, 5.0)  # g
loads = [nf.Load(tension=0.8, tip_mass=grams) for grams in weights]
path = nf.solve_each(wrist, loads).raise_if_failed()  # each from rest

for grams, state in zip(weights, path, strict=True):
    x, _, z = state.tip_position
    print(f"{grams:.0f} g: {degrees(state.total_angle):5.2f} deg, tip at x {x:.3f}, z {z:.3f} mm")
