"""Search for false certificates, and print a table: `python -m tests.attacks --share 0.1`.

Each row says how many false certificates were tried and how many verified, and then how many of
them verify when a check is taken out of the checker: none would mean that the search has no teeth.
"""

import argparse
import sys
import time
from collections import Counter

import pytest

from tests.attacks.searching import attacked
from tests.attacks.table import TABLE


def main():
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--share", type=float, default=1.0, help="of the usual number of tries")
    given.add_argument("--seed", type=int, default=0)
    given.add_argument("--only", choices=TABLE)
    asked = given.parse_args()
    total, failed = 0, 0
    print("| class | tries | verified | raised | without a check | s |\n|---|---|---|---|---|---|")
    for name, attack in TABLE.items():
        if asked.only not in (None, name):
            continue
        start, tries = time.perf_counter(), round(asked.share * attack.tries)
        score = attacked(attack, tries, asked.seed)
        pierced = [without(attack, weaken, tries, asked.seed) for weaken in attack.weaken]
        total += sum(score.tries.values())
        failed += len(score.accepted) + len(score.raised)
        print(
            f"| {name} | {sum(score.tries.values())} | {len(score.accepted)} | "
            f"{len(score.raised)} | {', '.join(map(str, pierced))} | "
            f"{time.perf_counter() - start:.0f} |",
            flush=True,
        )
        for what, count in Counter(way for way, _ in score.accepted + score.raised).items():
            print(f"  {what}: {count}")
    print(f"{total} tries, {failed} failures")
    return failed > 0


def without(attack, weaken, tries, seed):
    """How many false certificates verify without a check."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        weaken(monkeypatch)
        return len(attacked(attack, tries, seed).accepted)


if __name__ == "__main__":
    sys.exit(main())
