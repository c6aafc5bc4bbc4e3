"""I measured my cut tube with a calliper: how does it bend, and what tension is allowed?"""

from math import degrees

import numpy as np

import notchflex as nf

# Calliper readings, mm.  A depth is easier measured as what is left: 1.80 - 0.27.
tube = nf.Tube(outer_diameter=1.80, inner_diameter=1.50, base_length=3.0)
notch = nf.ArcNotch("off-axis", depth=1.80 - 0.27, height=0.9, uncut_length=1.1, repeat=5)

mine = nf.Robot(
    name="my wrist",
    tube=tube,
    notch=(notch,),
    tendon=(nf.Tendon(radius=0.75),),  # on the inner wall
    # Not measured: the values fitted to laser-cut nitinol wrists by Pacheco 2021, Table 3.
    material=nf.Superelastic(10_000.0, 3_000.0, 0.028, allowed_strain=0.08),
    friction=nf.Capstan(0.13),
)

path = nf.simulate(mine, nf.pull(0.0, 3.0, steps=31))
closing = nf.closing(mine)
last_safe = int(np.argmax(path.peak_strain.max(axis=1) > mine.material.allowed_strain)) - 1

print(f"at 1 N: {degrees(path[10].total_angle):.1f} deg")
print(f"first notch closes at {closing.tension[0]:.2f} N and {degrees(closing.angle[0]):.1f} deg")
print(f"strain stays allowed up to {path.tension[last_safe, 0]:.1f} N")
