"""Draw robots and loads at random, solve them and hold the results against physics.

python benchmarks/independent/run.py --seed 1 --count 60
python benchmarks/independent/run.py --seed 1 --only 17
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import sys
import time
from typing import Any

import numpy as np
from generator import draw_case
from judge_draw import Verdict, judge


def _plain(value: Any) -> Any:
    """Return arrays as lists, for JSON."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def tell(verdict: Verdict, seconds: float) -> None:
    """Print one draw, a line a finding."""
    kind = "refused" if verdict.refused else "ERROR" if verdict.error else "ok"
    kind = "FOUND" if verdict.findings else kind
    print(
        f"{verdict.number:5d} {kind:7s} {verdict.converged}/{verdict.states} "
        f"[{', '.join(verdict.marks)}] first {verdict.first_s:.1f} s again {verdict.again_s:.2f} s "
        f"all {seconds:.0f} s"
    )
    for text in (verdict.refused, verdict.error, *verdict.reasons):
        if text:
            print("      ", text.strip().replace("\n", "\n       "))
    by_name = collections.defaultdict(list)
    for what, step, size, more in verdict.findings:
        by_name[what].append((step, size, more))
    for what, rows in by_name.items():
        step, size, more = max(rows, key=lambda row: np.nan_to_num(row[1], nan=np.inf))
        print(
            f"       ! {what}: {len(rows)} x, first at step {rows[0][0]}, "
            f"most {size:.3g} at step {step}: {more}"
        )
    sys.stdout.flush()


def summary(verdicts: list[Verdict]) -> None:
    """Print how many draws ended how."""
    solved = [verdict for verdict in verdicts if verdict.states]
    kinds = collections.Counter(what for one in verdicts for what in {f[0] for f in one.findings})
    states, converged = sum(v.states for v in solved), sum(v.converged for v in solved)
    print(f"{len(verdicts)} draws: {sum(bool(v.refused) for v in verdicts)} refused,", end=" ")
    print(
        f"{sum(bool(v.error) for v in verdicts)} exceptions, {states} states, "
        f"{converged} converged,"
    )
    print(f"{sum(v.converged < v.states for v in solved)} draws with unconverged states;", end=" ")
    print(f"slowest path when compiled {max((v.again_s for v in solved), default=0):.2f} s")
    for what in ("closed", "stuck", "slack"):
        print(f"{sum(getattr(v, what) for v in solved)} states with something {what};", end=" ")
    print()
    for what, count in kinds.most_common():
        print(f"  {count:4d} draws: {what}")


def main() -> None:
    """Read the options and run."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--count", type=int, default=20)
    options.add_argument("--start", type=int, default=0)
    options.add_argument("--workers", type=int, default=1)
    options.add_argument("--only", type=int, help="one draw, told in full")
    told = options.parse_args()
    numbers = range(told.start, told.start + told.count)
    if told.only is not None:
        case = draw_case(told.seed, told.only)
        print(json.dumps({"robot": case.robot, "loads": case.loads}, default=_plain, indent=1))
        numbers = [told.only]
    jobs = [(told.seed, number) for number in numbers]
    verdicts, began = [], time.perf_counter()
    if told.workers > 1 and len(jobs) > 1:
        with multiprocessing.get_context("spawn").Pool(told.workers, maxtasksperchild=40) as pool:
            results = [pool.apply_async(judge, job) for job in jobs]
            for result in results:
                verdicts.append(result.get())
                tell(verdicts[-1], time.perf_counter() - began)
                began = time.perf_counter()
    else:
        for job in jobs:
            began = time.perf_counter()
            verdicts.append(judge(*job))
            tell(verdicts[-1], time.perf_counter() - began)
    summary(verdicts)
    sys.exit(any(verdict.error or verdict.findings for verdict in verdicts))


if __name__ == "__main__":
    main()
