"""How inner loops are declared, kept, and loaded where numba is as it should be, and where not."""

import sys

import pytest

from grasp_core.compiled import compiled, loop, state_of
from grasp_core.errors import InputError

KERNEL = "grasp_core.solvers.lp_kernel"


def half(x):
    return x / 2.0


def inverse(x):
    return 1.0 / x


def inverse_or_infinity(x):
    return 1.0 / x


def test_a_kernel_is_loaded_compiled_and_kept():
    assert state_of(compiled(KERNEL).solve) == "kept"


def test_without_a_folder_a_loop_is_compiled_but_not_kept(monkeypatch):
    monkeypatch.setattr("grasp_core.kept_loops.folder_for", lambda *_: None)
    declared = loop()(half)
    assert declared(3.0) == 1.5
    assert len(declared.signatures) == 1
    assert state_of(declared) == "not kept"


def test_division_by_zero_is_an_error_unless_it_is_asked_for():
    with pytest.raises(ZeroDivisionError):
        loop()(inverse)(0.0)
    assert loop("numpy")(inverse_or_infinity)(0.0) == float("inf")


def test_numba_can_leave_loops_to_python(monkeypatch):
    monkeypatch.setattr("numba.core.config.DISABLE_JIT", True)
    assert state_of(loop()(half)) == "interpreted"
    assert loop()(half)(3.0) == 1.5


@pytest.mark.parametrize(
    "error", [ImportError("no llvmlite"), ValueError("NUMBA_NUM_THREADS"), OSError("no such file")]
)
def test_a_numba_that_cannot_be_loaded_is_named_with_what_to_do(monkeypatch, error):
    class Broken:
        def find_spec(self, name, *_):
            if name == KERNEL:
                raise error

    monkeypatch.delitem(sys.modules, KERNEL, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    with pytest.raises(InputError, match=f"numba can be loaded, got: {error}; unset"):
        compiled.__wrapped__(KERNEL)


def test_a_kernel_that_does_not_exist_is_no_fault_of_numba():
    with pytest.raises(ModuleNotFoundError, match="no_kernel"):
        compiled.__wrapped__("grasp_core.solvers.no_kernel")
