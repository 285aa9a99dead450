"""Compare all that commands write with what is kept, or with another tree of the code.

    python -m tests.golden                 # with tests/golden/kept.json, within tolerances
    python -m tests.golden --keep          # write kept.json anew; its diff shows what has changed
    python -m tests.golden --against REV   # with a commit, bit for bit, made in the same run

It takes about two minutes on two cores, and as long again for another tree. The command fails if
anything differs. Under OPENBLAS_CORETYPE=Nehalem NUMBA_CPU_NAME=generic it judges the processor.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

from tests.golden.cases import CASES
from tests.golden.comparing import differences, kept_of, unlike, unlike_kept
from tests.golden.making import made

ROOT = Path(__file__).parent.parent.parent
KEPT = Path(__file__).with_name("kept.json")


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
