"""Compare all that commands write with what is kept, or with another tree of the code.

    python -m tests.golden                 # with tests/golden/kept.json, within tolerances
    python -m tests.golden --keep          # write kept.json anew; its diff shows what has changed
    python -m tests.golden --against REV   # with a commit, bit for bit, made in the same run

It takes about two minutes on two cores, and as long again for another tree. The command fails if
anything differs. Under OPENBLAS_CORETYPE=Nehalem NUMBA_CPU_NAME=generic it judges the processor.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from tests.golden.cases import CASES, GIVEN
from tests.golden.comparing import differences, kept_of, unlike, unlike_kept
from tests.golden.fields import fields_of
from tests.schemas import faults_of_file

ROOT = Path(__file__).parent.parent.parent
KEPT = Path(__file__).with_name("kept.json")
AT_ONCE = 2


def main():
    given = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    given.add_argument("--keep", action="store_true", help="write what is kept anew")
    given.add_argument("--against", metavar="REV", help="a commit to compare with, bit for bit")
    given.add_argument("--only", action="append", choices=[case.name for case in CASES])
    asked = given.parse_args()
    cases = [case for case in CASES if asked.only is None or case.name in asked.only]
    with tempfile.TemporaryDirectory(prefix="golden-") as folder:
        now = made(ROOT, Path(folder, "now"), cases)
        if asked.against:
            with tree_of(asked.against) as tree:
                return told(made(tree, Path(folder, "before"), cases), now, unlike)
    small = {name: kept_of(fields) for name, fields in now.items()}
    before = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    if asked.keep:
        write_kept(before | small if asked.only else small)
    return told({case.name: before.get(case.name, {}) for case in cases}, small, unlike_kept)


def told(before, now, say):
    """Print all differences; 1 if there are any."""
    count = 0
    for name in now:
        for field, said in differences(before[name], now[name], say):
            print(f"{name}: {field}: {said}")
            count += 1
    fields = sum(map(len, now.values()))
    print(f"golden: {len(now)} cases, {fields} fields, {count} differences")
    return 1 if count else 0


def write_kept(small):
    """Write one line for each field."""
    cases = []
    for name, fields in sorted(small.items()):
        lines = [f"{json.dumps(field)}: {json.dumps(kept)}" for field, kept in fields.items()]
        cases.append(f"{json.dumps(name)}: {{\n" + ",\n".join(sorted(lines)) + "\n}")
    KEPT.write_text("{\n" + ",\n".join(cases) + "\n}\n")


def made(tree, folder, cases):
    """Run cases with the packages of a tree; return the fields of each case by its name."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        found = pool.map(lambda case: _fields(Path(tree), Path(folder) / case.name, case), cases)
        return dict(zip([case.name for case in cases], found, strict=True))


def _fields(tree, folder, case):
    folder.mkdir(parents=True)
    for name, text in GIVEN.items():
        (folder / name).write_text(text)
    ended = [_run(tree, folder, *command) for command in case.commands]
    if tree == ROOT:
        check_schemas(folder)
    return fields_of(folder, GIVEN) | {"exit codes": ended}


def check_schemas(folder):
    """Stop where a file of a folder does not fit the schema of its kind."""
    paths = (path for ending in ("json", "toml") for path in sorted(folder.rglob(f"*.{ending}")))
    if faults := [f"{path}: {said}" for path in paths for said in faults_of_file(path) or ()]:
        raise ValueError("\n".join(faults))


def _run(tree, folder, arguments, file):
    """Run a command in a folder, and return its exit code."""
    script = tomllib.loads((tree / "pyproject.toml").read_text())["project"]["scripts"]
    module, function = script["graspproof"].split(":")
    code = f"from {module} import {function}; {function}()"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(tree)},
    )  # fmt: skip
    if done.returncode > 1:  # 1 is an answer: something was not held or not reached
        print(f"{folder.name}: {' '.join(arguments)}: exit code {done.returncode}")
        print(done.stderr[-2000:])
    if file and not done.returncode:
        (folder / file).write_text(done.stdout)
    return done.returncode


@contextmanager
def tree_of(commit):
    """Check a commit out into a folder of its own, for as long as it is needed."""
    with tempfile.TemporaryDirectory(prefix="tree-") as folder:
        tree = Path(folder, "tree")
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "-q", "--detach", str(tree), commit], check=True)
        try:
            yield tree
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


if __name__ == "__main__":
    sys.exit(main())
