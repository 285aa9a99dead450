"""A project of somebody else's, with a baseline of two grasps, as tests of the plugin need it."""

import os
import subprocess
import sys

CODE = """
import grasp_core as gc
import pytest
import scenes

def test_it_holds(assert_stable):
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    assert assert_stable(body, grasp, 0.5).held

def test_it_does_not(assert_stable):
    import dataclasses
    from sim_validate.simulation.setup import NamedWrench
    body = scenes.example_object("wedge")
    grasp = gc.plan(body, 0.5, families=("concurrent",), limit=1).grasps[0]
    push = NamedWrench("push", [0.0, 0.0, 900.0, 0.0, 0.0, 0.0])
    assert_stable(body, grasp, 0.5, wrenches=[push])
"""


def run_pytest(folder, *arguments):
    """Run pytest as a user would; what it printed and its exit code."""
    line = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    plain = {name: value for name, value in os.environ.items() if "PYTEST" not in name}
    ran = subprocess.run(
        line, cwd=folder, env=plain, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    return ran.returncode, ran.stdout.decode()


def copied(project, folder):
    for path in project.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
