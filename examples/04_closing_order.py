"""My notches get deeper toward the tip: which one closes first, and at what tension?"""

import numpy as np

import notchflex as nf

# Wrist A of Pacheco 2021 with graded depths instead of 1.40 mm everywhere.
depths = (1.36, 1.38, 1.40, 1.42, 1.44)
wrist = nf.load_robot("pacheco2021-a").with_values(
    {f"notch[{number}].depth": depth for number, depth in enumerate(depths, start=1)}
)
found = nf.closing(wrist)

for notch in np.argsort(found.tension):
    print(
        f"notch {notch + 1}, {depths[notch]:.2f} mm deep, closes at "
        f"{found.tension[notch]:.3f} N and {np.degrees(found.angle[notch]):.1f} deg"
    )
