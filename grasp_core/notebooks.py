"""Shows values as pictures at the end of a notebook's cell, where `scenes` draws them."""

from collections.abc import Callable
from typing import Any

Draw = Callable[[Any], str | None]
"""A function that returns the HTML of a value, or None where it has no picture of it."""
_DRAWN_WITH: list[Draw] = []
"""The function that was handed over, or none."""


class InNotebooks:
    """Base of values that show a picture at the end of a notebook's cell, if `scenes` draws one."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """Return HTML with a picture; None where there is none, so that notebooks show `repr`."""
        try:
            return self._html()
        except Exception:  # a picture that fails must not hide the value, which still has a text
            return None

    def _html(self) -> str | None:
        return _DRAWN_WITH[0](self) if _DRAWN_WITH else None


def draw_with(draw: Draw) -> None:
    """Hand over the function that draws values; a second one takes the place of the first."""
    _DRAWN_WITH[:] = [draw]
