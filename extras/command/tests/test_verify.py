"""mjenv verify without an installed Gymnasium with MuJoCo."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["verify"], "gymnasium[mujoco]"),
        (["verify", "Ant-v3"], 'no environment "Ant-v3"; nearest: Ant-v4'),
        ([], "COMMAND"),
    ],
)
def test_verify_says_what_is_missing(arguments: list[str], message: str) -> None:
    script = "import runpy, sys; sys.modules['mujoco'] = None; runpy.run_module('mjenv', run_name='__main__')"
    run = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert message in run.stderr


def test_verify_that_compared_nothing_fails() -> None:
    """Gymnasium cannot draw without glfw, which its MuJoCo environments import; mujoco is a stand-in."""
    script = """
import runpy, sys, types
mujoco = types.ModuleType("mujoco")
mujoco.__version__ = "2.2.2"
mujoco.get_mju_user_warning = mujoco.set_mju_user_warning = lambda *_: None
sys.modules.update(mujoco=mujoco, glfw=None)
runpy.run_module("mjenv", run_name="__main__")
"""
    command = [sys.executable, "-c", script, "verify", "Ant-v5", "Hopper-v5"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert [line.partition(":")[0] for line in run.stdout.splitlines()[1:]] == ["Ant-v5", "Hopper-v5"]
    assert "mjenv: nothing was compared: import of glfw halted" in run.stderr
    assert 'pip install "gymnasium[mujoco]"' in run.stderr
