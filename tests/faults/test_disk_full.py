"""No space, or a disk that fails: one line that names a file, and whole files."""

import shutil
import subprocess
import sys

import pytest

from grasp_core.files.text_files import write_parts
from tests.faults.conftest import CLI, ROOT, contents

RUN = ["run", "tetrahedron", "--limit", "1", "--jobs", "1", "-q", "--no-report"]
READ_ONLY = "mount -t tmpfs -o ro none {} && exec "


def unshared(script):
    command = ["unshare", "-rm", "sh", "-c", script]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.fixture
def _can_mount(tmp_path):
    if not shutil.which("unshare") or unshared(READ_ONLY.format(tmp_path) + "true").returncode:
        pytest.skip("no file systems of our own here")


@pytest.mark.parametrize("failing", ["os.fsync", "pathlib.Path.replace", "pathlib.Path.chmod"])
def test_a_file_that_cannot_be_written_is_named_and_the_old_one_stays(
    failing, tmp_path, monkeypatch
):
    path = write_parts(tmp_path / "a.json", [b"old"])

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(failing, full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        write_parts(path, [b"new"])
    assert caught.value.filename == str(path)
    assert contents(tmp_path) == {"a.json": b"old"}


@pytest.mark.slow
@pytest.mark.usefixtures("_can_mount")
def test_a_folder_that_takes_no_files_is_refused_before_the_work(tmp_path):
    words = " ".join(f"'{word}'" for word in [*CLI, *RUN, "--out", str(tmp_path)])
    done = unshared(READ_ONLY.format(tmp_path) + words)
    assert done.returncode == 4
    assert done.stderr == (
        f"graspproof: {tmp_path}: no file can be written there (Read-only file system); "
        "give another --out\n"
    )


@pytest.mark.skipif(sys.platform != "linux", reason="/dev/full is Linux's")
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_full_standard_output_is_an_error_and_a_full_standard_error_is_none(stream, graspproof):
    with open("/dev/full", "w") as full:  # noqa: PTH123 - no file
        done = graspproof("objects", "--json", **{stream: full})
    assert done.returncode == (4 if stream == "stdout" else 0)
    if stream == "stdout":
        assert done.stderr == "graspproof: output: No space left on device\n"
