"""mjenv randomize."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mjenv
from mjenv import Scale, Value
from mjenv_command import main


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["randomize", "Hopper-v5", "geom_friction=scale:0.5:1.5:columns=0", "opt.timestep=value:0.001:0.003"]
    assert main([*words, "--rows", "2", "--seed", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["arrays"]
    draws: dict[str, Value] = {"geom_friction": Scale(0.5, 1.5, columns=[0]), "opt.timestep": Value(0.001, 0.003)}
    envs = mjenv.make_vec("Hopper-v5", 2, randomize=draws)
    envs.reset(seed=3)
    for row, env in enumerate(envs.envs):
        assert found["geom_friction"]["rows"][row] == np.array(env.model.geom_friction).tolist()
        assert found["opt.timestep"]["rows"][row] == env.model.opt.timestep
    assert main([*words, "body_mass=offset:0:0.1:normal:body=torso,foot"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in ("geom_friction[1, 0]", "opt.timestep", "body_mass[4]"))
    assert "geom_friction[1, 1]" not in shown
    refused = "", "=times:1:2", "=scale:1", "=scale:1:2:heavy", "=scale:1:2:columns=x"
    for draw in (f"body_mass{end}" for end in refused):
        with pytest.raises(SystemExit):
            main(["randomize", "Hopper-v5", draw])
        assert draw in capsys.readouterr().err
    assert main(["randomize", "Hopper-v5", "body_mass=scale:-1:1"]) == 2
