"""Everyday tests repeat the baselines of two objects; those of all others are slow."""

from pathlib import Path

from tests.marks import MORE

HERE = Path(__file__).parent
EVERYDAY = ("screwdriver", "wedge")


def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.is_relative_to(HERE) and item.path.parent.name not in EVERYDAY:
            for mark in MORE:
                item.add_marker(mark)
