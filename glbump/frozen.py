"""Frozen dataclasses whose methods are shared, not generated: some sixty of them stand between the start of the process
and a first picture, and the code that `dataclass(frozen=True)` writes and compiles for each takes ten times as long to
make as all the rest of the class."""

from __future__ import annotations

from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, dataclass_transform

if TYPE_CHECKING:
    from inspect import Signature


class _Signature:
    """What `help` says a class is called with, made when it is asked for."""

    def __get__(self, _instance: object, cls: type[Frozen]) -> Signature:
        import inspect

        def parameter(one: Field[Any]) -> inspect.Parameter:
            kind = inspect.Parameter.KEYWORD_ONLY if one.kw_only else inspect.Parameter.POSITIONAL_OR_KEYWORD
            default = inspect.Parameter.empty if one.default_factory is MISSING else ...
            default = default if one.default is MISSING else one.default
            return inspect.Parameter(one.name, kind, default=default, annotation=one.type)

        made = sorted(map(parameter, cls._fields), key=lambda one: one.kind)
        return inspect.Signature(made, return_annotation=None)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class Frozen:
    """A subclass is a frozen dataclass, with no decorator: `fields`, `replace`, `asdict`, pickle and `match` know it.

    class Ball(Frozen): radius: float = 1. eq=False: equal to itself alone; kw_only=True: its fields by name alone.
    __post_init__ may store checked values with `_store`.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    _fields: ClassVar[tuple[Field[Any], ...]]
    __match_args__: ClassVar[tuple[str, ...]]
    __signature__ = _Signature()

    def __init_subclass__(cls, *, eq: bool = True, kw_only: bool = False) -> None:
        super().__init_subclass__()
        dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
        cls._fields = fields(cls)
        if not eq:
            cls.__eq__, cls.__hash__ = object.__eq__, object.__hash__  # type: ignore[method-assign]

    def __init__(self, *args: Any, **values: Any) -> None:
        cls, state = type(self), self.__dict__
        given = dict(zip(cls.__match_args__, args)) | values
        if len(given) < len(args) + len(values):
            self._refuse(args, values)
        for one in cls._fields:
            if one.name in given:
                state[one.name] = given.pop(one.name)
            elif one.default is not MISSING:
                state[one.name] = one.default
            elif one.default_factory is not MISSING:
                state[one.name] = one.default_factory()
            else:
                self._refuse(args, values)
        if given:
            self._refuse(args, values)
        self.__post_init__()

    def _refuse(self, args: tuple[Any, ...], values: dict[str, Any]) -> NoReturn:
        try:
            type(self).__signature__.bind(*args, **values)
        except TypeError as error:
            raise TypeError(f"{type(self).__qualname__}: {error}") from None
        raise AssertionError("these arguments fit")

    def __post_init__(self) -> None:
        """Checks, of those that have any."""

    def _store(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __setattr__(self, name: str, value: Any) -> None:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> None:
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def _values(self) -> tuple[Any, ...]:
        return tuple([getattr(self, one.name) for one in self._fields])

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if type(other) is type(self) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())

    def __repr__(self) -> str:
        values = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in self._fields)
        return f"{type(self).__qualname__}({values})"
