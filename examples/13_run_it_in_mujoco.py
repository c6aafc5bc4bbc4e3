"""Does MuJoCo bend the exported wrist as the chain does, loading and unloading?"""

import tempfile
from pathlib import Path

import mujoco
import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
with tempfile.TemporaryDirectory() as folder:
    exported = nf.export_robot(wrist, Path(folder, "wrist.xml"))
    model = mujoco.MjModel.from_xml_path(exported.file)
data = mujoco.MjData(model)

up = np.linspace(0.0, 1.9, 77)
tension = np.concatenate([up, up[::-1]])
path = nf.simulate(wrist, [nf.Load(tension=float(one)) for one in tension])

angle = np.zeros(len(tension))  # deg
for step, one in enumerate(tension):
    data.ctrl[0] = one
    mujoco.mj_step(model, data, 800)
    angle[step] = np.degrees(data.qpos[:5].sum())

chain = np.degrees(path.total_angle)
for step in (20, 40, 60, 113, 133):
    branch = "loading" if step < 77 else "unloading"
    print(
        f"{tension[step]:.1f} N {branch}: chain {chain[step]:.0f} deg, MuJoCo {angle[step]:.0f} deg"
    )
area = np.trapezoid(angle, tension) / np.trapezoid(chain, tension)
print(f"area of the loop: {area:.2f} of that of the chain")
