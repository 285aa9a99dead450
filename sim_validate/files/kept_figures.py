"""Makes classes of records of figures of other classes, which baselines and tables keep."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, cast

from grasp_core.allowed_values import inside
from grasp_core.declared import Declared, declared, types
from grasp_core.figures import Figure

Own = TypeVar("Own", bound="Kept")


class Kept(Declared):
    """Base of records of the figures of another class, which `keeps` gives them."""

    __slots__ = ()
    FIGURES: ClassVar[Mapping[str, Figure]] = {}
    """The figures, by name; a class may have other parts of the records besides."""
    DIGITS: ClassVar[int | None] = None
    """Number of digits that numbers are kept to; None for all of them."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a figure; which there are says the other class."""

    @classmethod
    def of(cls, record: object) -> Self:
        """Take the figures of a record: of a list that is kept as a number, how many items."""
        found: dict[str, Any] = {}
        for name, kind in types(cls).items():
            own, part = cls.FIGURES.get(name), inside(kind, Kept)
            value = getattr(record, name) if own is None else own.of(record)
            if part is not None:
                value = None if value is None else part.of(value)
            elif isinstance(value, tuple) and inside(kind, int):
                value = len(cast("tuple[Any, ...]", value))
            elif isinstance(value, float) and cls.DIGITS:
                value = float(f"{value:.{cls.DIGITS}g}")
            found[name] = value
        return cls(**found)


def keeps(listed: Iterable[Figure], digits: int | None = None) -> Callable[[type[Own]], type[Own]]:
    """Return what makes a class of records of some figures, with fields of their kinds."""

    def made(own: type[Own]) -> type[Own]:
        own.FIGURES, own.DIGITS = {each.name: each for each in listed}, digits
        kinds = {name: each.kind for name, each in own.FIGURES.items()}
        own.__annotations__ = {**inspect.get_annotations(own), **kinds}
        return declared(own)

    return made
