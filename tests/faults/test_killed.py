"""Killed at any step: files are whole, and the same command again ends as if nothing had been."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from grasp_core.files.text_files import UNFINISHED
from sim_validate.main import main
from tests.faults.conftest import CLI, ROOT, contents

RUN = ["run", "tetrahedron", "--limit", "1", "--jobs", "1", "-q"]
PLAN = ["plan", "tetrahedron", "--families", "concurrent", "--jobs", "1", "-q"]


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planned")
    assert main([*PLAN, "--out", str(folder)]) == 0
    return folder / "grasps.json"


@pytest.mark.slow
def test_nothing_of_an_earlier_run_is_mixed_with_a_new_one(everywhere, tmp_path):
    given = tmp_path / "given"
    other = ["--friction", "0.4", "--traces", "--no-report", "-q"]
    assert main(["run", "tetrahedron", "--limit", "1", *other, "--out", str(given)]) == 0
    before = contents(given)
    codes = everywhere("kill", tmp_path, *RUN, "--no-report", "--traces", "--out", "OUT", every=6)
    whole = contents(tmp_path / "whole")
    for step in range(0, 6 * len(codes), 6):
        names = contents(tmp_path / f"{step}.struck")
        found = {name: data for name, data in names.items() if UNFINISHED not in name}
        assert found.items() <= before.items() or found.items() <= whole.items(), step
        assert contents(tmp_path / str(step)) == whole


def test_what_a_killed_writer_left_goes_with_the_next_command(planned, tmp_path):
    for part in ("", "scenes", "report", "report/grasps"):
        (tmp_path / part).mkdir(exist_ok=True)
        (tmp_path / part / f".a.json{UNFINISHED}x7y.json").write_text("{")
        (tmp_path / part / f".report{UNFINISHED}x7y").mkdir()
        (tmp_path / part / f".report{UNFINISHED}x7y" / "index.html").write_text("half")
    shutil.copy(planned, tmp_path)
    (tmp_path / ".mine.json").write_text("{}")
    assert main(["scene", str(planned), "--out", str(tmp_path), "-q"]) == 0
    left = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"grasps.json", "c-0-1-2-3.xml", ".mine.json"}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="children are found in /proc")
def test_processes_end_with_the_command_that_is_killed(tmp_path):
    words = ["run", "icosahedron", "--limit", "200", "--jobs", "3", "--out", str(tmp_path), "-q"]
    process = subprocess.Popen([*CLI, *words], env=os.environ | {"PYTHONPATH": str(ROOT)})
    workers = set()
    while len(workers) < 2 and process.poll() is None:
        time.sleep(0.02)
        workers = {child for child in children(process.pid) if seconds_worked(child) >= 1.0}
    process.kill()
    assert process.wait() == -signal.SIGKILL, "the command ended before two processes worked"
    deadline = time.monotonic() + 60.0
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < deadline, "a process outlived the command"
        time.sleep(0.2)


def children(parent):
    found = set()
    for task in Path(f"/proc/{parent}/task").glob("*/children"):
        found |= {int(word) for word in task.read_text().split()}
    return found


def seconds_worked(process):
    """Processor time that a process has used; 0 for one that has ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
