import pytest

import blocks


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="also run the blocks marked long")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    for page in blocks.pages():
        for block in blocks.blocks_of(page):
            if block.when == "not run":
                terminalreporter.write_line(f"not run: {block.where} ({block.how})")
            elif block.when == "long" and not config.getoption("long"):
                terminalreporter.write_line(f"run with --long: {block.where}")
