import dataclasses

import pytest

from sim_validate import Verdict
from sim_validate.validation.control_trials import ControlVerdict


@pytest.mark.parametrize(
    ("of", "old", "new"),
    [(Verdict, "controls_failed", "controls_let_go"), (ControlVerdict, "failed", "let_go")],
)
def test_an_old_name_is_refused_with_the_new_one(of, old, new):
    value = object.__new__(of)
    with pytest.raises(AttributeError, match=f"{of.__name__}.{old} is now called {new}"):
        getattr(value, old)
    assert isinstance(getattr(of, new), property)
    assert not hasattr(value, old)
    assert old not in {field.name for field in dataclasses.fields(of)}
