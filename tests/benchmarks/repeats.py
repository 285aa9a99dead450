"""Does a check of an unchanged baseline ever come out otherwise?

    python -m tests.benchmarks.repeats [--times 50] [--objects wedge mug hex-nut]

Records the baselines in `tests/stability` anew, as another processor may have recorded them, and
checks them again and again: by themselves, while other processes keep all processors busy, and by
pytest on four workers. Every number of every grasp must be the same each time; any other answer is
listed, and ends it with 1. Some ten minutes on two cores.
"""

import argparse
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sim_validate.baselines.baseline import read_baseline
from sim_validate.baselines.check import check, silent
from sim_validate.baselines.part import Present
from sim_validate.baselines.settings import of_settings
from sim_validate.records.grasps import read_grasps

FOLDER = Path(__file__).parents[1] / "stability"
WORKERS = 4


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--objects", nargs="+", default=["wedge", "mug", "hex-nut"])
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folders = recorded(asked.objects, Path(place))
        return int(repeated(folders, asked.times) > 0)


def repeated(folders: list[Path], times: int) -> int:
    """Check baselines in several ways, say what came of it, and count what was not the same."""
    others = 0
    for title, way, busy in (
        ("by themselves", checked, 0),
        ("under load", checked, 2 * (os.cpu_count() or 1)),
        (f"pytest -n {WORKERS}", by_pytest, 0),
    ):
        begun, counts = time.perf_counter(), Counter()
        with load(busy):
            for _ in range(times):
                counts.update(way(folders))
        wanted = times * sum(map(grasps_in, folders))
        others += wanted - counts["same"]
        said = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
        took = time.perf_counter() - begun
        print(f"{title}: {times} times: {said} ({took:.0f} s)", flush=True)
    return others


def recorded(names: list[str], place: Path) -> list[Path]:
    """Copies of the folders of some objects, their baselines recorded by this machine."""
    for name in names:
        shutil.copytree(FOLDER / name, place / name)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--grasp-bless"]
    subprocess.run([*command, str(place)], stdout=subprocess.DEVNULL, check=True)
    return [place / name for name in names]


def baseline_in(folder: Path) -> Path:
    return folder / f"{folder.name}.baseline.json"


def grasps_in(folder: Path) -> int:
    return len(read_baseline(baseline_in(folder)).entries)


def checked(folders: list[Path]) -> list[str]:
    """What became of each grasp of some objects, in this process."""
    return [status for folder in folders for status in statuses(folder)]


def statuses(folder: Path) -> list[str]:
    path = baseline_in(folder)
    before = read_baseline(path)
    saved = read_grasps(path.parent / before.grasps_file)
    how = of_settings(before.settings, "")
    done = check(before, Present(saved), before.grasps_file, how, 1, silent)
    return [" ".join([each.status.value, *each.reasons]) for each in done.findings]


def by_pytest(folders: list[Path]) -> list[str]:
    """The same by the plugin, on several workers."""
    with tempfile.TemporaryDirectory() as folder:
        flags = ("-q", "-n", str(WORKERS), "-p", "no:cacheprovider", "--grasp-report", folder)
        paths = [str(each) for each in folders]
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
