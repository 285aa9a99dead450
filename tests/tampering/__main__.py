"""Tamper at length, and check genuine certificates: `python -m tests.tampering --tries 24000`.

With `--genuine 300` only genuine certificates are verified: so many of each kind. Run it under
OPENBLAS_CORETYPE=Nehalem and Haswell: slacks must be met on every processor.
"""

import argparse
import sys
import time

import numpy as np

from tests.tampering.table import TABLE
from tests.tampering.trying import attack, genuine


def main():
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--tries", type=int, default=24_000)
    given.add_argument("--genuine", type=int, default=0)
    given.add_argument("--only", choices=TABLE)
    given.add_argument("--seed", type=int, default=0)
    asked = given.parse_args()
    rows = {name: row for name, row in TABLE.items() if asked.only in (None, name)}
    weights = sum(row.weight for row in rows.values())
    failed = total = 0
    for name, row in rows.items():
        start = time.perf_counter()
        if asked.genuine:
            made = [each for _, each in genuine(row, asked.genuine, asked.seed)]
            wrong = sum(not each.verify() for each in made)
            print(f"{name}: {len(made)} genuine, {wrong} not verified", end="")
        else:
            made = [each for _, each in genuine(row, 40, asked.seed)]
            tries = round(asked.tries * row.weight / weights)
            score = attack(row, made, tries, np.random.default_rng(asked.seed))
            wrong = len(score.false) + len(score.raised)
            count = sum(score.tries.values())
            total += count
            print(
                f"{name}: {count} tries on {len(score.tries)} fields (at least "
                f"{min(score.tries.values())} each), {score.accepted} accepted and true, "
                f"{len(score.false)} accepted and false, {len(score.raised)} raised",
                end="",
            )
            for found in score.false[:5] + score.raised[:5]:
                print("\n   ", found[0], "|", found[-1], end="")
        failed += wrong
        print(f"  [{time.perf_counter() - start:.0f} s]", flush=True)
    print(f"{total} tries, {failed} failures")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
