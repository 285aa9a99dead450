"""Which files are opened, which processes begun, and that nothing is sent anywhere."""

import json
import os
import subprocess
import sys
from functools import cached_property
from pathlib import Path

import pytest

from tests.bad_input.mesh_texts import obj
from tests.faults.conftest import CLI, KEPT
from tests.patience import HANGING_S

AUDITING = Path(__file__).with_name("auditing")
ROOT = Path(__file__).parents[2]
LIBRARIES = tuple(
    {os.path.realpath(each) for each in (sys.prefix, sys.base_prefix, ROOT, AUDITING, *sys.path)}
)
SYSTEM = ("/sys/", "/proc/", "/dev/null", "/dev/urandom", "/usr/", "/lib", "/etc/", "/dev/shm/")  # noqa: S108 - shared memory of processes
"""What the interpreter and libraries read about the machine; fonts, time zones."""
CACHES = ("__pycache__", ".pytest_cache")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGING = (
    "os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.chmod",
    "os.chown", "os.truncate", "os.utime", "shutil.rmtree", "shutil.move", "shutil.copyfile",
)  # fmt: skip
OURS = ("grasp_core.processes", "frames.py")
LIBRARIES_ASK = ("def get_version(library_handle)",)
"""GLFW's Python package for its version, the first time."""


class Witness:
    """Runs commands and keeps what they touch."""

    def __init__(self, folder):
        self.folder, self.log = folder, folder / "log"
        for name in ("home", "scratch"):
            (folder / name).mkdir()
        (folder / "part.obj").write_text(obj())

    def run(self, line):
        environment = {
            **os.environ, "AUDITED_BY": str(self.log), "HOME": str(self.folder / "home"),
            "TMPDIR": str(self.folder / "scratch"), "PYTHONPATH": f"{AUDITING}:{ROOT}",
            "XDG_CACHE_HOME": str(KEPT.parent),
        }  # fmt: skip
        ended = subprocess.run(
            [*CLI, *line.split()], cwd=self.folder, env=environment, capture_output=True,
            timeout=HANGING_S, check=False,
        )  # fmt: skip
        assert ended.returncode == 0, ended.stderr

    @cached_property
    def events(self):
        """Each with its arguments; of lines that were cut, the beginning."""
        lines = self.log.read_text(errors="replace").splitlines()
        return [json.loads(said) if said.endswith("]") else [said[:60]] for said in lines]

    def path(self, given):
        return (self.folder / given).resolve() if isinstance(given, str) else None


def _is_of(path, *roots):
    return str(path).startswith(tuple(map(str, roots)))


@pytest.mark.slow
def test_only_what_is_named_is_read_only_results_are_written_and_nothing_is_sent(tmp_path):
    witness = Witness(tmp_path)
    witness.run("run part.obj --limit 1 --random-wrenches 0 --out out -q --jobs 2")
    witness.run("report out --out pages -q --jobs 2")
    witness.run("dataset build part.obj --frictions 0.5 --limit 1 --out ds -q --jobs 2")
    roots = [tmp_path / name for name in ("out", "pages", "ds", "home", "scratch")]
    named = {name for event, name, *_ in witness.events if event == "open"}
    opened = {witness.path(name) for name in named if "/" in str(name)} - {None}
    assert "part.obj" in named
    assert tmp_path / "out" / "grasps.json" in opened
    own = (*LIBRARIES, *SYSTEM, tmp_path / "part.obj", KEPT, *roots)
    assert [path for path in opened if not _is_of(path, *own)] == []
    written = set()
    for event, *given in witness.events:
        if (event == "open" and isinstance(given[2], int) and given[2] & WRITING) or (
            event in CHANGING and Path(str(given[0])).is_absolute()
        ):
            written.add(witness.path(given[0]))
    written -= {None, Path("/dev/null")}
    assert any(path.is_relative_to(roots[0]) for path in written)
    strange = [p for p in written if not _is_of(p, KEPT, *roots) and not set(p.parts) & set(CACHES)]
    assert strange == []
    sent = ("socket.", "urllib.", "http.", "os.exec", "os.system")
    assert [event for event, *_ in witness.events if event.startswith(sent)] == []
    begun = [str(each) for each in witness.events if each[0] == "subprocess.Popen"]
    assert [
        each for each in begun if not any(name in each for name in (*OURS, *LIBRARIES_ASK))
    ] == []
