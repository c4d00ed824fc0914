"""The viewer's skins, compared with those that MuJoCo draws."""

from __future__ import annotations

import mujoco
import numpy as np

import mjenv
from mjenv_viewer.skins import skins_of

MODEL = """
<mujoco><worldbody>
<body name="upper" pos="0 0 1"><freejoint/><geom size=".1"/>
<body name="lower" pos=".3 0 0"><joint axis="0 1 0"/><geom size=".05"/></body></body></worldbody>
<{place}>
<skin name="flat" vertex="0 0 0  .3 0 0  .3 .2 0  0 .2 .1" face="0 1 2 0 2 3">
<bone body="upper" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 3" vertweight="1 .4 1"/>
<bone body="lower" bindpos=".3 0 0" bindquat=".8 0 .6 0" vertid="1 2" vertweight=".6 2"/></skin>
<skin name="swollen" vertex="0 0 0  .3 0 0  0 .3 0  0 0 .3" face="0 2 1 0 1 3 0 3 2 1 2 3" inflate=".05">
<bone body="lower" bindpos=".1 0 0" bindquat="1 0 0 0" vertid="0 1 2 3" vertweight="1 1 1 1"/></skin>
</{place}></mujoco>"""


def test_vertices_are_those_of_mujoco() -> None:
    # Since MuJoCo 3, skins stand in an element of their own.
    xml = MODEL.format(place="asset" if mujoco.__version__.startswith("2.") else "deformable")
    model = mujoco.MjModel.from_xml_string(xml)
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, 100)
    with mjenv.make("Model-v0", xml_string=xml) as env:
        skins = skins_of(env.unwrapped.model)
        assert len(skins) == 2
        for seed in range(5):
            qpos = np.random.default_rng(seed).normal(size=8)
            env.reset(seed=seed)
            env.unwrapped.set_state(qpos, np.zeros(7))
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            mujoco.mjv_updateSkin(model, data, scene)
            row = env.unwrapped.data
            found = [skin.vertices(row.xpos, row.xmat.reshape(-1, 3, 3)) for skin in skins]
            # MuJoCo's vertices are float32.
            assert np.allclose(np.concatenate(found), np.array(scene.skinvert).reshape(-1, 3), atol=1e-5)
