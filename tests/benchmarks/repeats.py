"""Does a check of an unchanged baseline ever come out otherwise?

    python -m tests.benchmarks.repeats [--times 50] [--objects wedge mug hex-nut]

Checks the baselines in `tests/stability` again and again: by themselves, while other processes
keep all processors busy, and by pytest on four workers. Every number of every grasp must be the
same each time; any other answer is listed, and ends it with 1. Some ten minutes on two cores.
"""

import argparse
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sim_validate.baselines.baseline_json import read_baseline
from sim_validate.baselines.check import check, silent
from sim_validate.baselines.settings import of_settings
from sim_validate.records.grasps import read_grasps

FOLDER = Path(__file__).parents[1] / "stability"
WORKERS = 4


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--objects", nargs="+", default=["wedge", "mug", "hex-nut"])
    asked = parser.parse_args()
    others = 0
    for title, way, busy in (
        ("by themselves", checked, 0),
        ("under load", checked, 2 * (os.cpu_count() or 1)),
        (f"pytest -n {WORKERS}", by_pytest, 0),
    ):
        begun, counts = time.perf_counter(), Counter()
        with load(busy):
            for _ in range(asked.times):
                counts.update(way(asked.objects))
        wanted = asked.times * sum(map(grasps_in, asked.objects))
        others += wanted - counts["same"]
        said = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
        took = time.perf_counter() - begun
        print(f"{title}: {asked.times} times: {said} ({took:.0f} s)", flush=True)
    return int(others > 0)


def grasps_in(name: str) -> int:
    return len(read_baseline(FOLDER / name / f"{name}.baseline.json").entries)


def checked(names: list[str]) -> list[str]:
    """What became of each grasp of some objects, in this process."""
    return [status for name in names for status in statuses(name)]


def statuses(name: str) -> list[str]:
    path = FOLDER / name / f"{name}.baseline.json"
    before = read_baseline(path)
    saved = read_grasps(path.parent / before.grasps_file)
    done = check(before, saved, before.grasps_file, of_settings(before.settings, ""), 1, silent)
    return [" ".join([each.status.value, *each.reasons]) for each in done.findings]


def by_pytest(names: list[str]) -> list[str]:
    """The same by the plugin, on several workers."""
    with tempfile.TemporaryDirectory() as folder:
        flags = ("-q", "-n", str(WORKERS), "-p", "no:cacheprovider", "--grasp-report", folder)
        paths = [str(FOLDER / name) for name in names]
        command = [sys.executable, "-m", "pytest", *flags, *paths]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
        found = json.loads((Path(folder) / "report.json").read_text())["grasps"]
    return [line["status"] for line in found]


@contextmanager
def load(processes: int) -> Iterator[None]:
    """Keep processors busy meanwhile."""
    working = [multiprocessing.Process(target=spin, daemon=True) for _ in range(processes)]
    for each in working:
        each.start()
    try:
        yield
    finally:
        for each in working:
            each.kill()


def spin() -> None:
    while True:
        sum(range(100_000))


if __name__ == "__main__":
    sys.exit(main())
