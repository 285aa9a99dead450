"""The process that reads meshes: its limits, its end, and that nothing else suffers."""

import os
import resource
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.mesh_files import child as mesh_child
from grasp_core.mesh_files import child_main as mesh_reader
from grasp_core.mesh_files.child import read_triangles
from grasp_core.mesh_files.limits import MeshLimits
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES, obj, off
from tests.patience import HANGING_S

USUAL = MeshLimits()


def child():
    return mesh_child._child(USUAL.max_memory_mib).process


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "part.obj"
    path.write_text(obj())
    return path


def refusal(path, limits):
    with pytest.raises(gc.MeshError) as caught:
        read_triangles(path, limits)
    assert path.name in str(caught.value)
    return caught.value.reason


def test_one_process_reads_all_files(part, tmp_path):
    read_triangles(part, USUAL)
    first = child().pid
    (tmp_path / "other.off").write_text(off())
    points, corners, data = read_triangles(tmp_path / "other.off", USUAL)
    assert child().pid == first != os.getpid()
    assert points.tolist() == [list(each) for each in CORNERS]
    assert corners.tolist() == [list(each) for each in TRIANGLES]
    assert data == off().encode()


def test_a_reader_that_was_killed_is_begun_anew(part):
    read_triangles(part, USUAL)
    os.kill(child().pid, signal.SIGKILL)
    child().wait()
    assert len(read_triangles(part, USUAL)[1]) == 4


def test_a_reader_out_of_processor_time_is_ended_and_the_file_refused(part, monkeypatch):
    """It ends as the limit on the processor's time ends it: before it was sent anything to do."""

    def out_of_time(*_):
        os.kill(child().pid, signal.SIGXCPU)

    read_triangles(part, USUAL)
    with monkeypatch.context() as patched:
        patched.setattr(mesh_child, "_send", out_of_time)
        with pytest.raises(gc.MeshError, match=r"more than 7 s; .* --max-mesh-seconds") as caught:
            read_triangles(part, MeshLimits(max_seconds=7.0))
    assert caught.value.reason is MeshRefusal.LIMIT
    assert len(read_triangles(part, USUAL)[1]) == 4  # the next file has a new reader


def test_a_reader_that_gets_no_processor_is_ended_too(part, monkeypatch):
    """It is stopped, so that only the alarm can end it."""
    read_triangles(part, USUAL)
    with monkeypatch.context() as patched:
        patched.setattr(mesh_child, "GRACE_S", 0.1)
        os.kill(child().pid, signal.SIGSTOP)
        with pytest.raises(
            gc.MeshError, match=r"more than 0.001 s; .* --max-mesh-seconds"
        ) as caught:
            read_triangles(part, MeshLimits(max_seconds=1e-3))
    assert caught.value.reason is MeshRefusal.LIMIT
    assert len(read_triangles(part, USUAL)[1]) == 4


@pytest.mark.parametrize(
    ("spent", "seconds", "hard", "limit"),
    [
        (4.0, 2.5, resource.RLIM_INFINITY, 7),
        (0.2, 1e-3, resource.RLIM_INFINITY, 1),
        (4.0, 2.5, 5, 5),
    ],
)
def test_the_time_allowed_is_beside_what_was_spent(monkeypatch, spent, seconds, hard, limit):
    kept = []
    monkeypatch.setattr(mesh_reader.time, "process_time", lambda: spent)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (hard, hard))
    monkeypatch.setattr(resource, "setrlimit", lambda *limits: kept.append(limits))
    mesh_reader._limit_processor(seconds)
    assert kept == [(resource.RLIMIT_CPU, (limit, hard))]


def test_a_reading_that_never_ends_is_ended_by_the_processors_clock():
    """In the reader, with a parser that does nothing but spend time."""
    program = (
        "import itertools; from grasp_core.mesh_files import child_main as mesh_reader\n"
        "mesh_reader.parsed_by_trimesh = lambda *_: sum(itertools.repeat(1))\n"
        "mesh_reader.main('2048', '1')\n"
    )
    asked = b'{"kind": "obj", "bytes": %d, "max_seconds": 0.001, "max_triangles": 9}\n' % len(obj())
    ended = subprocess.run(
        [sys.executable, "-c", program], input=asked + obj().encode(), capture_output=True,
        check=False, timeout=HANGING_S,
    )  # fmt: skip
    assert ended.returncode == -signal.SIGXCPU
    assert ended.stdout == b""


def test_too_little_memory_is_refused(part):
    assert refusal(part, MeshLimits(max_memory_mib=1)) is MeshRefusal.LIMIT


@pytest.mark.parametrize("when", ["before it is asked", "after"])
def test_a_reader_that_others_end_is_tried_once_more(part, monkeypatch, when):
    """Once ended it has answered nothing; ended twice, no reader survives the file."""
    send, sent = mesh_child._send, []

    def ended(pipe, request):
        if len(sent) < ends:
            child().kill()
            if when == "before it is asked":
                child().wait()
        sent.append(len(request))
        send(pipe, request)

    monkeypatch.setattr(mesh_child, "_send", ended)
    ends = 1
    read_triangles(part, USUAL)
    assert len(read_triangles(part, USUAL)[1]) == 4
    assert len(sent) in (2, 3)
    sent.clear()
    ends = 2
    with pytest.raises(gc.MeshError, match="no reader survives it"):
        read_triangles(part, USUAL)
    assert len(sent) == 2


def test_what_libraries_print_is_no_answer(part, tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text("print('hello')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    child().kill()
    child().wait()
    assert len(read_triangles(part, USUAL)[1]) == 4


@pytest.mark.parametrize("limit", ["-t 300", "-v 1900000"])
def test_limits_of_the_shell_are_kept(part, limit):
    program = "from sim_validate.main import run_and_exit as r; r()"
    line = f"ulimit {limit}; exec {sys.executable} -c '{program}' inspect {part}"
    ended = subprocess.run(
        ["bash", "-c", line], capture_output=True, check=False, timeout=HANGING_S,  # noqa: S607 - the shell
        env=os.environ | mesh_child.ONE_THREAD,  # each thread of a library takes address space
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr


def test_a_fork_amid_a_reading_has_a_reader_of_its_own(tmp_path):
    """In a program of its own, as forks of many threads warn."""
    path = tmp_path / "large.obj"
    path.write_text(obj(CORNERS, TRIANGLES * 40_000))
    program = (
        "import os, sys, threading; from pathlib import Path\n"
        "from grasp_core.mesh_files import child as mesh_child, limits as mesh_files\n"
        "def read(): return mesh_child.read_triangles(Path(sys.argv[1]), mesh_files.MeshLimits())\n"
        "asked, answer = threading.Event(), mesh_child._answer\n"
        "def answering(stream): asked.set(); return answer(stream)\n"
        "read(); mesh_child._answer = answering\n"
        "thread = threading.Thread(target=read); thread.start(); asked.wait()\n"
        "child = os.fork()\n"
        "if not child: os._exit(0 if len(read()[1]) == 160_000 else 1)\n"
        "_, status = os.waitpid(child, 0); thread.join()\n"
        "sys.exit(os.waitstatus_to_exitcode(status))\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program, str(path)],
        capture_output=True,
        check=False,
        timeout=HANGING_S,
    )
    assert ended.returncode == 0, ended.stderr


def test_answers_belong_to_their_files_in_many_threads(tmp_path):
    files, found = [tmp_path / f"{count}.off" for count in range(1, 17)], {}
    for count, path in enumerate(files, 1):
        path.write_text(off(f"4 {4 * count} 0", faces=TRIANGLES * count))

    def read(path):
        found[path] = len(read_triangles(path, USUAL)[1])

    threads = [threading.Thread(target=read, args=(path,)) for path in files]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {path: 4 * count for count, path in enumerate(files, 1)}


def test_an_interrupt_leaves_no_answer_for_the_next_file(part, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    read_triangles(part, USUAL)
    with monkeypatch.context() as patched:
        patched.setattr(mesh_child, "_answer", interrupted)
        with pytest.raises(KeyboardInterrupt):
            read_triangles(part, USUAL)
    part.write_text(obj(faces=TRIANGLES * 2))
    assert len(read_triangles(part, USUAL)[1]) == 8


def test_the_reader_ends_with_the_program_that_asked(part):
    program = (
        "import sys, os, signal; from pathlib import Path\n"
        "from grasp_core.mesh_files import child as mesh_child, limits as mesh_files\n"
        "mesh_child.read_triangles(Path(sys.argv[1]), mesh_files.MeshLimits())\n"
        "print(mesh_child._child(2048).process.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program, str(part)],
        capture_output=True,
        check=False,
        timeout=HANGING_S,
    )
    assert ended.returncode == -signal.SIGKILL
    number = int(ended.stdout)
    while running(number):  # if it never ends, pytest ends the test
        threading.Event().wait(0.1)


def running(number):
    """Whether a process is there that has not ended, whether or not somebody asked how it did."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{number}/stat")
    return not (stat.is_file() and stat.read_text().rpartition(")")[2].split()[0] == "Z")


@pytest.mark.parametrize(
    ("event", "given"),
    [
        ("open", ("/etc/passwd", "r", os.O_RDONLY)),
        ("open", ("/tmp/new", "w", os.O_WRONLY | os.O_CREAT)),  # noqa: S108 - never opened
        ("open", (b"/etc/passwd", "r", os.O_RDONLY)),
        ("socket.__new__", (None, socket.AF_INET)),
        ("subprocess.Popen", ("sh", [], None, None)),
        ("os.system", ("true",)),
        ("os.exec", ("sh", [], None)),
        ("os.fork", ()),
    ],
)
def test_the_reader_has_no_other_files_and_no_network(event, given):
    with pytest.raises(PermissionError):
        mesh_reader._guard(event, given)
    mesh_reader._guard("open", (os.__file__, "r", os.O_RDONLY))


def test_the_guard_is_up_where_files_are_read():
    """A library that opened a file in the reader would be refused, and the mesh with it."""
    program = (
        "import sys; sys.addaudithook(lambda e, g: print(e, file=sys.stderr))\n"
        "from grasp_core.mesh_files import child_main as mesh_reader\n"
        "mesh_reader.parsed_by_trimesh = lambda *_: open('/etc/hostname')\n"
        "mesh_reader.main('2048', '1')\n"
    )
    asked = b'{"kind": "obj", "bytes": %d, "max_seconds": 900, "max_triangles": 9}\n' % len(obj())
    ended = subprocess.run(
        [sys.executable, "-c", program], input=asked + obj().encode(), capture_output=True,
        check=False, timeout=HANGING_S,
    )  # fmt: skip
    assert b"GP-MESH-AMBIGUOUS" in ended.stdout
    assert b"PermissionError" in ended.stdout
