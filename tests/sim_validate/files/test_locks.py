"""Locks of folders: one command at a time, and none is left by a killed one."""

import errno
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sim_validate.files.locks import LOCK, entries, locked
from sim_validate.files.output_folders import alone_in, whole_folder

ROOT = Path(__file__).parents[3]
HELD = """
import sys, time
from pathlib import Path
from sim_validate.files.locks import locked

with locked(Path(sys.argv[1])) as alone:
    print(alone, flush=True)
    time.sleep(600)
"""
IMPORT = re.compile(r"^ *(?:import|from) (\w+)", re.MULTILINE)
UNIX = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}


@pytest.fixture
def another(tmp_path):
    """Another process, which has locked the folder."""
    command = [sys.executable, "-c", HELD, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout.readline() == "True\n"
        yield process
        process.kill()


def test_a_killed_process_leaves_nothing_that_locks(another, tmp_path):
    for _ in range(2):  # who is refused takes nothing away
        with locked(tmp_path) as alone:
            assert alone is False
    another.kill()
    another.wait()
    assert (tmp_path / LOCK).is_file()
    assert entries(tmp_path) == []
    with locked(tmp_path) as alone:
        assert alone is True
    assert not list(tmp_path.iterdir())


def test_a_lock_ends_with_its_block_whatever_happens_there(tmp_path):
    for _ in range(2):
        with pytest.raises(ZeroDivisionError), locked(tmp_path):
            raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_where_a_file_system_has_no_locks_nobody_is_refused_nor_taken_for_ended(
    tmp_path, monkeypatch
):
    def none_here(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", none_here)
    with alone_in(tmp_path), alone_in(tmp_path):
        pass
    with whole_folder(tmp_path / "out") as first:
        with whole_folder(tmp_path / "out") as second:
            (second / "one").write_text("1")
        assert first.is_dir()
        (tmp_path / "out" / "one").unlink()  # else the first finds the place taken
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_is_not_there_for_a_lock_is_named(tmp_path):
    (tmp_path / LOCK).mkdir()
    with pytest.raises(OSError, match=LOCK), alone_in(tmp_path):
        pass


def test_no_module_imports_what_only_unix_has():
    names = {
        name
        for package in ("grasp_core", "scenes", "sim_validate")
        for path in (ROOT / package).rglob("*.py")
        for name in IMPORT.findall(path.read_text(encoding="utf-8"))
    }
    assert "subprocess" in names
    assert not names & UNIX
