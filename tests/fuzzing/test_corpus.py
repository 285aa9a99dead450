"""Every seed and every input that fuzzing has found, read once more."""

import pytest

from grasp_core.errors import InputError
from tests.fuzzing.minimising import minimised
from tests.fuzzing.running import harm
from tests.fuzzing.targets import CORPUS, FoundError, Target, targets


@pytest.mark.parametrize("name", targets())
def test_no_input_does_harm(name):
    target, accepted = targets()[name], 0
    for said, data in target.inputs():
        try:
            accepted += target.check(data)
        except Exception as error:
            raise AssertionError(f"{name}: {said}: {error!r:.1000}") from error
    assert accepted >= 1  # else nothing is compared with what is written


@pytest.mark.parametrize("name", targets())
def test_what_is_whole_is_read(name):
    target = targets()[name]
    assert all([target.check(data) for data in target.seeds()])


def test_every_folder_of_inputs_is_of_a_reader():
    folders = {path.name for path in CORPUS.iterdir() if path.is_dir()}
    assert folders <= set(targets())


def _reads(data):
    if data == b"boom":
        raise KeyError("boom")
    return data


def test_harm_is_an_error_or_another_reading_or_a_long_message():
    def differs(data, _):
        assert data != b"other"

    target = Target("t", _reads, lambda: [b"good"], differs)
    assert target.check(b"good")
    assert harm(target, b"boom") == "KeyError-reading"
    with pytest.raises(FoundError, match="not what is written"):
        target.check(b"other")

    def refuses(_):
        raise InputError("a\n" * 9)

    with pytest.raises(FoundError, match="9 lines"):
        Target("t", refuses, lambda: []).check(b"")


def test_inputs_are_made_small():
    assert minimised(b"abcxdefyghi" * 20, lambda data: b"x" in data and b"y" in data) == b"xy"
