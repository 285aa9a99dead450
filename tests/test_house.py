"""The figures of the house, on packages that are made to break each rule."""

import pytest

from tests.house import PACKAGES, house, layers_of, upward


def made(folder, **texts):
    """A package of modules with the given texts; two underscores stand for a folder."""
    for name, text in {"__init__": "", **texts}.items():
        parts = [name] if name == "__init__" else name.split("__")
        path = folder.joinpath("packed", *parts).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_name("__init__.py").touch()
        path.write_text(text)
    return house("packed", folder)


def test_floors_are_the_longest_chain_of_rooms(tmp_path):
    found = made(
        tmp_path, low="", room__one="from packed.low import x", room__two="import packed.room.one",
        high="def f():\n    from packed.room import two",
    )  # fmt: skip
    assert found.floors == 3
    assert found.circles == []
    assert upward(found, ["high", "room", "low"]) == []
    assert upward(found, ["low | high", "room"]) == ["packed.room -> packed.low"]


@pytest.mark.parametrize(
    "texts",
    [
        {"a": "import packed.b", "b": "def f():\n    import packed.a"},
        {"a": "import packed.b", "b": "NAME = 'packed.a'"},
        {"one__x": "import packed.two.x", "two__x": "", "two__y": "import packed.one.x"},
    ],
    ids=["in a function", "by name", "of folders"],
)
def test_circles_of_files_and_folders_are_found(tmp_path, texts):
    assert made(tmp_path, **texts).circles


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_has_its_layer(package):
    rooms = {room.strip() for layer in layers_of(package) for room in layer.split("|")}
    found = house(package)
    assert {name.split(".")[1] for name in found.modules if "." in name} == rooms
    assert len(found.rooms) >= 5
