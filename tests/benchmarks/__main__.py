"""Time of plans and of validations, after their answers were checked.

    python -m tests.benchmarks [--only SECTION ..] [--json FILE]

Sections: planning, validation. Each first checks answers, and ends with an error if they are wrong.
All of it takes some minutes, in one process on one core.
"""

import argparse
import importlib
import json
import os
from pathlib import Path

SECTIONS = ("planning", "validation")
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # before NumPy reads them
    found = []
    print(f"{'median':>12s}  what")
    for section in options.only:
        rows = importlib.import_module(f"tests.benchmarks.{section}").rows()
        found += rows
        print(*map(line, rows), sep="\n", flush=True)
    if options.json:
        options.json.write_text(json.dumps([row.as_json() for row in found], indent=1) + "\n")


def line(row):
    took = duration(row.median_us) if row.median_us else ""
    return f"{took:>12s}  {row.what}  {row.remark}".rstrip()


def duration(microseconds):
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if microseconds >= size:
            return f"{microseconds / size:.3g} {unit}"
    return f"{microseconds:.3g} us"


if __name__ == "__main__":
    main()
