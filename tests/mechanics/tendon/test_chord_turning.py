"""Corner friction that turns with chords, on notches that have none."""

import numpy as np

import notchflex as nf

ARC = nf.ArcNotch("on-axis", depth=1.40, height=0.8, uncut_length=1.2, repeat=2)


def arcs(friction: nf.Corner) -> nf.Robot:
    return nf.Robot(
        name="arcs with a straight tendon",
        tube=nf.Tube(1.62, 1.40),
        notch=(ARC,),
        tendon=(nf.Tendon(0.70, path="straight"),),
        material=nf.Linear(10_000.0),
        friction=friction,
    )


def test_arcs_turn_with_the_body():
    """It ended in an AssertionError; a notch that is no strip has no chord."""
    chord = nf.solve(arcs(nf.Corner(0.1, "chord")), nf.Load(tension=1.0))
    slope = nf.solve(arcs(nf.Corner(0.1, "slope")), nf.Load(tension=1.0))
    assert chord.converged
    assert np.array_equal(chord.notch_angle, slope.notch_angle)
    changed = arcs(nf.Corner(0.1)).with_value("friction.turning", "chord")
    assert nf.solve(changed, nf.Load(tension=1.0)).converged
