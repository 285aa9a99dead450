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

from grasp_core.records import grasps_from_json
from sim_validate.baselines.baseline_file import baseline_from_json
from sim_validate.baselines.comparing import compare
from sim_validate.baselines.measuring import measured, of_settings

FOLDER = Path(__file__).parents[1] / "stability"
WORKERS = 4


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--objects", nargs="+", default=["wedge", "mug", "hex-nut"])
    asked = parser.parse_args()
    others = 0
    for title, check, busy in (
        ("by themselves", checked, 0),
        ("under load", checked, 2 * (os.cpu_count() or 1)),
        (f"pytest -n {WORKERS}", by_pytest, 0),
    ):
        begun, counts = time.perf_counter(), Counter()
        with load(busy):
            for _ in range(asked.times):
                counts.update(check(asked.objects))
        others += sum(count for status, count in counts.items() if status != "same")
        said = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
        took = time.perf_counter() - begun
        print(f"{title}: {asked.times} times: {said} ({took:.0f} s)", flush=True)
    return int(others > 0)


def checked(names: list[str]) -> list[str]:
    """What became of each grasp of some objects, in this process."""
    return [status for name in names for status in statuses(name)]


def statuses(name: str) -> list[str]:
    path = FOLDER / name / f"{name}.baseline.json"
    before = baseline_from_json(path.read_text(), str(path))
    saved = grasps_from_json((path.parent / before.grasps_file).read_text())
    setup, agenda = of_settings(before.settings, str(path))
    after = measured(saved, before.grasps_file, setup, agenda, 1, lambda *_: None).baseline
    return [" ".join([each.status.value, *each.reasons]) for each in compare(before, after)]


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
