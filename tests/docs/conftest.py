import pytest

import blocks


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="also run the blocks marked long")
    parser.addoption("--mujoco4", action="store_true", help="only run the blocks marked mujoco4; needs build/mujoco4")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Chooses the tests of the blocks marked mujoco4, or all others."""
    items[:] = [item for item in items if item.name.startswith("test_mujoco4") == config.getoption("mujoco4")]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if config.getoption("mujoco4"):
        return
    for page in blocks.pages():
        for block in blocks.blocks_of(page):
            if block.when == "not run":
                terminalreporter.write_line(f"not run: {block.where} ({block.how})")
            elif block.when == "long" and not config.getoption("long"):
                terminalreporter.write_line(f"run with --long: {block.where}")
            elif block.when == "mujoco4":
                terminalreporter.write_line(f"run in the part mujoco4: {block.where}")
