"""Looks up the published tests by name."""

from grasp_core.checked import one_of
from sim_validate.protocols.imitated_tests import IMITATED_TESTS
from sim_validate.protocols.mujoco_tests import MUJOCO_TESTS
from sim_validate.protocols.published import PublishedProtocol

PROTOCOLS = {protocol.name: protocol for protocol in (*MUJOCO_TESTS, *IMITATED_TESTS)}


def protocol_names() -> tuple[str, ...]:
    """Return the names of all published tests that grasps can be judged by."""
    return tuple(PROTOCOLS)


def protocol(name: str) -> PublishedProtocol:
    """Return a published test: its loads, durations and thresholds, with their sources.

    Args:
        name: One of `protocol_names()`.

    Raises:
        InputError: No test has this name.
    """
    one_of(name, PROTOCOLS, "name")
    return PROTOCOLS[name]
