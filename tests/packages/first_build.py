"""A build without switches compiles the library and nothing else, and needs no cmocka.

Usage: first_build.py CMAKE FOLDER     (FOLDER: the build is configured there, anew)
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def main() -> None:
    cmake, folder = sys.argv[1:]
    shutil.rmtree(folder, ignore_errors=True)
    command = [cmake, "-S", str(ROOT), "-B", folder, "-G", "Ninja"]
    # The engine does not matter here, and the installed one needs no sources.
    command += ["-DCMAKE_UNITY_BUILD=OFF"]  # so that the list has each file
    command += ["-DMJENV_ENGINE=system", "-DCMAKE_DISABLE_FIND_PACKAGE_cmocka=ON", "--no-warn-unused-cli"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    compiled = [Path(entry["file"]) for entry in json.loads(Path(folder, "compile_commands.json").read_text())]
    assert ROOT / "capi/mjenv.cpp" in compiled, "the library is not compiled"
    strangers = [str(file) for file in compiled if {ROOT / "tests", ROOT / "benchmarks"} & set(file.parents)]
    assert not strangers, f"a build without switches compiles {', '.join(strangers)}"


if __name__ == "__main__":
    main()
