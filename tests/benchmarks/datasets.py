"""A dataset from end to end: grasps per second and core, shares of the work, bytes per grasp.

    python -m tests.benchmarks.datasets --out DIR [OBJECTS ..] [--limit 20] [--jobs 2]

Without OBJECTS, all built-in ones. The dataset is built, verified with a sample done again, and
loaded; then one unit of every third object is profiled in this process for the shares.
"""

import argparse
import cProfile
import os
import pstats
import time
from pathlib import Path

import sim_validate
from grasp_core.processes import local_processes
from scenes.example_objects import example_names
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.make_unit import made_of
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.parquet import parquet_bytes
from sim_validate.datasets.units import body_of, units_of
from sim_validate.datasets.verify import Sample, verify

FRICTIONS = (0.3, 0.5)
PROFILED = 3
"""One object out of so many."""
KINDS = {
    "planning": [("planner.py", "plan")],
    "stepping": [("simulate.py", "run")],
    "rest of validation": [("validation.py", "validate")],
    "writing": [("datasets.py", "written")],
}
"""Each kind less what it holds of the others."""
INSIDE = {"rest of validation": ("stepping",)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--limit", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    built_in = [name for name in example_names() if "FACES" not in name]
    config = DatasetConfig(
        objects=tuple(options.objects or built_in), frictions=FRICTIONS, limit=options.limit
    )
    report_build(config, options.out, options.jobs)
    report_reading(options.out)
    report_shares(config)


def report_build(config, out, jobs):
    began = time.perf_counter()
    with local_processes(jobs) as engine:
        built = build(config, out, engine, lambda *_: None, 3600.0)
    took = time.perf_counter() - began
    assert built.made == built.units, f"{out}: was begun before; give a new --out"
    grasps = sim_validate.load_dataset(out)["grasps"]
    mine = grasps["label"] == "grasp"
    size = sum(each.bytes for each in read_manifest(out).files)
    print(f"{built.units} units, {built.quarantined} quarantined, {took:.0f} s on {jobs} processes")
    print(f"{mine.sum()} grasps, {(~mine).sum()} controls, {built.rows['trials']} trials")
    print(f"{mine.sum() / took / jobs:.2f} grasps per second and core, controls included")
    print(f"{size / mine.sum():.0f} bytes per grasp with its controls, {size / 1e6:.2f} MB in all")
    print(f"held: {grasps['held'][mine].sum()} of {mine.sum()} grasps")
    print(f"held: {grasps['held'][~mine].sum()} of {(~mine).sum()} controls")
    print(f"mismatches: {grasps['mismatches'].sum()}")


def report_reading(out):
    began = time.perf_counter()
    faults = verify(out)
    checked = time.perf_counter()
    again = verify(out, Sample(0.01))
    print(f"verified in {checked - began:.1f} s, with 1 % done again in ", end="")
    print(f"{time.perf_counter() - checked:.1f} s: {len(faults)} and {len(again)} faults")
    assert not faults + again


def report_shares(config):
    units = sorted(units_of(config), key=lambda unit: (unit.object, unit.friction))
    chosen = [unit for unit in units if unit.friction == FRICTIONS[-1]][::PROFILED]
    made_of(chosen[0], body_of(chosen[0]))  # compiled code is loaded
    profile = cProfile.Profile()
    profile.enable()
    for unit in chosen:
        written(made_of(unit, body_of(unit)))
    profile.disable()
    spent, total = dict.fromkeys(KINDS, 0.0), 0.0
    for (path, _, function), (*_, cumulative, _) in pstats.Stats(profile).stats.items():
        total = max(total, cumulative)
        for kind, members in KINDS.items():
            if (Path(path).name, function) in members:
                spent[kind] += cumulative
    assert all(spent.values()), f"a listed function was not called: {spent}"
    own = {kind: seconds - sum(spent[part] for part in INSIDE.get(kind, ()))
           for kind, seconds in spent.items()}  # fmt: skip
    whole = sum(own.values())
    print(", ".join(f"{seconds / whole:.1%} {kind}" for kind, seconds in own.items()), end=" ")
    print(f"({len(chosen)} units, profiled)")


def written(made):
    return [parquet_bytes(name, rows, {}) for name, rows in made.rows.items()]


if __name__ == "__main__":
    main()
