"""Which depths and heights of the notches bend a wrist to 60 degrees with little strain?"""

import tempfile

import notchflex as nf

plan = {
    "robot": "pacheco2021-a",
    "variable": [
        {"value": "notch.depth", "lower": 1.36, "upper": 1.42},
        {"value": "notch.height", "lower": 0.6, "upper": 1.4},
    ],
    "sampling": {"points": 4096, "seed": 1},
    "load": {"pulled": {"tension": 1.0}},
    "keep": [
        {"quantity": "total_angle", "lower": 55.0, "upper": 65.0},
        {"quantity": "peak_strain", "notch": 1, "upper": 0.04},
    ],
}
with tempfile.TemporaryDirectory() as folder:  # a folder of your own resumes an interrupted sweep
    found = nf.sweep(plan, folder)
    rows = found.lazy().filter(code="accepted").sort("peak_strain_1").collect()
best = rows.row(0, named=True)
print(f"{found.counts['accepted']} of {found.rows} wrists bend to 55-65 deg below 4 % strain")
print(
    f"least strain, {100 * best['peak_strain_1']:.2f} %: depth {best['notch.depth']:.3f} mm, "
    f"height {best['notch.height']:.2f} mm, {best['total_angle_deg']:.1f} deg"
)
