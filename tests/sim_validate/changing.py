"""Files of results with changes, as another program or a hand would leave them."""

import json
from dataclasses import replace

from sim_validate.closure.verdict import Verdicts
from sim_validate.engine.held_or_let_go import Outcome


def changed(path, change):
    """Change the document of a JSON file in its place, and return it."""
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return document


def at(*place, **values):
    """A change of the object that keys and numbers in lists lead to in a document."""

    def change(document):
        for key in place:
            document = document[key]
        document.update(values)

    return change


def changed_verdicts(path, change):
    """Write a verdicts.json again, whole and without contradictions, with a change of its value."""
    path.write_text(change(Verdicts.read(path)).text())


def slipped(verdict, place=0):
    """The verdict in which the object slipped in one trial."""
    trial = verdict.wrenches[place]
    trial = replace(trial, hold=replace(trial.hold, outcome=Outcome.SLIPPED))
    wrenches = (*verdict.wrenches[:place], trial, *verdict.wrenches[place + 1 :])
    return replace(verdict, wrenches=wrenches)
