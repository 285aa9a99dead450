"""All cases, by group."""

from tests.bad_input import of_binary_meshes, of_files, of_obj, of_topology
from tests.bad_input.cases import Case

GROUPS = (of_files, of_obj, of_binary_meshes, of_topology)


def all_cases() -> list[Case]:
    """Every case of every group."""
    return [case for group in GROUPS for case in group.cases()]
