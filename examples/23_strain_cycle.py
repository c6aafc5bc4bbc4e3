"""How far may a wrist bend to and fro under a limit line of fatigue?"""

import numpy as np
from scipy.optimize import brentq

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a-true").with_value("fatigue.line", "cao2020")
free = nf.solve(wrist, nf.Load(tension=0.0))


def smallest_margin(tension):
    """The smallest margin of a cycle between the free wrist and one that is pulled."""
    pulled = nf.solve(wrist, nf.Load(tension=tension))
    return nf.strain_cycle([free, pulled]).smallest_margin.min()


largest = brentq(smallest_margin, 0.1, 1.0, xtol=1e-6)
bent = nf.solve(wrist, nf.Load(tension=largest))
change = np.degrees(bent.total_angle - free.total_angle)
print(f"up to {largest:.3f} N, {change:.1f} deg beyond rest; no number of cycles is predicted")
