"""Light imports stay light, and every command has its function."""

import os
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name
from typing import get_args

import pytest

from sim_validate.baselines import flags as baseline_flags
from sim_validate.datasets import flags as dataset_flags
from sim_validate.main import ACTIONS, Command

ROOT = Path(__file__).parent.parent


HEAVY = (
    "numpy", "scipy", "numba", "clarabel", "qpsolvers", "manifold3d", "trimesh",
    "mujoco", "resvg_py",
)  # fmt: skip
NOT_TO_PLAN = ("mujoco", "trimesh", "qpsolvers", "scipy.spatial", "scipy.optimize")

NOT_TO_PLAN_AGAIN = (
    *NOT_TO_PLAN, "clarabel", "resvg_py", "PIL", "pyarrow", "jinja2",
    "scipy.sparse", "scipy.stats", "grasp_core.regions",
    "grasp_core.optimizing", "sim_validate.engine", "sim_validate.report",
)  # fmt: skip
"""What planning the wedge does not need where its loops are kept already."""


def imported(code, among, **environment):
    """Which packages a program imports."""
    code = f"import sys; {code}; print('IMPORTED', *(m for m in {among!r} if m in sys.modules))"
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | environment,
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    said, _, names = answer.stdout.rpartition("IMPORTED")
    return names.split(), said.strip()


@pytest.mark.parametrize(
    "module",
    ["grasp_core", "scenes", "sim_validate", "sim_validate.main", "sim_validate.kit.command_flags"],
)
def test_importing_a_package_imports_nothing_heavy(module):
    assert imported(f"import {module}", HEAVY) == ([], "")


@pytest.mark.parametrize(
    "name", ["grasp_core.plan", "scenes.build_scene", "sim_validate.HoldProtocol"]
)
def test_using_a_name_imports_no_more_than_it_needs(name):
    package, _, _ = name.partition(".")
    assert imported(f"import {package}; {name}", (*NOT_TO_PLAN, "scipy", "numba"))[0] == []


@pytest.mark.parametrize(
    ("arguments", "heavy", "said"),
    [
        (["--help"], HEAVY, "inspect"),
        (["plan", "--help"], HEAVY, "--friction"),
        (["plan", "wedge", "--friction", "0"], HEAVY, ""),
        (["objects"], (*NOT_TO_PLAN, "numba"), "tetrahedron"),
        (["plan", "tetrahedron"], NOT_TO_PLAN, "5 grasps"),
        (["inspect", "box"], (*NOT_TO_PLAN, "numba"), "volume"),
    ],
)  # fmt: skip
def test_a_command_imports_no_more_than_it_needs(arguments, heavy, said):
    names, shown = imported(f"from sim_validate.main import main; main({arguments!r})", heavy)
    assert names == []
    assert said in shown


def test_a_plan_that_finds_its_loops_imports_only_what_planning_needs(tmp_path):
    """Compiling loops needs more of numba, so the first of two plans may have to compile them."""
    words = ["plan", "wedge", "--out", str(tmp_path)]
    code = f"from sim_validate.main import main; main({words!r})"
    imported(code, ())
    names, said = imported(code, (*NOT_TO_PLAN_AGAIN, "numba", "grasp_core.records.grasps_json"))
    assert names == ["numba", "grasp_core.records.grasps_json"]
    assert "219 grasps" in said


def test_every_command_has_its_function():
    flags = dataset_flags
    actions = {flags.Build, flags.Import, flags.Verify, flags.Export}
    actions |= {baseline_flags.Record, baseline_flags.Check}
    named = set(get_args(Command)) - {flags.Dataset, baseline_flags.Baseline} | actions
    assert set(ACTIONS) == named
    places = [f"sim_validate.{place}" for place in ACTIONS.values()]
    assert all(callable(resolve_name(place)) for place in places)
