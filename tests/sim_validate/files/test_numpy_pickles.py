"""What NumPy has pickled is read as NumPy reads it; nothing in a file is executed or trusted."""

import io
import os
import pickle

import numpy as np
import pytest

from grasp_core.errors import InputError
from sim_validate.files import numpy_pickles
from sim_validate.files.numpy_pickles import unpickled
from tests.sim_validate.judge.recorded import listed, pickled

TABLE = {
    "text": "assets/ä", "number": 3, "large": 10**30, "float": 0.1, "none": None, "yes": True,
    "scalar": np.float32(0.25), "whole": np.int64(-7), "truth": np.bool_(True),
    "single": np.linspace(0, 1, 6, dtype=np.float32).reshape(2, 3),
    "big endian": np.arange(5, dtype=">f8"),
    "by columns": np.asfortranarray(np.arange(24.0).reshape(2, 3, 4)),
    "empty": np.zeros((0, 4)), "no axes": np.array(2.5),
    "lists": [[1.0, 2.0], ["a", ("b", 3)], []], "inner": {"a": {"b": np.arange(3)}},
}  # fmt: skip


def same(found, wanted):
    if isinstance(wanted, dict):
        return found.keys() == wanted.keys() and all(same(found[k], wanted[k]) for k in wanted)
    if isinstance(wanted, list | tuple):
        return type(found) is type(wanted) and all(map(same, found, wanted))
    return np.array_equal(found, wanted) and np.shape(found) == np.shape(wanted)


@pytest.mark.parametrize("protocol", range(6))
def test_values_are_those_that_numpy_reads(protocol):
    table = {k: v for k, v in TABLE.items() if protocol > 2 or k != "empty"}
    assert same(unpickled(pickled(table, protocol)), table)
    assert same(unpickled(pickled(listed([table, {"a": 1}]), protocol)), [table, {"a": 1}])
    inner = {"objects": listed([{"x": 1.5}, {"x": 2.5}])}
    assert same(unpickled(pickled(inner, protocol)), {"objects": [{"x": 1.5}, {"x": 2.5}]})


def test_an_array_that_is_named_twice_is_the_same_array():
    array = np.arange(3.0)
    found = unpickled(pickled({"a": array, "b": [array, array]}))
    assert found["a"] is found["b"][0] is found["b"][1]
    assert found["a"].tolist() == [0.0, 1.0, 2.0]


class Calls:
    """Unpickling this calls a function."""

    def __init__(self, called, *given):
        self.made = (called, given)

    def __reduce__(self):
        return self.made


@pytest.mark.parametrize("protocol", range(6))
def test_nothing_is_executed(protocol, tmp_path):
    mark = tmp_path / "executed"
    calls = (Calls(os.system, f"touch {mark}"), Calls(exec, f"open({str(mark)!r}, 'w')"),
             Calls(np.load, str(mark)), Calls(getattr, "a", "b"))  # fmt: skip
    for harm in (*calls, {1, 2}, complex(1, 2)):
        data = pickled({"harm": harm}, protocol)
        with pytest.raises(InputError, match=r"which is not looked up|has the step"):
            unpickled(data)
    assert not mark.exists()


def steps(body):
    """A `.npy` file with steps of one's own."""
    return pickled({})[: -len(pickle.dumps(np.array({}, dtype=object), protocol=4))] + body


DEEP = 300_000


@pytest.mark.parametrize(
    "body",
    [
        b"})" + b"\x85" * DEEP + b"Ns.", b"r\xff\xff\xff\x7f.", b"Nr\xff\xff\xff\x7f.",
        b"\x8e" + b"\xff" * 7 + b"\x3fa.", b"\x96" + b"\xff" * 6 + b"\0\0a.",
        b"\x95" + b"\xff" * 7 + b"\x3fN.", b"(" * DEEP + b".", b"\x8a\xff" + b"\xff" * 20,
        b"I" + b"9" * 5000 + b"\n.", b"N)b.", b"N)R.", b"h\x00.", b"N(e.",
        b"cnumpy\nndarray\n)R.", b"cnumpy\ndtype\n)R.", b"cnumpy\ndtype\n(]tR.", b"P0\n.",
        b"cnumpy\nndarray\n)R(NNNNtb.", b"c__builtin__\nset\n.", b"\x82\x01.", b"\x97.", b"",
        b"".join(b"Np%d\n" % (-k * (2**61 - 1)) for k in range(1, 20_000)) + b".",
    ],
    ids=lambda body: repr(body[:12]),
)  # fmt: skip
@pytest.mark.timeout(60)
def test_steps_that_ask_for_anything_else_are_refused(body):
    """A tuple that is nested deeply as a key would end Python itself."""
    with pytest.raises(InputError):
        unpickled(steps(body))


def test_values_may_be_nested_to_any_depth():
    found = unpickled(steps(b"]" * DEEP + b"a" * (DEEP - 1) + b"."))
    for _ in range(DEEP - 2):
        (found,) = found
    assert found == []


def test_arrays_are_as_large_as_they_say():
    good = pickled({"a": np.arange(4.0)})
    for wrong in (b"K\x05", b"J\xff\xff\xff\x7f", b"J\xff\xff\xff\xff", b"N", b"]", b"\x88"):
        with pytest.raises(InputError):
            unpickled(good.replace(b"K\x04\x85", wrong + b"\x85", 1))
    assert good.count(b"K\x04\x85") == 1


def test_memory_is_bounded_by_steps(monkeypatch):
    monkeypatch.setattr(numpy_pickles, "MOST_STEPS", 1000)
    assert len(unpickled(pickled(listed([{"a": 1.0}] * 150)))) == 150
    with pytest.raises(InputError, match="more than 1000 steps; save fewer"):
        unpickled(pickled(listed([{"a": 1.0} for _ in range(300)])))


def test_damage_is_refused():
    rng = np.random.default_rng(0)
    plain = {"a": np.arange(3.0), "b": "c"}
    whole = {p: pickled(TABLE if p > 2 else plain, p) for p in (0, 2, 4, 5)}
    refused = 0
    for turn in range(1200):
        data = bytearray(whole[(0, 2, 4, 5)[turn % 4]])
        data[rng.integers(len(data))] = rng.integers(256)
        try:
            unpickled(bytes(data[: rng.integers(1, len(data) + 1)]))
        except InputError:
            refused += 1
    assert refused > 1000
    for end in range(len(whole[4])):
        with pytest.raises(InputError):
            unpickled(whole[4][:end])


@pytest.mark.parametrize(
    ("value", "said"),
    [(np.zeros(3), r"an array of numbers of shape \(3,\)"), (np.array(["a"]), "array of numbers")],
)
def test_arrays_of_numbers_are_no_records(value, said):
    held = io.BytesIO()
    np.save(held, value)
    with pytest.raises(InputError, match=said):
        unpickled(held.getvalue())
