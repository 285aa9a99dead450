"""The commands of all cases are run on one tree of the code, two cases at a time."""

import os
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.golden.cases import GIVEN
from tests.golden.fields import fields_of

AT_ONCE = 2


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
    return fields_of(folder, GIVEN) | {"exit codes": ended}


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
