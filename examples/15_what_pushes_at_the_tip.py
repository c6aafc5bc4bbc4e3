"""What pushes at the tip, and what does a tendon that sticks not feel?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")

# Pull the tendon; at the third reading something touches the tip. Then let go a little: it sticks.
tension = np.array([[0.2], [0.4], [0.6], [0.8], [0.784], [0.7]])  # N
push = [0.0, 0.0, 0.01, 0.02, 0.02, 0.02]  # N, along x
touching = tuple(nf.Load(tip_force=(one, 0.0, 0.0)).external for one in push)
read = nf.simulate(wrist, nf.LoadPath(tension, external=touching))

# What tension and stroke tell, with sensors good to 1 mN and 1 µm.
sensors = nf.SensorNoise(tension=0.001, stroke=0.001)
sensed = nf.sense(wrist, read.tension, read.stroke, noise=sensors)
for number, true in enumerate(push):
    low, high = sensed.low[number, 0], sensed.high[number, 0]
    words = "  contact" if sensed.contact[number] else ""
    words += ", sticks" if sensed.stuck[number, 0] else ""
    pulled = f"{tension[number, 0]:.3f} N"
    print(f"{pulled}: pushed by {true:.3f} N, sensed {low:6.3f} to {high:.3f} N{words}")
