"""Kernels on and off."""

import pytest

from grasp_core.compiled import SWITCH, compiled


@pytest.fixture
def afresh():
    """What the environment says counts from here on, and no longer afterwards."""
    compiled.cache_clear()
    yield
    compiled.cache_clear()


@pytest.fixture
def without_kernels(monkeypatch, afresh):  # noqa: ARG001 - used for what it leaves behind
    """Leaves everything to the reference as soon as it is called."""

    def switch_off():
        monkeypatch.setenv(SWITCH, "off")
        compiled.cache_clear()

    return switch_off
