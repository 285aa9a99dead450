import os
import subprocess
from pathlib import Path

import pytest

from grasp_core.compiled import copy_of
from tests.bad_input.cases import COMMAND as CLI
from tests.patience import HANGING_S

ROOT = Path(__file__).parent.parent.parent
KERNEL = "grasp_core.solvers.lp_kernel"
KEPT = copy_of(KERNEL, str(ROOT / "grasp_core" / "solvers" / "lp_kernel.py")).parent
"""Where the loops are kept that other tests compile, so that a new home need not compile them."""


@pytest.fixture(scope="session")
def graspproof():
    """The command line in a process of its own; its words, then what `subprocess.run` takes."""

    def run(*words, env=None, **given):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), **(env or {})}
        given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **given}
        return subprocess.run(
            [*CLI, *words], env=environment, text=True, timeout=HANGING_S, check=False, **given
        )

    return run


def contents(folder):
    """Bytes of all files of a folder, by name."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
