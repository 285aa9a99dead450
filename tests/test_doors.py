"""Light imports stay light."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main

ROOT = Path(__file__).parent.parent


HEAVY = (
    "numpy", "scipy", "numba", "clarabel", "qpsolvers", "manifold3d", "trimesh",
    "mujoco", "resvg_py", "filelock",
)  # fmt: skip
NOT_TO_PLAN = ("mujoco", "trimesh", "qpsolvers", "scipy.spatial", "scipy.optimize")

NOT_TO_PLAN_AGAIN = (
    *NOT_TO_PLAN, "clarabel", "resvg_py", "PIL", "pyarrow", "jinja2",
    "jsonschema", "pandas", "proxsuite", "quadprog", "rich.progress",
    "scipy.sparse", "scipy.stats", "grasp_core.regions",
    "grasp_core.optimizing", "sim_validate.engine", "sim_validate.report",
)  # fmt: skip
"""What planning does not need where its loops are kept already."""
OTHER_FLAGS = ("sim_validate.commands.simulation_flags", "sim_validate.datasets.flags")


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


def test_importing_the_packages_imports_nothing_heavy():
    modules = ("grasp_core", "scenes", "sim_validate.main", "sim_validate.commands.flags")
    assert imported(f"import {', '.join(modules)}", HEAVY) == ([], "")


def test_using_a_name_imports_no_more_than_it_needs():
    code = "import grasp_core as gc, scenes, sim_validate as sv"
    code += "; gc.plan, scenes.build_scene, sv.HoldProtocol"
    assert imported(code, (*NOT_TO_PLAN, "scipy", "numba"))[0] == []


@pytest.mark.parametrize(
    ("commands", "heavy", "said"),
    [
        ((["--help"], ["plan", "--help"], ["plan", "wedge", "--friction", "0"]), HEAVY, "inspect"),
        ((["plan", "--help"], ["plan", "wedge", "--limit", "1"]), OTHER_FLAGS, "certificate"),
        ((["objects"], ["inspect", "box"]), (*NOT_TO_PLAN, "numba"), "volume"),
    ],
)
def test_a_command_imports_no_more_than_it_needs(commands, heavy, said):
    code = f"from sim_validate.main import main; [main(words) for words in {commands!r}]"
    names, shown = imported(code, heavy)
    assert names == []
    assert said in shown


def test_a_validation_without_published_tests_imports_no_hands(tmp_path):
    words = ["plan", "wedge", "--limit", "1", "--out", str(tmp_path), "-q"]
    assert main(words) == Exit.GOOD
    code = (
        f"from sim_validate.main import main; main(['validate', {str(tmp_path / 'grasps.json')!r}])"
    )
    unused = ("grasp_core.hands", "sim_validate.hands", "sim_validate.execution.execute", "trimesh")
    names, said = imported(code, ("mujoco", *unused))
    assert names == ["mujoco"]
    assert "held all wrenches" in said


def test_a_plan_that_finds_its_loops_imports_only_what_planning_needs(tmp_path):
    """Compiling loops needs more of numba, so the first of two plans may have to compile them."""
    words = ["plan", "wedge", "--limit", "5", "--out", str(tmp_path)]
    assert main([*words, "-q"]) == Exit.GOOD
    code = f"from sim_validate.main import main; main({words!r})"
    names, said = imported(code, (*NOT_TO_PLAN_AGAIN, "numba", "grasp_core.planning.grasps_json"))
    assert names == ["numba", "grasp_core.planning.grasps_json"]
    assert "5 grasps" in said
