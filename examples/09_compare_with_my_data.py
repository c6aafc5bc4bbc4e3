"""I measured the angle of every notch: how far off is the model, and is it the friction?"""

import tempfile
from pathlib import Path

import numpy as np

import notchflex as nf

# What you would have in a file: tension at the base, angle of each notch, base to tip.
MEASURED = """\
tendon_force_N,notch_1_deg,notch_2_deg,notch_3_deg,notch_4_deg,notch_5_deg
0.4,4.3,4.4,4.2,4.3,4.1
0.8,8.7,8.4,8.4,8.0,8.2
1.2,15.8,14.3,13.1,12.2,11.3
1.5,25.1,21.9,19.4,16.9,15.0
"""

wrist = nf.load_robot("pacheco2021-a")
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder, "measured.csv")
    file.write_text(MEASURED, encoding="utf-8")
    measured = nf.read_measurements(file, wrist)

for mu in (0.13, 0.20, 0.27):
    found = nf.compare(wrist.with_value("friction.coefficient", mu), measured)
    notches = " ".join(f"{one:.2f}" for one in np.degrees(found.rmse_notches))
    total = np.degrees(found.rmse_total)
    print(f"mu {mu:.2f}: total off by {total:.2f} deg, notches {notches} deg")
