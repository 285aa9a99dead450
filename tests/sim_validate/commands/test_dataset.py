"""Datasets from the command line, and what becomes of them when processes are killed."""

import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sim_validate as sv
from sim_validate.cli.exit_codes import Exit
from sim_validate.datasets.verify import verify
from sim_validate.main import main
from tests.marks import more
from tests.patience import HANGING_S
from tests.sim_validate.datasets.engines import here

pytest.importorskip("pyarrow")
FLAGS = ("--friction", "0.4", "--friction", "0.5", "--family", "concurrent", "--limit", "2")
LIGHT = ("--friction", "0.5", "--family", "concurrent", "--limit", "1")
OBJECTS = ("tetrahedron", "wedge", "prism")


def files(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }


def command(folder, jobs):
    run = "from sim_validate.main import run_and_exit; run_and_exit()"
    return [sys.executable, "-c", run, "dataset", "build", *OBJECTS, *FLAGS,
            "--out", str(folder), "--jobs", str(jobs), "-q"]  # fmt: skip


def built(folder, names, flags):
    assert main(["dataset", "build", *names, *flags, "--out", str(folder), "-q"]) == Exit.GOOD
    return folder


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return built(tmp_path_factory.mktemp("made") / "ds", OBJECTS[:2], LIGHT)


@pytest.fixture(scope="module")
def large_dataset(tmp_path_factory):
    """What the command of killed processes makes."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sim_validate.commands.dataset.local_processes", here)
        return built(tmp_path_factory.mktemp("large") / "ds", OBJECTS, FLAGS)


def test_a_dataset_is_made_and_nothing_is_wrong_with_it(dataset, capsys):
    assert main(["dataset", "verify", str(dataset), "--json"]) == Exit.GOOD
    assert json.loads(capsys.readouterr().out) == {"dataset": str(dataset), "faults": []}


def test_a_build_says_how_many_objects_each_split_has(dataset, capsys):
    """Two objects leave at least one of the three splits without any."""
    assert main(["dataset", "build", *OBJECTS[:2], *LIGHT, "--out", str(dataset)]) == Exit.GOOD
    last = capsys.readouterr().out.splitlines()[-1]
    found = re.fullmatch(r"train (\d), validation (\d), test (\d) objects", last)
    counts = dict(zip(("train", "validation", "test"), map(int, found.groups()), strict=True))
    assert sum(counts.values()) == 2
    for split, count in counts.items():
        warned = contextlib.nullcontext() if count else pytest.warns(UserWarning, match=last)
        with warned:
            grasps = sv.load_dataset(dataset, split)["grasps"]
        assert len(set(grasps["object_id"])) == count
        assert grasps["held"].dtype == bool
    assert 0 in counts.values()


def test_a_changed_file_is_named(dataset, tmp_path, capsys):
    spoiled = shutil.copytree(dataset, tmp_path / "ds")
    path = next(spoiled.glob("data/trials/*.parquet"))
    path.write_bytes(path.read_bytes()[:-1] + b"!")
    assert main(["dataset", "verify", str(spoiled)]) == Exit.NEGATIVE
    assert path.name in capsys.readouterr().err


@pytest.mark.usefixtures("built_here")
def test_a_toml_file_says_the_same_as_flags(dataset, tmp_path):
    """The flags were given to a command that begins processes."""
    settings = tmp_path / "ds.toml"
    settings.write_text((dataset / "config.toml").read_text())
    folder = tmp_path / "ds"
    assert main(["dataset", "build", str(settings), "--out", str(folder), "-q"]) == Exit.GOOD
    assert files(folder) == files(dataset)
    again = ["dataset", "build", str(settings), "--limit", "3", "--out", str(tmp_path / "x")]
    assert main(again) == Exit.INPUT


@pytest.mark.usefixtures("built_here")
def test_a_bad_mesh_is_left_out_and_said(tmp_path, capsys):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "bad.stl").write_text("solid nothing")
    names = ["tetrahedron", str(tmp_path / "meshes"), *FLAGS[:4], *LIGHT[2:]]
    code = main(["dataset", "build", *names, "--out", str(tmp_path / "ds")])
    assert code == Exit.PARTIAL
    assert "quarantine.jsonl" in capsys.readouterr().err
    (first, second) = (tmp_path / "ds" / "quarantine.jsonl").read_text().splitlines()
    assert json.loads(first)["object"] == json.loads(second)["object"]


@pytest.mark.slow
@pytest.mark.parametrize("times", [8, *more(20)])
def test_a_driver_killed_at_random_moments_loses_nothing(times, large_dataset, tmp_path):
    folder, rng, killed = tmp_path / "ds", np.random.default_rng(0), 0
    for _ in range(times):
        process = subprocess.Popen(command(folder, 2), start_new_session=True)
        time.sleep(rng.uniform(0.5, 6.0))
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            killed += 1
        process.wait()
        time.sleep(1.5)  # workers notice that their driver is gone
    assert killed >= 3
    subprocess.run(command(folder, 2), check=True)
    assert verify(folder) == []
    assert files(folder) == files(large_dataset)


@pytest.mark.slow
@pytest.mark.more
def test_a_worker_that_is_killed_costs_nothing_but_time(large_dataset, tmp_path):
    folder = tmp_path / "ds"
    process = subprocess.Popen(command(folder, 2))
    tasks, killed = Path(f"/proc/{process.pid}/task"), 0
    while process.poll() is None and not killed:
        time.sleep(0.1)
        if any((folder / "staging").glob("[!.]*")):
            listed = " ".join(task.read_text() for task in tasks.glob("*/children"))
            for child in listed.split()[-1:]:
                os.kill(int(child), signal.SIGKILL)
                killed += 1
    assert killed
    assert process.wait(timeout=HANGING_S) == Exit.GOOD
    assert files(folder) == files(large_dataset)
