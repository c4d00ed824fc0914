"""mjenv with each version of Gymnasium.

Installs each version with pip, into a folder of its own.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import mjenv

SOURCE = Path(mjenv.__file__).parents[1]
INSTALL = (sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--target")
PROGRAM = """
import gymnasium
env = gymnasium.make("CartPole-v1")
env.reset(seed=0)
print(gymnasium.__version__, env.spec.id)
if gymnasium.__version__ >= "1":
    env = gymnasium.make("mjenv:mjenv/Ant-v5")
    env.reset(seed=0)
    env.step(env.action_space.sample())
    envs = gymnasium.make_vec("mjenv:mjenv/Ant-v5", num_envs=2)
    print(type(env.unwrapped).__name__, type(envs).__name__)

    def picture(**camera):
        env = gymnasium.make("mjenv/Hopper-v5", render_mode="rgb_array", width=60, height=40, **camera)
        env.reset(seed=0)
        return env.render().tolist()

    print([name for name in ("free", "track") if picture(camera_name=name) == picture()])
else:
    try:
        import mjenv
    except ImportError as error:
        print(error)
"""


@pytest.fixture(params=["==0.29.1", "==1.0.0", "==1.1.1", "==1.2.3", "==1.3.0", ""], ids=lambda pin: pin or "newest")
def gymnasium(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A folder that holds one version of Gymnasium, to be put before the installed one."""
    subprocess.run([*INSTALL, tmp_path, f"gymnasium{request.param}"], check=True, timeout=300)
    return tmp_path


def test_every_gymnasium_works(gymnasium: Path) -> None:
    path = os.pathsep.join([str(gymnasium), str(SOURCE)])
    command = [sys.executable, "-c", PROGRAM]
    run = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=120)
    assert run.returncode == 0, run.stderr
    cart_pole, *ours = run.stdout.splitlines()
    version, id = cart_pole.split()
    assert id == "CartPole-v1"
    [installed] = gymnasium.glob("gymnasium-*.dist-info")
    assert installed.name == f"gymnasium-{version}.dist-info"
    needed = f"mjenv needs Gymnasium 1.0 or newer, not {version}"
    if version.startswith("0."):
        assert ours[0].startswith(needed)
    else:
        camera = "track" if version < "1.4" else "free"  # which Gymnasium's MujocoRenderer draws with by default
        assert ours == ["Environment VectorEnv", f"['{camera}']"]
