"""mjenv new-task and mjenv cmake-dir: the start of a robot and task of your own."""

from __future__ import annotations

import argparse
import re
from importlib.resources import files
from pathlib import Path

import mjenv
from mjenv_command.arguments import Commands

# The files of a new task, and the templates in new_task/ from which they are made.
FILES = {
    "CMakeLists.txt": "CMakeLists.txt.in",
    "@name@.cpp": "task.cpp.in",
    "@name@.xml": "model.xml.in",
    "test_@name@.py": "test_task.py.in",
    "README.md": "README.md.in",
}


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "new-task",
        help="write a folder with a task of your own",
        description="Writes the folder NAME with a robot (MJCF), a task in C++, its CMakeLists.txt and a test in "
        "Python. They build and run as they are; change them into your own.",
    )
    command.add_argument("name", type=task_name, metavar="NAME", help="my_robot, for instance, whose id is MyRobot-v0")
    command.set_defaults(run=run_new_task)

    command = commands.add_parser(
        "cmake-dir",
        help="print the folder of the CMake package",
        description="Prints the folder with the CMake package of this mjenv: "
        'cmake -S . -B build -Dmjenv_DIR="$(mjenv cmake-dir)"',
    )
    command.set_defaults(run=run_cmake_dir)


def task_name(text: str) -> str:
    if not re.fullmatch("[a-z][a-z0-9_]{0,60}", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not a lower-case letter, followed by such letters, digits and _")
    return text


def run_new_task(arguments: argparse.Namespace) -> int:
    name = arguments.name
    values = {
        "name": name,
        "id": "".join(part.capitalize() for part in name.split("_")) + "-v0",
        "version": mjenv.version().split()[0],
    }
    folder = Path(name)
    folder.mkdir()
    for file, template in FILES.items():
        text = (files("mjenv_command") / "new_task" / template).read_text("utf-8")
        (folder / _filled(file, values)).write_text(_filled(text, values), "utf-8")
    print(f"{folder}/: the task {values['id']}; README.md says how to build it")
    return 0


def _filled(template: str, values: dict[str, str]) -> str:
    return re.sub("@([a-z]+)@", lambda match: values[match[1]], template)


def run_cmake_dir(arguments: argparse.Namespace) -> int:
    library = mjenv.engine(arguments.engine).file
    folder = Path(library).resolve().parent / "cmake" / "mjenv"
    if not (folder / "mjenv-config.cmake").exists():
        raise FileNotFoundError(f"there is no CMake package beside {library}: {folder} is missing")
    print(folder)
    return 0
