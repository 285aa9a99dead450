"""The README's example prints what it says, and its two commands set up what they need."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

import grasp_core as gc
import scenes
from sim_validate.cli.command_flags import Command

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
MATHEMATICS = (ROOT / "docs" / "mathematics.md").read_text()
COMMANDS = (ROOT / "docs" / "commands.md").read_text()
SETUP = ROOT / ".ci" / "setup"


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


def machine(folder, *, libgomp, venv, apt_get=0, user=0):
    """A folder of programs that note how they are called, as on a machine of the kind asked for."""
    folder.mkdir()
    calls = folder / "calls"
    pip = f'echo pip "$@" >> {calls}'
    programs = {
        "python3": f'echo python3 "$@" >> {calls}\n'
        f"test {venv:d} = 1 -o -e {folder}/installed || exit 1\n"
        f"mkdir -p \"$3/bin\"\nprintf '#!/bin/sh\\n%s\\n' '{pip}' > \"$3/bin/pip\"\n"
        'chmod +x "$3/bin/pip"',
        "ldconfig": f"echo {'libgomp.so.1' if libgomp else 'libc.so.6'}",
        "apt-get": f'echo apt-get "$@" >> {calls}\ntouch {folder}/installed\nexit {apt_get}',
        "id": f"echo {user}",
    }
    for name, text in programs.items():
        program = folder / name
        program.write_text(f"#!/bin/sh\n{text}\n")
        program.chmod(0o755)
    return calls


def set_up(tmp_path, **kind):
    """Exit code of the set-up script on such a machine, and the calls that it made."""
    calls = machine(tmp_path / "programs", **kind)
    environment = os.environ | {"PATH": f"{calls.parent}:{os.environ['PATH']}"}
    done = subprocess.run(["/bin/sh", SETUP, "env", "-e", ".[test]"], cwd=tmp_path, env=environment,
                          capture_output=True, text=True, check=False)  # fmt: skip
    return done.returncode, calls.read_text().splitlines()


MAKE = "python3 -m venv env"
INSTALL = f"pip install -q -c {SETUP.parent}/constraints.txt -e .[test]"
APT = ["apt-get update", "apt-get install -y python3-venv libgomp1"]


def test_the_script_makes_an_environment_and_installs_into_it(tmp_path):
    assert set_up(tmp_path, libgomp=True, venv=True) == (0, [MAKE, INSTALL])


@pytest.mark.parametrize(("libgomp", "venv"), [(False, True), (True, False), (False, False)])
def test_the_script_installs_what_a_bare_debian_lacks(tmp_path, libgomp, venv):
    assert set_up(tmp_path, libgomp=libgomp, venv=venv) == (0, [MAKE, *APT, MAKE, INSTALL])


def test_the_script_ends_where_nothing_can_be_installed(tmp_path):
    code, calls = set_up(tmp_path, libgomp=False, venv=True, apt_get=100)
    assert code == 100
    assert calls == [MAKE, APT[0]]


def test_the_gallery_shows_what_the_planner_finds():
    rows = re.findall(
        r"^\| `([\w-]+)` \| `([\w-]+)` \| (\w+) \| ([\d.]*)[ m]*\| ([\d.]+) \|",
        MATHEMATICS,
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
