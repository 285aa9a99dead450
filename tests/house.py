"""The house in figures: rooms, floors, circles, and imports against the order of the rooms.

    python -m tests.house

A room is a file or a folder directly inside a package. One room stands on another if a module of it
imports a module of the other, wherever in the file, or loads it by name. The floors of a package
are the rooms of the longest such tower. The command fails where a bound is exceeded.
"""

import ast
import itertools
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parent.parent
PACKAGES = ("grasp_core", "scenes", "sim_validate")
MOST_FLOORS = {"grasp_core": 11, "scenes": 8, "sim_validate": 8}

Edges = set[tuple[str, str]]


@dataclass(frozen=True)
class House:
    """What one package is made of."""

    package: str
    modules: dict[str, Path]
    """Files by dotted name."""
    imports: Edges
    """Pairs of module names; the first imports the second."""

    @property
    def rooms(self) -> Edges:
        """Pairs of rooms; the first stands on the second."""
        return between(self.package, self.imports)

    @property
    def floors(self) -> int:
        """Rooms of the longest tower."""
        return tower({room_of(self.package, name) for name in self.modules}, self.rooms)

    @property
    def circles(self) -> list[list[str]]:
        """Groups of files, or of files and folders in one folder, that import each other."""
        folders = {name for name, path in self.modules.items() if _is_init(path)}
        pairs = [between(folder, self.imports) for folder in sorted(folders)]
        return [circle for edges in (self.imports, *pairs) for circle in circles(edges)]


def house(package: str, root: Path = ROOT) -> House:
    """Read the modules of a package, and what they import of their own package."""
    modules = {_name(path, root): path for path in sorted((root / package).rglob("*.py"))}
    imports = {
        (name, target)
        for name, path in modules.items()
        for target in _imported(path, set(modules))
        if target != name
    }
    return House(package, modules, imports)


def between(folder: str, imports: Edges) -> Edges:
    """Imports between the files and folders directly inside a folder."""
    inside = {pair for pair in imports if all(name.startswith(f"{folder}.") for name in pair)}
    pairs = {(room_of(folder, one), room_of(folder, other)) for one, other in inside}
    return {(one, other) for one, other in pairs if one != other}


def room_of(folder: str, name: str) -> str:
    """The file or folder directly inside a folder that a module belongs to."""
    return ".".join(name.split(".")[: folder.count(".") + 2])


def circles(edges: Edges) -> list[list[str]]:
    """Names that import each other, directly or through others."""
    names = sorted({name for pair in edges for name in pair})
    if not names:
        return []
    ends = np.array([[names.index(name) for name in pair] for pair in edges])
    graph = coo_array((np.ones(len(ends)), ends.T), shape=(len(names),) * 2)
    _, labels = connected_components(graph, connection="strong")
    groups = [[name for name, at in zip(names, labels, strict=True) if at == label]
              for label in np.unique(labels)]  # fmt: skip
    return [group for group in groups if len(group) > 1]


def tower(rooms: Iterable[str], edges: Edges) -> int:
    """Rooms in the longest chain of imports; those of a circle count as one."""
    home = {room: room for room in rooms}
    for circle in circles(edges):
        home.update(dict.fromkeys(circle, circle[0]))
    heights = dict.fromkeys(home.values(), 1)
    apart = {(home[one], home[other]) for one, other in edges if home[one] != home[other]}
    for _ in heights:
        for one, other in apart:
            heights[one] = max(heights[one], heights[other] + 1)
    return max(heights.values())


def upward(found: House, layers: list[str]) -> list[str]:
    """Imports of a module by one on the same or a lower layer, beside those within a room.

    Args:
        found: A package.
        layers: Its rooms from the highest layer to the lowest; `|` is between rooms of one layer.
    """
    order = {f"{found.package}.{room.strip()}": place
             for place, layer in enumerate(layers) for room in layer.split("|")}  # fmt: skip
    return [f"{one} -> {other}" for one, other in sorted(found.rooms)
            if order.get(other, len(order)) <= order.get(one, -1)]  # fmt: skip


def layers_of(package: str) -> list[str]:
    """The rooms of a package from above, by the import contract in `pyproject.toml`."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    wanted = [c["layers"] for c in settings["contracts"] if c.get("containers") == [package]]
    return list(itertools.chain.from_iterable(wanted))


def _imported(path: Path, modules: set[str]) -> Iterator[str]:
    """Modules that a file imports anywhere in it, or names in a text."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield from {whole, node.module} & modules if whole not in modules else {whole}
        elif isinstance(node, ast.Import):
            yield from {alias.name for alias in node.names} & modules
        elif isinstance(node, ast.Constant) and node.value in modules - set(PACKAGES):
            yield str(node.value)


def _name(path: Path, root: Path) -> str:
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if _is_init(path) else parts)


def _is_init(path: Path) -> bool:
    return path.stem == "__init__"


def main() -> int:
    """Print the figures; 1 if one is beyond its bound."""
    good = True
    for package in PACKAGES:
        found, layers = house(package), layers_of(package)
        against = upward(found, layers)
        lines = sum(len(path.read_text().splitlines()) for path in found.modules.values())
        rooms = {room_of(package, name) for name in found.modules} - {package}
        print(
            f"{package}: {len(found.modules)} modules of {lines} lines in {len(rooms)} rooms on "
            f"{found.floors} floors (at most {MOST_FLOORS[package]}), {len(found.rooms)} imports "
            f"between rooms; {len(found.circles)} circles, {len(against)} upward imports"
        )
        for circle in found.circles:
            print("    circle:", ", ".join(circle))
        for line in against:
            print("    upward:", line)
        good &= found.floors <= MOST_FLOORS[package]
        good &= not found.circles and not against
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
