"""Which tensions bend this wrist to an angle and back, when friction holds it on the way back?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
angle = np.radians([20, 40, 60, 40, 20])

# Each target is met from the state that the one before left, with its friction history.
found = nf.follow(wrist, {"total_angle": angle})

# The same tensions as without friction: the wrist stays behind, and more so on the way back.
slick = nf.follow(wrist.with_value("friction.coefficient", 0.0), {"total_angle": angle})
plain = nf.simulate(wrist, slick.load)

missed = np.degrees(plain.total_angle)
for i, target in enumerate(np.degrees(angle)):
    print(
        f"{target:2.0f} deg: {found.tension[i, 0]:.3f} N; {slick.tension[i, 0]:.3f} N, right "
        f"without friction, would give {missed[i]:.1f} deg"
    )
