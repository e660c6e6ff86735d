"""Frozen classes behave as `dataclass(frozen=True)` makes them."""

from __future__ import annotations

import copy
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar

import pytest

from glbump.frozen import Frozen


class Common(Frozen, kw_only=True):
    """What kinds share."""

    kind: ClassVar[str] = "none"
    turn: float = 0.0


class Ball(Common):
    """One kind."""

    kind: ClassVar[str] = "ball"
    name: str
    radius: float = 1.0
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class CommonModel:
    """The same, as the library makes it."""

    kind: ClassVar[str] = "none"
    turn: float = 0.0


@dataclass(frozen=True)
class BallModel(CommonModel):
    """One kind."""

    kind: ClassVar[str] = "ball"
    name: str
    radius: float = 1.0
    notes: list[str] = field(default_factory=list)


class Checked(Frozen):
    """Stores what it has checked."""

    size: tuple[int, ...] = (1,)

    def __post_init__(self) -> None:
        self._store(size=tuple(self.size))


class Same(Frozen, eq=False):
    """Equal to itself alone."""

    name: str = "same"


@pytest.mark.parametrize(
    "say",
    [
        lambda ball: repr(ball("a", 2.0, turn=3.0)).replace("BallModel", "Ball"),
        lambda ball: asdict(ball("a")),
        lambda ball: [f.name for f in fields(ball)],
        lambda ball: vars(ball("a", notes=["x"])),
        lambda ball: ball.__match_args__,
        lambda ball: vars(replace(ball("a", turn=1.0), radius=4.0)),
        lambda ball: (ball("a") == ball("a"), ball("a") == ball("b"), ball("a") == "a"),
        lambda ball: hash(ball("a", notes=())) == hash(ball("a", notes=())),
        lambda ball: [p.kind for p in inspect.signature(ball).parameters.values()],
        lambda ball: [p.default for n, p in inspect.signature(ball).parameters.items() if n != "notes"],
        lambda ball: is_dataclass(ball),
    ],
)
def test_says_what_a_dataclass_says(say: Callable[[Any], Any]) -> None:
    assert say(Ball) == say(BallModel)


@pytest.mark.parametrize("ball", [Ball, BallModel])
@pytest.mark.parametrize(
    ("args", "values"),
    [((), {}), (("a", 1.0, [], 4.0), {}), (("a",), {"name": "b"}), (("a",), {"colour": 1}), ((), {"radius": 1.0})],
)
def test_wrong_calls(ball: Any, args: tuple[Any, ...], values: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match=ball.__name__):
        ball(*args, **values)


def test_each_has_a_list_of_its_own() -> None:
    assert Ball("a").notes is not Ball("a").notes


def test_nothing_can_be_set_or_deleted() -> None:
    ball = Ball("a")
    with pytest.raises(FrozenInstanceError, match="'name'"):
        ball.name = "b"  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError, match="'name'"):
        del ball.name
    assert ball == Ball("a")


def test_pickles_and_copies() -> None:
    ball = Ball("a", 3.0, turn=2.0)
    for other in (pickle.loads(pickle.dumps(ball)), copy.copy(ball), copy.deepcopy(ball)):
        assert other == ball
        assert type(other) is Ball


def test_what_was_checked_is_stored() -> None:
    assert Checked([1, 2]).size == (1, 2)  # type: ignore[arg-type]
    assert replace(Checked(), size=[3]).size == (3,)  # type: ignore[arg-type]


def test_equal_to_itself_alone() -> None:
    one, other = Same(), Same()
    assert one == one
    assert one != other
    assert len({one, other}) == 2


def test_matches() -> None:
    match Ball("a", 2.0):
        case Ball(name, radius):
            assert (name, radius) == ("a", 2.0)
        case _:
            pytest.fail("no match")
