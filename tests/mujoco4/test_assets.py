"""The models in assets/ compile to the same arrays as Gymnasium's on MuJoCo 4.0, bit for bit."""

from __future__ import annotations

import sys
from pathlib import Path

import gymnasium
import mujoco
import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "models"))
from compiled_model import ASSETS, MODELS, differences, fields

ORIGINALS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"


def test_the_version() -> None:
    assert mujoco.mj_versionString().startswith("4.0.")


@pytest.mark.parametrize("name", MODELS)
def test_model(name: str) -> None:
    got, want = (fields(mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml"))) for folder in (ASSETS, ORIGINALS))
    assert len(want) > 500
    if lines := differences(got, want):
        pytest.fail(f"{name}.xml: {len(lines)} differences\n" + "\n".join(lines[:40]), pytrace=False)
