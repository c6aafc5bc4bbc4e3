"""Which dimension of a wrist must be checked so that it bends to 45 deg as it should?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
bend = nf.AcceptanceLimit("total_angle", lower=np.radians(42.0), upper=np.radians(51.0))
tolerances = {
    "notch.depth": {"plus": 0.005, "minus": 0.005, "per_notch": True},
    "tube.inner_diameter": 0.003,
    "material.elastic_modulus": "5 %",
}
spec = nf.ToleranceSpec([bend], {"pulled": nf.Load(tension=0.9)}, tolerances)
found = nf.tolerance_analysis(wrist, spec, draws=6400)

low, high = np.degrees(found.linear.worst_case[0])
first = found.sources[found.order[0]]
print(f"drawing {np.degrees(found.linear.nominal[0]):.1f} deg, worst case {low:.0f} to {high:.0f}")
print(f"{100.0 * found.accepted_fraction:.0f} of 100 wrists are good")
print(f"check {first}: if it were exact, {100.0 * found.control.exact.max():.0f} would be")
