"""Declares frozen values once: dataclasses of pydantic that are compared and shown by their fields.

    @declared
    class Contact(Declared):
        position: Point
        \"\"\"Point on the surface [m].\"\"\"
        normal: UnitVector
        \"\"\"Unit vector into the object.\"\"\"

The constructor checks each field by its type (see `allowed_values`) and keeps it in plain form:
arrays copied and read-only. `is_sound` checks a value again that may come from anywhere.
"""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, field, fields, is_dataclass
from functools import cache
from inspect import Parameter, Signature
from typing import Any, ClassVar, TypeVar, cast, dataclass_transform, get_type_hints, overload

from pydantic import ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic.dataclasses import dataclass
from pydantic_core import ArgsKwargs, CoreSchema, core_schema

from grasp_core.allowed_values import FLAT, adapter, bare, input_error, rules, strictly
from grasp_core.by_value import ByValue, is_array, same
from grasp_core.errors import InputError
from grasp_core.messages import FieldError

Item = TypeVar("Item")


class Arguments:
    """The signature of a constructor, which pydantic knows only once it was used."""

    def __get__(self, _: object, kind: type) -> Signature:
        """Return the arguments that set fields; none for a base without fields."""
        if not is_dataclass(kind):
            return Signature()
        ways = {True: Parameter.KEYWORD_ONLY, False: Parameter.POSITIONAL_OR_KEYWORD}
        listed = sorted(fields(kind), key=lambda each: bool(each.kw_only))
        usual = {each.name: default_of(each) for each in listed}
        return Signature([
            Parameter(name, ways[bool(each.kw_only)], annotation=each.type,
                      default=Parameter.empty if usual[name] is MISSING else usual[name])
            for each in listed if each.init for name in [each.name]
        ])  # fmt: skip


class Declared(ByValue):
    """Base of frozen dataclasses whose fields pydantic checks against their types."""

    __slots__ = ()
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(
        extra="forbid",
        defer_build=True,  # most commands make values of few classes
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        validate_by_name=True,
        validate_by_alias=False,  # names in Python, aliases in files
        serialize_by_alias=True,
    )

    __signature__ = Arguments()

    def __post_init__(self) -> None:
        try:
            check_letters(self)
            self._check_together()
        except InputError as error:
            raise ValueError(error) from error  # so that pydantic adds its place

    def _check_together(self) -> None:
        """Refuse fields that do not fit each other; classes replace it where some may not."""

    def is_sound(self) -> bool:
        """Return whether every field is as the constructor would keep it, whoever set it."""
        try:
            given = {name: getattr(self, name) for name in types(type(self))}
            kept = adapter(type(self)).validate_python(given)  # whatever a subclass constructs
        except (ValidationError, InputError, AttributeError):
            return False
        same = all(_is_kept(getattr(kept, name), value) for name, value in given.items())
        return same and self._is_consistent()

    def _is_consistent(self) -> bool:
        """Return whether sound fields fit each other as proofs need, beyond `_check_together`."""
        return True

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Take no text for numbers, and keys of flat parts from among the record's own."""
        made, flat = handler(source), flat_parts(cls)
        own: Any = handler.resolve_ref_schema(made)
        strictly(own["schema"])
        if "__signature__" in vars(cls):  # pydantic's, which has fields that are not given, too
            delattr(cls, "__signature__")
        if flat:
            own["serialization"] = core_schema.wrap_serializer_function_ser_schema(
                lambda value, write: _flattened(write(value), flat)
            )

        def checked(given: Any, check: Any, info: core_schema.ValidationInfo[Any]) -> Any:
            if not isinstance(given, ArgsKwargs):  # a part: who takes the whole names its place
                return check(_nested(given, flat) if flat and info.context else given)
            try:
                return check(given)
            except ValidationError as error:
                fault = input_error(cls, error)
            if isinstance(fault, FieldError):
                fault.owner = cls
            raise fault

        return core_schema.with_info_wrap_validator_function(checked, made)


def _flattened(found: dict[str, Any], flat: Mapping[str, type]) -> dict[str, Any]:
    """Move the keys of flat parts among those of the record."""
    plain: dict[str, Any] = {}
    for name, value in found.items():
        plain |= (value or {}) if name in flat else {name: value}
    return plain


def _nested(found: Any, flat: Mapping[str, type]) -> Any:
    """Give each flat part all keys of the record; a part of which there are none is None."""
    if not isinstance(found, dict):
        return found
    given, nested = cast("dict[str, Any]", found), dict[str, Any]()
    for name, kind in flat.items():
        infos: Mapping[str, Any] = cast("Any", kind).__pydantic_fields__
        some = any((info.alias or key) in given for key, info in infos.items() if not info.exclude)
        nested[name] = given if some else None
    return given | nested


@overload
def declared(kind: type[Item], /) -> type[Item]: ...
@overload
def declared(*, slots: bool = True) -> Callable[[type[Item]], type[Item]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def declared(kind: Any = None, /, *, slots: bool = True) -> Any:
    """Make a subclass of `Declared` a frozen dataclass of pydantic."""
    made = dataclass(frozen=True, slots=slots, eq=False, repr=False)
    return made if kind is None else made(kind)


def check_letters(value: object) -> None:
    """Refuse arrays whose lengths differ where their shapes say the same letter."""
    sizes: dict[str, tuple[int, str]] = {}
    for name, shape in _lettered(type(value)):
        array = getattr(value, name)
        for letter, size in zip(shape, getattr(array, "shape", ()), strict=False):
            if isinstance(letter, str):
                known, first = sizes.setdefault(letter, (size, name))
                if known != size:
                    raise FieldError(name, f"must have one entry for each of the {known} of "
                                     f"{first}, got {size}")  # fmt: skip


@cache
def _lettered(kind: type) -> tuple[tuple[str, tuple[Any, ...]], ...]:
    """Return the names of arrays some of whose lengths have a letter, and their shapes."""
    shapes = ((name, getattr(rule, "shape", ()))
              for name, each in types(kind).items() for rule in rules(each))  # fmt: skip
    return tuple((name, shape) for name, shape in shapes if any(isinstance(n, str) for n in shape))


@cache
def types(kind: type) -> Mapping[str, Any]:
    """Return the types of a dataclass's fields, with their rules."""
    hints = get_type_hints(kind, include_extras=True)
    return {each.name: hints[each.name] for each in fields(cast("Any", kind)) if each.init}


@cache
def flat_parts(kind: type) -> Mapping[str, type]:
    """Return the classes of the parts whose keys stand among those of the record, by name."""
    return {name: bare(each) for name, each in types(kind).items() if FLAT in rules(each)}


def default_of(each: Field[Any]) -> Any:
    """Return the default of a field; `MISSING` if it has none."""
    return each.default if each.default_factory is MISSING else each.default_factory()


def trusted(kind: type[Item], /, **given: Any) -> Item:
    """Make a frozen value of fields that were checked before, unchecked and uncopied."""
    made, put = object.__new__(kind), object.__setattr__
    for name in given:
        put(made, name, given[name])
    return made


def altered(value: Item, /, **given: Any) -> Item:
    """Copy a frozen value with some other fields, which were checked before, unchecked."""
    own = {name: getattr(value, name) for name in cast("Any", value).__dataclass_fields__}
    return trusted(type(value), **own | given)


def _is_kept(kept: Any, value: Any) -> bool:
    """Return whether a value is what the constructor keeps of it, and not only equal to that."""
    if isinstance(kept, Declared):
        return kept is value and Declared.is_sound(kept)  # whatever a subclass says
    if is_array(kept):
        return type(value) is type(kept) and value.dtype == kept.dtype and same(kept, value)
    if isinstance(kept, tuple):
        items = cast("tuple[Any, ...]", kept)
        return (isinstance(value, tuple) and len(items) == len(cast("Any", value))
                and all(map(_is_kept, items, cast("Any", value))))  # fmt: skip
    if isinstance(kept, Mapping):
        table, given = cast("Mapping[Any, Any]", kept), cast("Mapping[Any, Any]", value)
        return (isinstance(value, Mapping) and table.keys() == given.keys()
                and all(_is_kept(table[key], given[key]) for key in table))  # fmt: skip
    plain = (float, int) if isinstance(kept, float) else (type(cast("object", kept)),)
    return isinstance(value, plain) and same(kept, value)
