"""A report of 200 grasps: how large it is, how long it takes to draw, and to open in a browser.

`python -m tests.benchmarks.reports [OBJECT] [--limit 200]`; some minutes. Opening is timed by the
browser itself, from the start of the navigation to the end of the page's `load` event, which waits
for every picture that is not left for later.
"""

import argparse
import shutil
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
OPENED = 5
"""Times that each page is opened."""


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("object", nargs="?", default="icosahedron")
    parser.add_argument("--limit", default="200")
    asked = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    try:
        measure(asked.object, asked.limit, folder)
    finally:
        shutil.rmtree(folder)


def measure(name: str, limit: str, folder: Path) -> None:
    started = time.perf_counter()
    words = ["run", name, "--limit", limit, "--limits", "ramp", "--no-report", "-q"]
    graspproof([*words, "--out", str(folder)])
    print(f"planned and simulated in {time.perf_counter() - started:.0f} s")
    started = time.perf_counter()
    report = write_report(folder)
    print(f"{report.grasps} grasps drawn in {time.perf_counter() - started:.0f} s "
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
