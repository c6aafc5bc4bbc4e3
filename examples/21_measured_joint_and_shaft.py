"""What does a measured joint do in a chain, and a wrist on a flexible shaft of another material?"""

import numpy as np

import notchflex as nf

# A joint on a test bench: its angle under a moment, to one side.
angle, moment = (3.0, 7.0, 12.0, 18.0, 25.0), (1.1, 2.3, 3.5, 4.6, 5.5)
joint = nf.TableNotch(2.0, angle_deg=angle, moment=moment, uncut_length=4.0, repeat=4)
chain = nf.Robot(
    name="measured joints",
    tube=nf.Tube(4.0, 3.2),
    notch=(joint,),
    tendon=(nf.Tendon(1.4),),
    material=nf.Linear(70e3),
    friction=nf.Capstan(0.1),
)
path = nf.simulate(chain, nf.pull(0.0, 4.0, steps=5))
for tension, total, why in zip(path.tension[:, 0], path.total_angle, path.reason, strict=True):
    print(f"{tension:.0f} N: {np.degrees(total):.1f} deg" if not why else f"{tension:.0f} N: {why}")

# Wrist A on 30 mm of steel tube with a spiral cut, known by its stiffness: N mm/rad and N/mm.
wrist = nf.load_robot("pacheco2021-a")
steel = nf.Linear(190e3, density=7900.0)
sleeve = nf.TableNotch(
    10.0,
    stiffness=(55.0, 55.0, 40.0, 6.6, 6.6, 900.0),
    uncut_length=0.0,
    tube=nf.Tube(1.80, 1.50),
    material=steel,
    repeat=3,
)
both = wrist.replace(
    name="wrist on a shaft", notch=(sleeve, *wrist.notch), tendon=(nf.Tendon(0.7),)
)
for name, robot in (("wrist alone", wrist), ("with the shaft", both)):
    state = nf.solve(robot, nf.Load(tension=1.0))
    wrist_angle = np.degrees(state.notch_angle[-5:].sum())
    print(f"{name}: the wrist bends {wrist_angle:.2f} deg, all {np.degrees(state.total_angle):.2f}")
slope = nf.solve(both, nf.Load(tension=1.0)).path.jacobian(["notch[1].stiffness_factor"])
by_factor = np.degrees(slope["total_angle"][0, 0])
print(f"1 % more stiffness of its first third changes the angle by {0.01 * by_factor:+.4f} deg")
