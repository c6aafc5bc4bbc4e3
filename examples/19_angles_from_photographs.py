"""How do photographs of a wrist become measurements, and those a friction coefficient?"""

import sys
import tempfile
from pathlib import Path

import cv2

import notchflex as nf

# Photographs of a wrist whose friction is known are rendered here. Take your own instead.
sys.path.append(str(Path(__file__).parents[1] / "tests"))
from photographs.renderer import Scene, render

wrist = nf.load_robot("pacheco2021-a")
pulls = [nf.Load(tension=one) for one in (0.8, 1.5, 0.7)]
path = nf.simulate(wrist.with_value("friction.coefficient", 0.18), pulls)
with tempfile.TemporaryDirectory() as folder:
    files = []
    for tension, angles in zip(path.tension[:, 0], path.notch_angle, strict=True):
        files.append(f"{folder}/wrist_{tension:g}N.png")
        view = Scene(size=(720, 620), scale=46, place=(450, 150), seed=len(files), stripe=80)
        cv2.imwrite(files[-1], render(wrist, angles, view))

    found = nf.measure(files, wrist, pattern="wrist_{tension}N")
    found.write_csv(f"{folder}/measured.csv")
    measured = nf.read_measurements(f"{folder}/measured.csv", wrist, from_rest=False)
    fitted = nf.calibrate(wrist, measured, ["friction.coefficient"], starts=1)

for one in found.photographs:
    off = max(one.notch_angle_deviation)
    print(f"{Path(one.source).name}: {one.reason or 'measured'}, angles to {57.3 * off:.1f} deg")
interval = fitted.intervals["friction.coefficient"]
print(f"friction between {interval.lower:.3f} and {interval.upper:.3f} (drawn with 0.18)")
