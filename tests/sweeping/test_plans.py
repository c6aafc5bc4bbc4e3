"""Plans: points of pieces, bad files, 300 mutated files, the schema."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

import notchflex as nf
from mutations import mutated
from notchflex.cli import run
from notchflex.pieces import PieceFolder, Sketch, add_to, scale_of, summed_up
from notchflex.sweeping.sweep import numbers_between

TEMPLATE = Path(nf.__file__).parent / "sweeping" / "template.toml"
TEXT = TEMPLATE.read_text(encoding="utf-8")


def plan(**changes: Any) -> nf.SweepPlan:
    table: dict[str, Any] = {
        "robot": "pacheco2021-a",
        "variable": [
            {"value": "notch.height", "lower": 0.5, "upper": 2.0, "count": 3, "spacing": "log"},
            {"value": "notch.depth", "lower": 1.36, "upper": 1.42},
            {"value": "tube.base_length", "lower": 1.0, "upper": 2.0},
            {"value": "friction.coefficient", "values": [0.2, 0.1]},
        ],
        "sampling": {"points": 50, "seed": 7},
        "load": {"pulled": {"tension": 1.0}},
        "keep": [{"quantity": "total_angle"}],
    }
    return nf.SweepPlan(**(table | changes))


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube"])
def test_rows_are_the_same_in_any_pieces(method):
    chosen = plan(sampling={"points": 50, "seed": 7, "method": method})
    assert chosen.rows == 300
    every = numbers_between(chosen, 0, 300)
    cuts = [0, 7, 8, 49, 101, 160, 299, 300]
    parts = [numbers_between(chosen, a, b) for a, b in itertools.pairwise(cuts)]
    back = [numbers_between(chosen, a, b) for a, b in [*itertools.pairwise(cuts)][::-1]][::-1]
    for name, values in every.items():
        assert (np.concatenate([part[name] for part in parts]) == values).all()
        assert (np.concatenate([part[name] for part in back]) == values).all()


def test_points_are_the_grid_times_those_of_scipy():
    rows = numbers_between(plan(), 0, 300)
    sobol = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(7)).random(64)[:50]
    assert np.allclose(rows["notch.depth"][:50], 1.36 + 0.06 * sobol[:, 0], rtol=0, atol=1e-15)
    assert np.allclose(rows["tube.base_length"][250:], 1.0 + sobol[:, 1], rtol=0, atol=1e-15)
    assert np.allclose(np.unique(rows["notch.height"]), [0.5, 1.0, 2.0])
    assert rows["friction.coefficient"][::50].tolist() == [0.2, 0.1] * 3


def test_merging_in_any_order_and_far_values():
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.normal(3.0, 0.1, 3000), [1e9, -1e300, np.nan, 3.0]])
    scales = {"a": scale_of(values[:500])}
    starts = [0, 10, 500, 1800, len(values)]

    def head(start: int, stop: int) -> dict[str, Any]:
        codes = np.zeros(stop - start, int)
        return summed_up({"a": values[start:stop]}, codes, start, scales, 4)

    made = [json.loads(json.dumps(head(*ends))) for ends in itertools.pairwise(starts)]
    whole: dict[str, Sketch] = {}
    add_to(whole, head(0, len(values)), 4)
    for order in ([0, 1, 2, 3], [3, 1, 0, 2]):
        found: dict[str, Sketch] = {}
        for number in order:
            add_to(found, made[number], 4)
        assert found["a"].smallest == whole["a"].smallest
        assert found["a"].largest == whole["a"].largest
        assert found["a"].counts.sum() == whole["a"].counts.sum()
        parts = np.linspace(0.0, 1.0, 101)
        assert [found["a"].quantile(part) for part in parts] == [
            whole["a"].quantile(part) for part in parts
        ]
    good = values[np.isfinite(values)]
    for part in (0.01, 0.5, 0.99):
        exact = np.quantile(good, part, method="inverted_cdf")
        assert abs(whole["a"].quantile(part) - exact) < 2.0 * scales["a"][1] / 1024
    assert np.isclose(whole["a"].quantile(1.0), 1e9)
    assert Sketch.of(np.full(5, np.nan), 0, scales["a"], 4).count == 0


BAD = {
    "no TOML": (TEXT + "\n[[load", "FILE_UNREADABLE"),
    "unknown key": (TEXT.replace("lower = 1.36", "lowest = 1.36"), "INVALID_SPECIFICATION"),
    "reversed": (TEXT.replace("lower = 1.36", "lower = 1.5"), "INVALID_SPECIFICATION"),
    "no points": (TEXT.replace("points = 10000", "points = 0"), "INVALID_SPECIFICATION"),
    "huge": (TEXT.replace("points = 10000", "points = 10" + "0" * 20), "INVALID_SPECIFICATION"),
    "huge grid": (
        TEXT.replace("10000", "9" * 11).replace(
            "0.2]", "0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1]"
        ),
        "INVALID_SPECIFICATION",
    ),
    "many files": (
        TEXT.replace("# piece = 65536", "piece = 16").replace("= 10000", "= 100000000"),
        "INVALID_SPECIFICATION",
    ),
    "no sampling": (TEXT.replace("[sampling]", "[sample]"), "INVALID_SPECIFICATION"),
    "empty list": (TEXT.replace("[0.0, 0.1, 0.2]", "[]"), "INVALID_SPECIFICATION"),
    "equal values": (TEXT.replace("[0.0, 0.1, 0.2]", "[0.1, 0.1]"), "INVALID_SPECIFICATION"),
    "both forms": (TEXT.replace("[0.0, 0.1, 0.2]", "[0.1]\nupper = 1"), "INVALID_SPECIFICATION"),
    "log of 0": (
        TEXT.replace("values = [0.0, 0.1, 0.2]", 'lower = 0\nupper = 1\nspacing = "log"'),
        "INVALID_SPECIFICATION",
    ),
    "variable twice": (TEXT.replace("notch.height", "notch.depth"), "INVALID_SPECIFICATION"),
    "nan": (TEXT.replace("upper = 1.42", "upper = nan"), "INVALID_SPECIFICATION"),
    "unknown robot": (TEXT.replace("pacheco2021-a", "pacheco2021-x"), "UNKNOWN_NAME"),
    "no load": (TEXT.replace("[load.pulled]", "[loads.pulled]"), "INVALID_SPECIFICATION"),
    "load is no table": (
        TEXT.replace("[load.pulled]", "[load]").replace('"0:1:3"', "1.0"),
        "INVALID_SPECIFICATION",
    ),
    "negative tension": (TEXT.replace('"0:1:3"', "-1.0"), "OUT_OF_RANGE"),
    "reversed limits": (TEXT.replace("lower = 20.0", "lower = 70.0"), "INVALID_SPECIFICATION"),
    "nothing kept": (TEXT.replace("[[keep]]", "[[kept]]"), "INVALID_SPECIFICATION"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_plans(name, tmp_path, wording):
    text, code = BAD[name]
    file = tmp_path / "plan.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(nf.InputError) as caught:
        nf.sweep(file, tmp_path / "swept")
    assert caught.value.code.name == code, caught.value
    wording(f"plan: {name}", str(caught.value).replace(str(tmp_path), ""))
    assert not (tmp_path / "swept").exists()


@pytest.mark.parametrize(
    "seeds", [range(30), pytest.param(range(30, 300), marks=pytest.mark.nightly)]
)
def test_300_mutated_files(seeds, tmp_path, monkeypatch, capsys):
    """Each is refused with code 2 and nothing written, or gets as far as the work on pieces."""
    monkeypatch.chdir(tmp_path)

    class ReachedError(Exception):
        """The plan was accepted."""

    def stop(*_: Any, **__: Any) -> None:
        raise ReachedError

    monkeypatch.setattr(PieceFolder, "run", stop)
    refused = 0
    for seed in seeds:
        Path("plan.toml").write_text(mutated(TEXT, seed), encoding="utf-8")
        try:
            code = run(["sweep", "plan.toml", "-o", "swept"])
        except ReachedError:
            continue
        out, err = capsys.readouterr()
        refused += 1
        assert code == 2, (seed, err)
        assert err.startswith("Error: "), (seed, err)
        assert out == ""
        assert not Path("swept").exists()
    assert refused > len(seeds) // 2


def test_schema_names_every_table(capsys):
    assert run(["schema", "--sweep"]) == 0
    schema = json.loads(capsys.readouterr().out)
    tables = {"variable", "sampling", "load", "keep", "output"}
    assert tables < set(schema["properties"])
    assert "tip_force" in schema["properties"]["load"]["additionalProperties"]["properties"]
