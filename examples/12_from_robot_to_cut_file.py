"""What does the laser shop need to cut this wrist, and what does an uncompensated kerf cost?"""

import tempfile
from pathlib import Path

import ezdxf
import numpy as np

import notchflex as nf

wrist, kerf = nf.load_robot("pacheco2021-a"), 0.025
with tempfile.TemporaryDirectory() as folder:
    options = nf.PatternOptions(kerf=kerf, two_axis=True)
    done = nf.export_robot(wrist, Path(folder, "wrist.dxf"), options)
    drawing = ezdxf.readfile(done.file)
cuts = [np.array(one.get_points("xy")) for one in drawing.query('LWPOLYLINE[layer=="CUT"]')]
window = np.ptp(cuts[0], axis=0)
print(f"{len(cuts)} cuts, the path of each {window[0]:.3f} mm by {window[1]:.3f} mm")
print(f"thinnest web {done.facts['thinnest_web_mm']:.3f} mm, warnings: {len(done.warnings)}")

# A shop that follows the nominal edges without compensation makes every window a kerf larger.
half = np.arccos(1.0 - 1.4 / 0.81)
wider = 0.81 * (1.0 - np.cos(half + 0.5 * kerf / 0.81))
changes = {"notch.depth": wider, "notch.height": 0.8 + kerf, "notch.uncut_length": 1.2 - kerf}
made = wrist.with_values(changes)
bends = [np.degrees(nf.solve(one, nf.Load(tension=1.0)).total_angle) for one in (wrist, made)]
print(f"at 1 N it then bends {bends[1]:.1f} deg instead of {bends[0]:.1f} deg")
