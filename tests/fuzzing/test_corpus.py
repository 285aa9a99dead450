"""Every seed and every input that fuzzing has found, read once more."""

import pytest

from tests.fuzzing.targets import CORPUS, FoundError, Target, targets


@pytest.mark.parametrize("name", targets())
def test_no_input_does_harm_and_what_is_whole_is_read(name):
    target = targets()[name]
    for said, data in target.inputs():
        try:
            accepted = target.check(data)
        except Exception as error:
            raise AssertionError(f"{name}: {said}: {error!r:.1000}") from error
        assert accepted or not said.startswith("seed"), said


def test_every_folder_of_inputs_is_of_a_reader():
    folders = {path.name for path in CORPUS.iterdir() if path.is_dir()}
    assert folders <= set(targets())


def test_another_reading_is_harm():
    def differs(data, _):
        assert data != b"other"

    target = Target("t", lambda data: data, lambda: [b"good"], differs)
    assert target.check(b"good")
    with pytest.raises(FoundError, match="not what is written"):
        target.check(b"other")
