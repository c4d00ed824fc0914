"""Fixtures that several topics share."""

import gc
from collections.abc import Iterator

import pytest

import mjenv


def pytest_collection_finish() -> None:
    """Lets the collector, which some tests call for each instruction, skip what modules have made."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def env() -> Iterator[mjenv.Environment]:
    """An Ant-v5 that has been reset with seed 3."""
    with mjenv.make("Ant-v5") as ant:
        ant.reset(seed=3)
        yield ant
