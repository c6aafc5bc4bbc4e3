"""Where can the tip go, if no fibre may be strained by more than 4 %?"""

import numpy as np

import notchflex as nf

for name in ("pacheco2021-a", "pacheco2021-b", "pacheco2021-c"):
    wrist = nf.load_robot(name)
    free = nf.workspace(wrist, states=2048)  # until every notch is closed
    careful = nf.workspace(wrist, states=2048, limits={"strain": 0.04})
    print(
        f"{wrist.name}: bends to {np.degrees(free.angle.max()):.0f} deg, within the limit to "
        f"{np.degrees(careful.angle.max()):.1f} deg at {careful.tension.max():.2f} N; "
        f"hysteresis moves the tip by up to {np.nanmax(careful.hysteresis):.2f} mm"
    )
