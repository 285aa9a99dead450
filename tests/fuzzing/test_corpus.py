"""Every seed and every input that fuzzing has found, read once more."""

import pytest

from tests.fuzzing.targets import targets


@pytest.mark.parametrize("name", targets())
def test_no_input_does_harm_and_what_is_whole_is_read(name):
    target = targets()[name]
    for said, data in target.inputs():
        try:
            accepted = target.check(data)
        except Exception as error:
            raise AssertionError(f"{name}: {said}: {error!r:.1000}") from error
        assert accepted or not said.startswith("seed"), said
