"""Work shared among processes gives what one process gives."""

from __future__ import annotations

import operator

import pytest

from towtank.parallel import each


@pytest.mark.parametrize("workers", [1, 2])
def test_answers_come_in_the_order_of_the_items(workers: int) -> None:
    assert list(each(operator.mul, 3, range(20), workers)) == [3 * i for i in range(20)]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_exception_of_one_item_is_raised_here(workers: int) -> None:
    with pytest.raises(ZeroDivisionError):
        list(each(operator.truediv, 1.0, [1.0, 0.0, 2.0], workers))
