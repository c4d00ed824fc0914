"""Fixtures that several topics share."""

from collections.abc import Iterator

import pytest

import mjenv


@pytest.fixture
def env() -> Iterator[mjenv.Environment]:
    """An Ant-v5 that has been reset with seed 3."""
    with mjenv.make("Ant-v5") as ant:
        ant.reset(seed=3)
        yield ant
