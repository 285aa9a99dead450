"""How soon the first picture can be opened, and a report of 200 grasps: its size, and its times.

`python -m tests.benchmarks.reports [OBJECT] [--limit 200]`; some minutes. The first picture is that
of the README's first command, `graspproof run dodecahedron`, with no compiled code kept, as after
an installation. The processor time is that of a second run, with all processes it starts. Opening
is timed by the browser itself, from the start of the navigation to the end of the page's `load`
event, which waits for every picture that is not left for later.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sim_validate.main import main as graspproof
from sim_validate.parallel.processes import available_cores
from sim_validate.reports.report import write_report
from tests.browser import BROWSER, DRIVER, headless

LOADED = """
const entry = performance.getEntriesByType("navigation")[0];
return [entry.domInteractive, entry.loadEventEnd];
"""
COMMAND = "from sim_validate.main import run_and_exit as r; r()"
README = ("run", "dodecahedron", "-q")
"""The README's first command."""
LOOKED_S = 0.05
"""Time between two looks for the first page [s]."""
OPENED = 5
"""Times that each page is opened."""


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("object", nargs="?", default="icosahedron")
    parser.add_argument("--limit", default="200")
    asked = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    try:
        first_picture(folder / "first")
        measure(asked.object, asked.limit, folder)
    finally:
        shutil.rmtree(folder)


def first_picture(folder: Path) -> None:
    """Run the README's first command twice: with no compiled code kept, and again."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kept")}
    for run in ("first", "second"):
        index = folder / run / "report" / "index.html"
        words = [sys.executable, "-c", COMMAND, *README, "--out", str(folder / run)]
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        process = subprocess.Popen(words, env=environment)
        while process.poll() is None and not index.is_file():
            time.sleep(LOOKED_S)
        opened = time.perf_counter() - started
        if process.wait() != 0 or not index.is_file():
            raise SystemExit(f"{' '.join(README)}: exit code {process.returncode}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(f"{run} run: first page after {opened:.0f} s, all after "
              f"{time.perf_counter() - started:.0f} s, {used:.0f} s of processor time")  # fmt: skip


def measure(name: str, limit: str, folder: Path) -> None:
    started = time.perf_counter()
    words = ["run", name, "--limit", limit, "--limits", "ramp", "--no-report", "-q"]
    graspproof([*words, "--out", str(folder)])
    print(f"planned and simulated in {time.perf_counter() - started:.0f} s")
    started = time.perf_counter()
    report = write_report(folder)
    seconds = time.perf_counter() - started
    print(f"{report.grasps} grasps on {report.drawn} cards drawn in {seconds:.0f} s "
          f"on {available_cores()} cores")  # fmt: skip
    files = [path for path in report.index.parent.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    print(f"{len(files)} files, {size / 1e6:.1f} MB, {size / 1e3 / report.grasps:.0f} kB per grasp")
    if BROWSER and DRIVER:
        opening(report.index, next((report.index.parent / "grasps").iterdir()))


def opening(*pages: Path) -> None:
    browser = headless(tempfile.mkdtemp())
    try:
        for page in pages:
            for _ in range(OPENED):
                browser.get(page.as_uri())
                ready, loaded = browser.execute_script(LOADED)
                print(f"{page.name}: can be used after {ready:.0f} ms, whole after {loaded:.0f} ms")
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
