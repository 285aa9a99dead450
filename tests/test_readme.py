"""The README's example prints what it says; every command and the gallery are as pages say."""

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

import grasp_core as gc
import scenes
from sim_validate.main import Command

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
THEORY = (ROOT / "docs" / "theory.md").read_text()
COMMANDS = (ROOT / "docs" / "commands.md").read_text()


def test_the_example_prints_what_it_says():
    ((code, said),) = re.findall(r"```python\n(.*?)```.*?```text\n(.*?)```", README, re.DOTALL)
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == said


def test_every_command_is_described():
    assert len(get_args(Command)) >= 9
    for command in get_args(Command):
        assert f"`graspproof {command.__name__.lower()}" in COMMANDS


def test_the_gallery_shows_what_the_planner_finds():
    rows = re.findall(
        r"^\| `([\w-]+)` \| `([\w-]+)` \| (\w+) \| ([\d.]*)[ m]*\| ([\d.]+) \|",
        THEORY,
        re.MULTILINE,
    )
    assert len(rows) == 5
    for name, grasp_id, family, disc_mm, critical in rows:
        plan = gc.plan(
            scenes.example_object(name),
            math.tan(math.radians(10.0)),
            families=(family,),
            cones="normal",
        )
        (grasp,) = (grasp for grasp in plan.grasps if grasp.id == grasp_id)
        assert f"{1e3 * grasp.radius:.2f}" == (disc_mm or "0.00")
        assert grasp.critical_friction == pytest.approx(float(critical), abs=5e-5)
