"""The command line with both engines."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from test_python import printed, python

import mjenv
import mjenv_command

LIBRARY = Path(os.environ["MJENV_LIBRARY"])  # conftest.py sets it
LIBRARY_4 = LIBRARY.with_name("libmjenv-mujoco4.so")
DELAYED = """
<mujoco><worldbody><body><joint name="hinge" axis="0 1 0"/><geom size=".1" pos="0 0 .5"/></body></worldbody>
<actuator><position joint="hinge" kp="2" delay=".006" nsample="4"/></actuator></mujoco>
"""


def test_commands(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    def output(*words: str | Path) -> Any:
        assert mjenv_command.main([*map(str, words), "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    assert output("engines") == [
        {"name": "2.2.2", "default": True, "file": str(LIBRARY), "problem": None},
        {"name": "4.0", "default": False, "file": str(LIBRARY_4), "problem": None},
    ]
    assert output("--engine", "4.0", "info", "Ant-v5")["engine"] == "4.0"
    assert output("info", "Ant-v5")["engine"] == "2.2.2"
    assert {one["id"] for one in output("--engine", "4.0", "list")} == set(mjenv.ids("4.0"))
    results = output("verify", "Ant-v5", "--option-sets", "1", "--seeds", "1", "--steps", "20")
    assert "MuJoCo 4.0" in results["versions"]
    assert [one["equal"] for one in results["results"]] == [True]
    file = tmp_path / "image"
    with mjenv.make("Hopper-v5", engine="4.0") as env:
        env.reset(seed=1)
        file.write_bytes(env.snapshot())
    assert output("snapshot", "show", file)["engine"] == "4.0"
    assert mjenv_command.main(["--engine", "2.2.2", "snapshot", "show", str(file), "--id", "Hopper-v5"]) == 2
    assert "was made on MuJoCo 4.0" in capsys.readouterr().err


def test_an_id_that_the_default_engine_lacks() -> None:
    """Gymnasium has no Pusher-v4 on MuJoCo 4.0."""
    text = "import sys, mjenv_command as c; sys.exit(c.main(['--engine', '{}', 'info', 'Pusher-v4', '--json']))"
    for default, chosen in (("4.0", "2.2.2"), ("2.2.2", "2.2.2")):
        assert json.loads(printed(text.format(chosen), MJENV_ENGINE=default))["engine"] == chosen
    for default in ("4.0", "2.2.2"):
        run = python(text.format("4.0"), MJENV_ENGINE=default)
        assert run.returncode == 2
        assert "Pusher-v4 is only supported on mujoco<3" in run.stderr


def test_every_field_of_a_snapshot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A model with delays, whose state has more parts than those of MuJoCo 2.2.2."""
    model, file = tmp_path / "delayed.xml", tmp_path / "image"
    model.write_text(DELAYED)
    with mjenv.make("Model-v0", engine="4.0", xml_file=str(model)) as env:
        env.reset(seed=1)
        for _ in range(3):
            before = env.data.history.copy()
            env.step(np.full(1, 0.5))
        file.write_bytes(env.snapshot())
        words = "snapshot", "show", str(file), "--id", "Model-v0", "--option", f"xml_file={model}", "--json"
        assert mjenv_command.main([*words]) == 0
        [row] = json.loads(capsys.readouterr().out)["rows"]
        assert before.any()
        assert row["history"] == env.data.history.tolist()
        assert row["first.history"] == before.tolist()
        assert (row["qpos"], row["ctrl"]) == (env.data.qpos.tolist(), [0.5])
        assert "carried" not in row  # Model-v0 carries nothing


def test_verify_where_no_engine_fits(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(mujoco, "__version__", "3.3.7")
    assert mjenv_command.main(["verify", "Ant-v5"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("mjenv: MuJoCo 3.3.7 is installed")
    assert "pip install mujoco==2.2.2" in told
    words = "--engine", "4.0", "verify", "Hopper-v5", "--option-sets", "1", "--seeds", "1", "--steps", "5"
    assert mjenv_command.main([*words]) == 0


@pytest.mark.parametrize("engine", ["5.0", "4", "", "4.0.0", "/usr/lib"])
def test_an_unknown_engine(engine: str) -> None:
    for make in (mjenv.make, mjenv.make_vec, gymnasium.make, mjenv.options, mjenv.spec):
        id = "mjenv/Ant-v5" if make is gymnasium.make else "Ant-v5"
        with pytest.raises(mjenv.EngineError, match=r"there is no engine .*; there are 2\.2\.2, 4\.0") as caught:
            make(id, engine=engine)
        assert isinstance(caught.value, ImportError)
    with pytest.raises(SystemExit, match="2"):
        mjenv_command.main(["--engine", engine, "list"])
