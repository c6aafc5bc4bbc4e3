"""Four tendons, two axes: where can the tip go?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("two-axis-wrist")

# One or two neighbouring tendons at a time, every direction around the tube, three strengths.
loads = []
for strength in (0.4, 0.8, 1.2):  # N
    for turn in np.radians(np.arange(0.0, 360.0, 30.0)):
        toward = strength * np.array([np.cos(turn), np.sin(turn), -np.cos(turn), -np.sin(turn)])
        loads.append(nf.Load(tension=np.maximum(toward, 0.0).round(12).tolist()))

# All at once, over all cores; each from rest.
found = nf.solve_batch(wrist, loads, outputs=("tip_position", "tip_axis_angle", "converged"))
tip, angle = found["tip_position"], np.degrees(found["tip_axis_angle"])
aside = np.hypot(tip[:, 0], tip[:, 1])

print(f"{found['converged'].sum()} of {len(loads)} loads solved")
for ring, strength in enumerate((0.4, 0.8, 1.2)):
    own = slice(12 * ring, 12 * ring + 12)
    print(
        f"{strength} N: tip {aside[own].min():.2f} to {aside[own].max():.2f} mm aside, "
        f"axis tilted by {angle[own].min():.1f} to {angle[own].max():.1f} deg"
    )
