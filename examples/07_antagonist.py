"""Two tendons against each other: how much bend does the second one take from the first?"""

from math import degrees

import notchflex as nf

# Notches toward x and away from it in turn; one tendon on either side.
notches = tuple(
    nf.ArcNotch("on-axis", depth=1.36, height=0.8, uncut_length=0.8, direction_deg=side)
    for side in (0.0, 180.0, 0.0, 180.0, 0.0, 180.0)
)
wrist = nf.Robot(
    name="both ways",
    tube=nf.Tube(1.62, 1.40),
    notch=notches,
    tendon=(nf.Tendon(0.70), nf.Tendon(0.70, direction_deg=180.0)),
    material=nf.Superelastic(10_000.0, 3_000.0, 0.028),
    friction=nf.Capstan(0.13),
)

pretensions = (0.0, 0.3, 0.6)
loads = [nf.Load(tension=(1.0, other)) for other in pretensions]
path = nf.solve_each(wrist, loads).raise_if_failed()  # each from rest

for other, state in zip(pretensions, path, strict=True):
    toward, away = state.notch_angle[0::2].sum(), state.notch_angle[1::2].sum()
    print(
        f"1.0 N against {other} N: {degrees(state.total_angle):5.2f} deg "
        f"({degrees(toward):.2f} toward x, {degrees(away):.2f} away from it)"
    )
