from functools import partial

import pytest

import grasp_core as gc
import scenes
from grasp_core.errors import InputError
from grasp_core.files.text_files import read_bytes, read_text, write_text
from sim_validate.files.array_files import read_arrays
from sim_validate.files.numpy_pickles import MOST_PICKLE_BYTES


def test_a_file_is_replaced_as_a_whole(tmp_path):
    path = tmp_path / "deep" / "a.json"
    assert write_text(path, "one") == path
    write_text(path, "two")
    assert read_text(path) == "two"
    assert [p.name for p in path.parent.iterdir()] == ["a.json"]


def test_a_failed_write_leaves_the_old_file_and_no_rest(tmp_path):
    path = write_text(tmp_path / "a.json", "one")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "\ud800")
    assert read_text(path) == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 123456\n"


@pytest.mark.parametrize("ending", ["obj", "stl", "ply", "off", "glb", "json", "npy", "xml", "npz"])
def test_a_pointer_of_git_lfs_is_called_what_it_is_by_every_reader(ending, tmp_path):
    path = tmp_path / f"file.{ending}"
    path.write_text(POINTER)
    read = {
        "json": gc.load_grasps, "npy": lambda path: read_bytes(path, MOST_PICKLE_BYTES),
        "xml": partial(scenes.hand_from_file, fingertips=("a", "b", "c")),
        "npz": lambda path: read_arrays(path, ()),
    }.get(ending, gc.load_polyhedron)  # fmt: skip
    with pytest.raises(InputError, match=r"pointer of Git LFS.*`git lfs pull`") as caught:
        read(path)
    assert str(path.name) in str(caught.value)


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_text(tmp_path / "none")
    for data, words in (
        (b"a\xff", "not UTF-8 text .* at byte 1"),
        (b"\xff\xfea\0", "byte order mark"),
        (b"\xef\xbb\xbf{}", "save it as UTF-8 without one"),
    ):
        (tmp_path / "binary").write_bytes(data)
        with pytest.raises(InputError, match=words):
            read_text(tmp_path / "binary")
