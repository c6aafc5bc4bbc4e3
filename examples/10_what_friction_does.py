"""How does the coefficient of friction change the bend and the hysteresis loop?"""

import numpy as np

import notchflex as nf

wrist = nf.load_robot("pacheco2021-a")
coefficients = (0.0, 0.1, 0.2, 0.3)
way = nf.pull(0.0, 1.5, steps=31).release()

bends, loops = [], []
for mu in coefficients:
    path = nf.simulate(wrist.with_value("friction.coefficient", mu), way)
    angle = np.degrees(path.total_angle)
    bends.append(angle[30])
    loops.append((angle[::-1] - angle)[:31].max())
    arrives = path.span_tension[30, 0, -1] / path.tension[30, 0]
    print(
        f"mu {mu:.1f}: {bends[-1]:.1f} deg at 1.5 N, loop {loops[-1]:.1f} deg wide, "
        f"{100.0 * arrives:.0f} % of the tension reaches the tip"
    )
