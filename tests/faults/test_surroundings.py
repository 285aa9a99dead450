"""Environments that lack things, or hold nonsense, change no result."""

import os
import subprocess

import pytest

from sim_validate.main import main
from sim_validate.processes import workers as engines
from tests.faults.conftest import CLI, KEPT, ROOT, contents

RUN = ["run", "tetrahedron", "--limit", "1", "--jobs", "1", "-q"]
NOWHERE = "/proc/nowhere"
NO_HOME = {"HOME": NOWHERE, "XDG_CONFIG_HOME": NOWHERE, "XDG_CACHE_HOME": NOWHERE}
SURROUNDINGS = {
    "no home": {**NO_HOME, "XDG_CACHE_HOME": str(KEPT.parent)},
    "no threads": {"OMP_NUM_THREADS": "many"},
    "no temporary folder": {"TMPDIR": NOWHERE},
    "no locale": {"LC_ALL": "xx_XX", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    "no terminal": {"TERM": "dumb", "COLUMNS": "1"},
}


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    folder = tmp_path_factory.mktemp("usual")
    assert main([*RUN, "--out", str(folder)]) == 0
    return contents(folder)


@pytest.mark.slow
def test_surroundings_change_no_byte(usual, graspproof, tmp_path):
    together = {name: value for each in SURROUNDINGS.values() for name, value in each.items()}
    done = graspproof(*RUN, "--out", str(tmp_path / "b"), env=together)
    assert (done.returncode, done.stderr) == (0, "")
    assert contents(tmp_path / "b") == usual


def test_letters_that_a_terminal_does_not_have_are_spelled_out(graspproof, tmp_path):
    name = tmp_path / "Schlüssel.off"
    name.write_text(
        "OFF\n4 4 0\n0 0 0\n.1 0 0\n0 .1 0\n0 0 .1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
    )
    ascii_only = {"PYTHONIOENCODING": "ascii"}
    done = graspproof("inspect", str(name), env=ascii_only)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Schl\\xfcssel" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("redirected", ["| true", ">&- 2>&- <&-"])
def test_a_stream_that_is_closed_does_not_stop_the_work(redirected, tmp_path):
    words = ["plan", "tetrahedron", "--families", "concurrent", "--json", "--out", "out"]
    quoted = " ".join(f"'{word}'" for word in [*CLI, *words])
    done = subprocess.run(
        ["/bin/bash", "-c", f"set -o pipefail; {quoted} {redirected}"], cwd=tmp_path, check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert done.returncode == 0
    assert "Error" not in done.stderr
    assert (tmp_path / "out" / "grasps.json").is_file()


def test_a_working_folder_that_is_gone_is_named(tmp_path, monkeypatch, capsys):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(["plan", "tetrahedron", "--out", str(tmp_path / "a")]) == 4
    assert "the working folder is gone; change to one that exists" in capsys.readouterr().err


def test_cores_are_those_that_the_process_may_use(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)), raising=False)
    monkeypatch.setattr(engines, "SHARE", tmp_path / "cpu.max")
    counted = {"": 64, "max 100000\n": 64, "250000 100000\n": 2, "20000 100000\n": 1}
    for text, cores in counted.items():
        if text:
            (tmp_path / "cpu.max").write_text(text)
        assert engines.available_cores() == cores
