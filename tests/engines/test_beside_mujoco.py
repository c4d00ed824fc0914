"""In one process, the library and another MuJoCo (of the newest mujoco package on PyPI) do not change each other."""

import subprocess
import sys

import mujoco
import pytest

MJENV = """
import mjenv
env = mjenv.make("Ant-v5")
outputs = [env.reset(seed=1)[0]]
env.action_space.seed(1)
outputs += [env.step(env.action_space.sample())[0] for _ in range(100)]
print("mjenv", b"".join(obs.tobytes() for obs in outputs).hex())
"""

MUJOCO = """
import mujoco
model = mujoco.MjModel.from_xml_string('''
<mujoco><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .3" euler="20 30 40"/></body>
</worldbody></mujoco>''')
data = mujoco.MjData(model)
mujoco.mj_step(model, data, 500)
assert data.ncon > 0
print("mujoco", data.qpos.tobytes().hex())
"""

# Makes every library's symbols visible to those loaded later.
GLOBAL = "import os, sys; sys.setdlopenflags(os.RTLD_NOW | os.RTLD_GLOBAL)\n"
LOAD_BOTH = ("import mujoco\nimport mjenv\n", "import mjenv\nmjenv.make('Ant-v5')\nimport mujoco\n")


def lines(*programs: str) -> set[str]:
    run = subprocess.run([sys.executable, "-c", "".join(programs)], capture_output=True, text=True, check=True)
    assert run.stderr == ""
    return set(run.stdout.splitlines())


@pytest.mark.parametrize("flags", ["", GLOBAL], ids=["local", "global"])
@pytest.mark.parametrize("load", LOAD_BOTH, ids=["mujoco_first", "mjenv_first"])
@pytest.mark.parametrize("programs", [(MJENV, MUJOCO), (MUJOCO, MJENV)], ids=["mjenv_first", "mujoco_first"])
def test_each_gives_what_it_gives_alone(flags: str, load: str, programs: tuple[str, str]) -> None:
    assert not mujoco.__version__.startswith("2.")
    alone = lines(MJENV) | lines(MUJOCO)
    assert len(alone) == 2
    assert lines(flags, load, *programs) == alone
