"""Records the compiled models of the installed Gymnasium, for test_models.py.

Needs Python 3.10 with gymnasium==1.4.0, mujoco==2.2.2 and numpy==2.2.6. Usage: python record.py
"""

from __future__ import annotations

import platform
from pathlib import Path

import gymnasium
import mujoco
import numpy as np

from compiled_model import GOLDEN, MODELS, differences, fields, read, write

WANTED = {"python": "3.10", "gymnasium": "1.4.0", "mujoco": "2.2.2", "numpy": "2.2.6"}


def main() -> None:
    versions = {
        "python": ".".join(platform.python_version_tuple()[:2]),
        "gymnasium": gymnasium.__version__,
        "mujoco": mujoco.mj_versionString(),
        "numpy": np.__version__,
    }
    if versions != WANTED:
        raise SystemExit(f"record.py: this is {versions}, the goldens are of {WANTED}")
    originals = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
    GOLDEN.mkdir(parents=True, exist_ok=True)
    for name in MODELS:
        model = fields(mujoco.MjModel.from_xml_path(str(originals / f"{name}.xml")))
        path = GOLDEN / f"{name}.json"
        write(path, versions, model)
        if lost := differences(read(path)[1], model):
            raise SystemExit(f"record.py: {path} does not read back: {lost[0]}")
        print(f"{path.name}: {len(model)} fields, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
