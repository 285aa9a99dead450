"""Documents are written as JSON with a line for each item."""

import pytest

from grasp_core.files.json_text import text_of

DOCUMENT = {
    "schema": 1,
    "object": {"name": "caf\u00e9\n", "mesh": {"corners": [[0.1, -0.0], [1e-300, 3.0]]}},
    "absence": None,
    "optimization": [],
    "ids": ["a", "b"],
    "grasps": [{"id": "c-1", "faces": (1, 2)}, {"id": "c-2", "faces": []}],
}


def test_each_key_and_each_item_of_a_list_of_objects_has_its_line():
    assert text_of(DOCUMENT).splitlines() == [
        "{",
        ' "schema": 1,',
        ' "object": {"name": "caf\\u00e9\\n", "mesh": {"corners": [[0.1, -0.0], [1e-300, 3.0]]}},',
        ' "absence": null,',
        ' "optimization": [],',
        ' "ids": ["a", "b"],',
        ' "grasps": [',
        '  {"id": "c-1", "faces": [1, 2]},',
        '  {"id": "c-2", "faces": []}',
        " ]",
        "}",
    ]


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("document", [lambda x: {"a": x}, lambda x: {"a": [{"b": [x]}]}])
def test_numbers_that_json_lacks_are_refused(number, document):
    with pytest.raises(ValueError, match="Out of range float values"):
        text_of(document(number))
