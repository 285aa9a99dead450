"""What units of work have in common arrives once."""

import pickle

from sim_validate.parallel.shared import Shared


def test_what_was_sent_twice_arrives_as_one():
    value = frozenset({"a", "b"})
    first, second = (pickle.loads(pickle.dumps(Shared(value))) for _ in range(2))  # noqa: S301
    assert first.value == value
    assert first.value is second.value
    assert first.value is not value


def test_another_value_arrives_as_another():
    first, second = (pickle.loads(pickle.dumps(Shared(value))) for value in ("a", "b"))  # noqa: S301
    assert (first.value, second.value) == ("a", "b")
