"""Files of results with changes, as another program or a hand would leave them."""

import json


def changed(path, change):
    """Change the document of a JSON file in its place, and return it."""
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return document


def first_grasp(**values):
    """A change of the first grasp that a document lists."""
    return lambda document: document["grasps"][0].update(values)
