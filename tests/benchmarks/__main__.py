"""Time beside what a user would otherwise run, after everybody's answers agreed.

    python -m tests.benchmarks [--only SECTION ..] [--json FILE]

Sections: enumeration, families, planning, metrics, validation. Each first compares answers, and
ends with an error if they differ. All of it takes some minutes, in one process on one core.
"""

import argparse
import importlib
import json
import os
from pathlib import Path

SECTIONS = ("enumeration", "families", "planning", "metrics", "validation")
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # before NumPy reads them
    found = []
    print(f"{'median':>12s}  {'ratio (95 %)':>22s}  what")
    for section in options.only:
        rows = importlib.import_module(f"tests.benchmarks.{section}").rows()
        found += rows
        print(*map(line, rows), sep="\n", flush=True)
    if options.json:
        options.json.write_text(json.dumps([row.as_json() for row in found], indent=1) + "\n")


def line(row):
    ratio = f"{row.ratio:.1f} ({row.low:.1f} .. {row.high:.1f})" if row.ratio else ""
    took = duration(row.median_us) if row.median_us else ""
    return f"{took:>12s}  {ratio:>22s}  {row.what}  {row.remark}".rstrip()


def duration(microseconds):
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if microseconds >= size:
            return f"{microseconds / size:.3g} {unit}"
    return f"{microseconds:.3g} us"


if __name__ == "__main__":
    main()
