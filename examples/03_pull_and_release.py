"""Why does the wrist bend more during unloading than during loading, at the same tension?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
path = nf.simulate(wrist, nf.pull(0.0, 1.5, steps=31).release())

angle = np.degrees(path.total_angle)
loading, unloading = angle[:31], angle[::-1][:31]  # both from 0 to 1.5 N
width = unloading - loading
widest = int(np.argmax(width))
at_tip = path.span_tension[:, 0, -1]  # tension in the last gap

print(f"the hysteresis loop is widest at {path.tension[widest, 0]:.2f} N: {width[widest]:.1f} deg")
print(f"  loading:   {loading[widest]:.1f} deg, {at_tip[widest]:.2f} N at the tip")
print(f"  unloading: {unloading[widest]:.1f} deg, {at_tip[::-1][widest]:.2f} N at the tip")
