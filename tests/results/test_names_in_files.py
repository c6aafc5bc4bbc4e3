"""Arrays in files keep the names of earlier files, whatever the fields of the solver are called."""

import notchflex as nf


def test_contact_forces_keep_their_name(tmp_path):
    path = nf.simulate(nf.load_robot("pacheco2021-a"), nf.pull(0.0, 1.0, steps=2))
    path[1].state.save(tmp_path / "state.json")
    nf.save_path(path, tmp_path / "path.json")
    for file in ("state.json", "path.json"):
        assert ".point.unknowns.lip_force[0]" in (tmp_path / file).read_text(encoding="utf-8")
