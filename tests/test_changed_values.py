"""A value that is changed is what `replace` makes of it, and remembers nothing of before."""

from dataclasses import dataclass, replace
from functools import cached_property

import pytest

from urdyn.types import changed


@dataclass(frozen=True)
class Pair:
    """Two numbers."""

    one: float
    other: float = 2.0

    @cached_property
    def sum(self) -> float:
        """Of both."""
        return self.one + self.other


def test_a_changed_value_is_what_replace_makes_of_it() -> None:
    pair = Pair(1.0)
    assert pair.sum == 3.0
    new = changed(pair, one=5.0)
    assert type(new) is Pair and new == replace(pair, one=5.0) and new.sum == 7.0
    assert pair == Pair(1.0)


def test_it_is_frozen_too() -> None:
    with pytest.raises(AttributeError):
        changed(Pair(1.0), one=2.0).one = 3.0  # type: ignore[misc]
