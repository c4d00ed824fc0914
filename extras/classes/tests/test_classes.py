"""Classes written for Gymnasium's MujocoEnv run on mjenv.MujocoEnv, every bit of every output.

Gymnasium's own classes are those of the installed package. Each of the others is one class as people write them, once
on Gymnasium's base and once on mjenv's.
"""

from __future__ import annotations

import copy
import importlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import gymnasium.envs.mujoco
import mujoco
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.utils import EzPickle

import mjenv
from mjenv.capi.engine import name_of
from mjenv.verify import check_same

os.environ.setdefault("MUJOCO_GL", "egl")  # mujoco reads it when it first draws
ENGINE = name_of(mujoco.__version__)
ROBOTS = {
    "ant": "AntEnv",
    "half_cheetah": "HalfCheetahEnv",
    "hopper": "HopperEnv",
    "humanoid": "HumanoidEnv",
    "humanoidstandup": "HumanoidStandupEnv",
    "inverted_double_pendulum": "InvertedDoublePendulumEnv",
    "inverted_pendulum": "InvertedPendulumEnv",
    "pusher": "PusherEnv",
    "reacher": "ReacherEnv",
    "swimmer": "SwimmerEnv",
    "walker2d": "Walker2dEnv",
}
Env = Any


@pytest.fixture
def long(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--long"))


class Theirs(gymnasium.envs.mujoco.MujocoEnv):
    """Gymnasium's base, with mjenv's methods for functions of the mujoco package."""

    def mj_forward(self) -> None:
        mujoco.mj_forward(self.model, self.data)

    def mj_name2id(self, kind: Any, name: str) -> int:
        return mujoco.mj_name2id(self.model, kind, name)


class Ours(mjenv.MujocoEnv, engine=ENGINE):
    pass


def play(env: Env, steps: int, seed: int) -> list[Any]:
    """The outputs of episodes, and the arrays of mjData at their ends."""
    rng = np.random.default_rng(seed)
    low, high = env.action_space.low, env.action_space.high
    found: list[Any] = [env.reset(seed=seed)]
    for step in range(steps):
        action = rng.uniform(low, high).astype(np.float32)
        found.append(env.step(action))
        if found[-1][2] or step % 70 == 69:
            names = "qpos qvel xpos xmat cfrc_ext qacc geom_xpos cvel actuator_force"
            found.append({name: np.array(getattr(env.data, name)) for name in names.split()})
            found.append(env.reset())
    return found


def check_equal(ours: Env, theirs: Env, steps: int, seed: int = 7) -> None:
    assert (ours.action_space, ours.observation_space) == (theirs.action_space, theirs.observation_space)
    assert (ours.dt, ours.metadata) == (theirs.dt, theirs.metadata)
    for step, (a, b) in enumerate(zip(play(ours, steps, seed), play(theirs, steps, seed), strict=True)):
        check_same(f"{type(ours).__name__}, output {step}", a, b)


@pytest.mark.parametrize("version", [4, 5])
@pytest.mark.parametrize("robot", ROBOTS)
def test_gymnasiums_own_classes(robot: str, version: int, long: bool) -> None:
    name, kind = f"gymnasium.envs.mujoco.{robot}_v{version}", ROBOTS[robot]
    try:
        theirs = getattr(importlib.import_module(name), kind)()
    except ImportError as error:  # Pusher-v4 needs MuJoCo 2
        pytest.skip(str(error))
    with mjenv.gymnasium_classes(engine=ENGINE):
        ours = getattr(importlib.import_module(name), kind)
    assert issubclass(ours, mjenv.MujocoEnv)
    assert getattr(sys.modules[name], kind) is type(theirs)
    check_equal(ours(), theirs, 3000 if long else 150)
    check_snapshots(ours(), ours())


def check_snapshots(env: Env, other: Env) -> None:
    """From the middle of an episode, both environments continue with the same bits, also over the next reset."""
    env.reset(seed=3), other.reset(seed=4)
    rng = np.random.default_rng(1)
    actions = rng.uniform(env.action_space.low, env.action_space.high, (40, env.action_space.shape[0]))
    for action in actions[:10]:
        env.step(action)
    image = env.snapshot()
    played = [[*map(env.step, actions), env.reset()]]
    for restored in (other, env):
        restored.restore(image)
        played.append([*map(restored.step, actions), restored.reset()])
    check_same("from an image, elsewhere", played[0], played[1])
    check_same("from an image", played[0], played[2])


# ---- classes as people write them ----


def model_of(*, world: str = "", more: str = "", option: str = "") -> str:
    return f"""<mujoco><compiler autolimits="true"/><option timestep="0.005" {option}/><worldbody><light pos="0 0 3"/>
      <geom name="floor" type="plane" size="5 5 .1"/>{world}</worldbody>{more}</mujoco>"""


CART = model_of(
    world="""<camera name="side" pos="0 -4 1" xyaxes="1 0 0 0 0 1"/><body name="cart" pos="0 0 1">
      <joint name="slide" type="slide" axis="1 0 0" range="-2 2" limited="true"/>
      <geom type="box" size=".2 .1 .1" mass="1"/><body name="pole"><joint name="hinge" axis="0 1 0" damping=".1"/>
      <geom type="capsule" fromto="0 0 0 0 0 .8" size=".04" mass=".2"/><site name="tip" pos="0 0 .8"/></body></body>""",
    more="""<actuator><motor name="push" joint="slide" gear="20" ctrlrange="-1 1"/></actuator>
      <sensor><accelerometer site="tip"/><jointpos joint="hinge"/><touch site="tip"/></sensor>
      <keyframe><key name="tilted" qpos=".1 .3" qvel="0 -1"/></keyframe>""",
)
LEG = model_of(
    world="""<geom name="ground" type="hfield" hfield="hills"/><body name="torso" pos="0 0 1.1"><freejoint/>
      <geom name="trunk" type="capsule" size=".1 .2" density="300"/><body name="leg" pos="0 0 -.2"><joint name="hip"
      axis="0 1 0" range="-60 60" limited="true"/><geom name="foot" type="capsule" fromto="0 0 0 0 0 -.5" size=".05"/>
      </body></body>""",
    more="""<asset><hfield name="hills" nrow="8" ncol="8" size="4 4 .2 .1"/></asset>
      <actuator><position name="hip" joint="hip" kp="30" ctrlrange="-1 1"/></actuator>""",
    option='integrator="RK4"',
).replace('<geom name="floor" type="plane" size="5 5 .1"/>', "")
HAND = model_of(
    world="""<body name="target" mocap="true" pos=".1 0 .5"><geom type="sphere" size=".02" contype="0" conaffinity="0"/>
      </body><body name="palm" pos="0 0 .4"><joint name="lift" type="slide" axis="0 0 1" damping="5"/>
      <geom type="box" size=".1 .1 .02"/><body name="finger" pos=".1 0 0"><joint name="curl" axis="0 1 0"/>
      <geom name="tip" type="capsule" fromto="0 0 0 .1 0 -.05" size=".02"/></body></body>
      <body name="ball" pos=".15 0 .3"><freejoint name="ball"/><geom name="ball" type="sphere" size=".05"/></body>""",
    more="""<actuator><motor name="curl" joint="curl" gear=".5" ctrlrange="-1 1"/>
      <general name="lift" joint="lift" dyntype="integrator" gainprm="40" biastype="affine"
      biasprm="0 -40 -2" ctrlrange="-1 1" actlimited="true" actrange="-.3 .3"/></actuator>
      <tendon><fixed name="both"><joint joint="lift" coef="1"/><joint joint="curl" coef=".2"/></fixed></tendon>""",
    option='cone="elliptic"',
)


def classes_on(base: type, folder: Path) -> dict[str, type]:
    """The classes, on Gymnasium's base or on mjenv's."""
    for name, xml in (("cart", CART), ("leg", LEG), ("hand", HAND)):
        (folder / f"{name}.xml").write_text(xml)
    cart, leg, hand = (str(folder / f"{name}.xml") for name in ("cart", "leg", "hand"))
    space = Box(-np.inf, np.inf, (4,), np.float64)

    class Cart(base, EzPickle):  # type: ignore[misc]
        metadata = {"render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"], "render_fps": 50}  # noqa: RUF012

        def __init__(self, reset_noise: float = 0.05, **kwargs: Any) -> None:
            EzPickle.__init__(self, reset_noise, **kwargs)
            self.reset_noise = reset_noise
            base.__init__(self, cart, 4, space, camera_name="side", **kwargs)

        def _get_obs(self) -> Any:
            return np.concatenate([self.data.qpos, self.data.qvel]).ravel()

        def step(self, action: Any) -> Any:
            before = self.data.qpos[0]
            self.do_simulation(action, self.frame_skip)
            obs, x = self._get_obs(), self.data.qpos[0]
            reward = (x - before) / self.dt - 0.1 * np.square(action).sum() + self.data.site("tip").xpos[2]
            return obs, reward, bool(abs(obs[1]) > 1.5), False, {"sensors": self.data.sensordata.copy(), "x": x}

        def reset_model(self) -> Any:
            noise = self.np_random.uniform(-self.reset_noise, self.reset_noise, self.model.nq)
            self.set_state(
                self.init_qpos + noise, self.init_qvel + self.np_random.standard_normal(self.model.nv) * 0.01
            )
            return self._get_obs()

        def _get_reset_info(self) -> Any:
            return {"tip": self.data.site_xpos[0].copy()}

    class FromKeyframe(Cart):
        def reset_model(self) -> Any:
            key = self.model.key("tilted")
            self.set_state(key.qpos, key.qvel)
            return self._get_obs()

    class RandomModel(Cart):
        """Another mass, damping and gravity in each episode."""

        def reset_model(self) -> Any:
            self.model.body_mass[1:] = [1, 0.2] * self.np_random.uniform(0.5, 2, 2)
            self.model.joint("hinge").damping[0] = self.np_random.uniform(0, 1)
            self.model.opt.gravity[2] = self.np_random.uniform(-12, -8)
            return super().reset_model()

    class Kicked(Cart):
        """Forces and velocities in mid-episode, through arrays that the class keeps."""

        def __init__(self, **kwargs: Any) -> None:
            super().__init__(**kwargs)
            self.force, self.velocity, self.tip = self.data.xfrc_applied, self.data.qvel[1:], self.data.site("tip").xpos

        def step(self, action: Any) -> Any:
            self.force[self.mj_name2id(mujoco.mjtObj.mjOBJ_BODY, "pole"), 0] = self.np_random.normal()
            if self.tip[2] < 1.75:
                self.velocity += 0.1
            obs, reward, *rest, info = super().step(action)
            return obs, reward + self.tip[0], *rest, info | {"force": self.force.copy(), "speed": self.velocity[0]}

    class Teleported(Cart):
        """Positions in mid-episode, and what follows from them; a simulation in parts."""

        def step(self, action: Any) -> Any:
            if self.np_random.random() < 0.2:
                self.data.qpos[1] = -self.data.qpos[1]
                tip = self.data.site_xpos.copy()
                self.mj_forward()
                assert not np.array_equal(tip, self.data.site_xpos)
            for _ in range(2):
                self.do_simulation(action, 1)
            return super().step(action)

    class OtherMethods(Cart):
        """Options of the constructor, and one that is set while episodes begin."""

        def __init__(self, **kwargs: Any) -> None:
            super().__init__(**kwargs)
            opt = self.model.opt
            opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_WARMSTART)
            opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
            opt.integrator, opt.solver, opt.cone = (int(mujoco.mjtIntegrator.mjINT_RK4), 0, 1)
            opt.iterations, opt.wind, opt.impratio = 7, [1, 2, 0], 2.0

        def reset_model(self) -> Any:
            flags = self.model.opt.disableflags
            self.model.opt.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
            self.data.ctrl[:] = 1
            obs = super().reset_model()
            self.model.opt.disableflags = flags
            return obs

        def step(self, action: Any) -> Any:
            obs, *rest, info = super().step(action)
            energy = self.data.energy[0]  # with NumPy 2, mujoco 2.2.2 shows it for the second element, too
            self.model.opt.integrator = (self.model.opt.integrator + 1) % 3
            return obs, *rest, info | {"energy": energy, "forces": self.data.qfrc_actuator.copy()}

    class SetInside(base):  # type: ignore[misc]
        """The space and the attributes are set by the class."""

        metadata = {"render_modes": [], "render_fps": 100}  # noqa: RUF012

        def __init__(self) -> None:
            base.__init__(self, cart, 2, None)
            self.init_qpos[1] = 0.4
            self.init_qvel = np.array([0.1, 0.2])
            self.observation_structure = {"qpos": 2}
            self.observation_space = Box(-1, 1, (4,), np.float32)

        def step(self, action: Any) -> Any:
            self._step_mujoco_simulation(action, self.frame_skip)
            return self.state_vector().astype(np.float32), float(self.data.time), False, False, {}

        def reset_model(self) -> Any:
            self.set_state(self.init_qpos, self.init_qvel)
            return self.state_vector().astype(np.float32)

    class Walker(base):  # type: ignore[misc]
        """A leg on hills that each episode draws."""

        metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

        def __init__(self, **kwargs: Any) -> None:
            base.__init__(self, leg, 10, Box(-np.inf, np.inf, (15,), np.float64), **kwargs)

        def _get_obs(self) -> Any:
            return np.hstack(
                [self.data.qpos.flat[2:], self.data.qvel.flat, self.get_body_com("leg")[:2], self.data.ncon]
            )

        def step(self, action: Any) -> Any:
            start = self.get_body_com("torso")[:2].copy()
            self.do_simulation(action, self.frame_skip)
            moved = self.get_body_com("torso")[:2].copy() - start
            forces = np.clip(self.data.cfrc_ext, -1, 1)
            info = {"touching": sorted({c.geom2 for c in self.data.contact[: self.data.ncon]})} if ENGINE else {}
            return self._get_obs(), moved[0] / self.dt - (forces**2).sum(), self.data.qpos[2] < 0.2, False, info

        def reset_model(self) -> Any:
            self.model.hfield_data[:] = self.np_random.uniform(0, 1, self.model.hfield_data.shape)
            self.set_state(self.init_qpos, self.np_random.normal(0, 0.1, self.model.nv))
            return self._get_obs()

    class Hand(base):  # type: ignore[misc]
        """Contacts, a mocap body, an actuator with a state, a tendon and a weld that is not there."""

        metadata = {"render_modes": [], "render_fps": 40}  # noqa: RUF012

        def __init__(self) -> None:
            base.__init__(self, hand, 5, Box(-np.inf, np.inf, (18,), np.float64))
            self.ball = self.mj_name2id(mujoco.mjtObj.mjOBJ_GEOM, "ball")

        def _get_obs(self) -> Any:
            touching = 0.0
            for i in range(self.data.ncon):
                contact = self.data.contact[i]
                if self.ball in (contact.geom1, contact.geom2):
                    # With NumPy 2, mujoco 2.2.2 shows the first element for all of them.
                    touching += contact.dist + contact.pos[0] + contact.frame[0]
            ball = self.data.joint("ball")
            return np.concatenate(
                [ball.qpos, ball.qvel, self.data.act, self.data.ten_length, [touching], self.data.mocap_pos[0][:2]]
            )

        def step(self, action: Any) -> Any:
            self.data.mocap_pos[0, 0] += 0.01 * action[0]
            self.do_simulation(action, self.frame_skip)
            reach = np.linalg.norm(self.data.body("ball").xpos - self.data.mocap_pos[0])
            return self._get_obs(), -reach, False, False, {"nefc": self.data.nefc}

        def reset_model(self) -> Any:
            qpos = self.init_qpos.copy()
            start = self.model.joint("ball").qposadr[0]
            qpos[start : start + 2] += self.np_random.uniform(-0.05, 0.05, 2)
            self.set_state(qpos, self.init_qvel)
            return self._get_obs()

    class WithoutState(Cart):
        """reset_model leaves the state that mj_resetData sets."""

        def reset_model(self) -> Any:
            assert not self.data.xpos.any()
            return self._get_obs()

    found = (OtherMethods, Cart, FromKeyframe, RandomModel, Kicked, Teleported, SetInside, Walker, Hand, WithoutState)
    return {kind.__name__: kind for kind in found}


NAMES = "OtherMethods Cart FromKeyframe RandomModel Kicked Teleported SetInside Walker Hand WithoutState".split()


@pytest.mark.parametrize("name", NAMES)
def test_own_classes(name: str, tmp_path: Path, long: bool) -> None:
    ours, theirs = (classes_on(base, tmp_path)[name]() for base in (Ours, Theirs))
    check_equal(ours, theirs, 3000 if long else 300)
    check_snapshots(ours, classes_on(Ours, tmp_path)[name]())


def of_both(tmp_path: Path, name: str) -> list[Env]:
    envs = [classes_on(base, tmp_path)[name]() for base in (Ours, Theirs)]
    for env in envs:
        env.reset(seed=3)
        for _ in range(12):
            env.step(np.ones(1))
    return envs


def test_arrays_after_writes(tmp_path: Path) -> None:
    """Writes change no derived array, neither those that steps compute nor the others, until the next mj_forward."""
    envs = of_both(tmp_path, "Walker")

    def check() -> None:
        for name in "xpos geom_xpos geom_xmat cam_xpos light_xpos cfrc_int cfrc_ext cacc qacc".split():
            check_same(name, *(np.array(getattr(env.data, name)) for env in envs))

    for names in (("qpos",), ("qvel", "qpos"), ("xfrc_applied",), ("qfrc_applied", "qvel")):
        for moves in (False, True):
            for env in envs:
                for name in names:
                    getattr(env.data, name)[:] += 0.01
                if moves:
                    env.set_state(env.data.qpos.copy(), env.data.qvel.copy())
            check()
            check_same("step", *(env.step(np.ones(1)) for env in envs))
            check()


def test_flags_in_mid_episode(tmp_path: Path) -> None:
    """With flags that change which geoms touch, too."""
    envs = of_both(tmp_path, "Walker")
    bits = mujoco.mjtDisableBit
    for bit in (bits.mjDSBL_FILTERPARENT, bits.mjDSBL_WARMSTART, bits.mjDSBL_GRAVITY, bits.mjDSBL_CONTACT):
        for method in range(3):
            for env in envs:
                opt = env.model.opt
                opt.disableflags, opt.solver = opt.disableflags ^ int(bit), method
                opt.integrator, opt.cone = (method + 1) % 3, method % 2
            for _ in range(5):
                check_same(f"{bit}, {method}", *(env.step(np.ones(1)) for env in envs))
            check_same(f"{bit}, {method}: ncon", *(np.array(env.data.ncon) for env in envs))


MODULE = """
import mujoco
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv
from gymnasium.spaces import Box

class Stepper(MujocoEnv):
    metadata = {"render_modes": [], "render_fps": 50}

    def __init__(self, path):
        super().__init__(path, 4, Box(-np.inf, np.inf, (4,)))
        tip = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SITE, "tip")
        self.names = [self.model.names[start:].split(b"\\0")[0] for start in self.model.name_bodyadr]
        self.tip = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_SITE, tip)

    def step(self, action):
        self.data.ctrl[:] = action
        mujoco.mj_step(self.model, self.data, nstep=self.frame_skip)
        info = {"names": self.names, "tip": self.data.site(self.tip).xpos.copy()}
        return self.state_vector(), 0.0, False, False, info

    def reset_model(self):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[1] = 0.1
        mujoco.mj_forward(self.model, self.data)
        return self.state_vector()
"""


def test_functions_of_mujoco(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a module that is imported as it is, functions of the mujoco package take mjenv's model and data."""
    (tmp_path / "cart.xml").write_text(CART)
    (tmp_path / "stepper_module.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    with mjenv.gymnasium_classes(engine=ENGINE):
        ours = importlib.import_module("stepper_module").Stepper
    theirs = importlib.import_module("stepper_module").Stepper
    assert sys.modules["mujoco"] is mujoco
    assert issubclass(ours, mjenv.MujocoEnv)
    assert not issubclass(theirs, mjenv.MujocoEnv)
    check_equal(ours(str(tmp_path / "cart.xml")), theirs(str(tmp_path / "cart.xml")), 100)


CLOCK = """
import sys
from threading import Thread

import mujoco
import numpy as np

reads = 0

def clock():
    global reads
    reads += 1
    return float(reads)

def times_of(steps):
    global reads
    reads, data = 0, mujoco.MjData(model)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return [data.timer[i].duration for i in range(len(data.timer))], reads

model = mujoco.MjModel.from_xml_path(sys.argv[1])
mujoco.set_mjcb_time(clock)
times, each = times_of(200)
assert sum(times) > 0 and each > 0

import mjenv

env = mjenv.make("Hopper-v5", engine=sys.argv[2])
reads = 0
env.reset(seed=0)
env.step(np.zeros(3))
assert reads == 0, reads
thread = Thread(target=lambda: [env.step(np.zeros(3)) for _ in range(200)])
thread.start()
assert times_of(200) == (times, each)
thread.join()
assert times_of(200) == (times, each)
assert mujoco.get_mjcb_time() is clock
"""


def test_clock_of_mujoco(tmp_path: Path) -> None:
    """mjenv's steps do not read the clock of the mujoco package, whose data.timer shows the same times as before, also
    while another thread steps."""
    (tmp_path / "cart.xml").write_text(CART)
    subprocess.run([sys.executable, "-c", CLOCK, str(tmp_path / "cart.xml"), ENGINE], check=True)


def test_pictures(tmp_path: Path) -> None:
    ours, theirs = (
        [classes_on(base, tmp_path)["Cart"](render_mode=mode, width=64, height=48) for mode in modes]
        for base, modes in ((Ours, ("rgb_array", "depth_array")), (Theirs, ("rgb_array", "depth_array")))
    )
    for a, b in zip(ours, theirs, strict=True):
        a.reset(seed=1), b.reset(seed=1)
        for _ in range(3):
            check_same(a.render_mode, a.render(), b.render())
            a.step(np.ones(1)), b.step(np.ones(1))
    assert ours[0].mujoco_renderer.render("depth_array").shape == (48, 64)
    assert ours[0].mujoco_renderer.render("rgbd_tuple")[0].shape == (48, 64, 3)


def test_copies(tmp_path: Path) -> None:
    """A class that derives from EzPickle is built anew, as in Gymnasium; others continue."""
    cart = classes_on(Ours, tmp_path)["Cart"](reset_noise=0.2)
    cart.reset(seed=1)
    assert (copy.deepcopy(cart).reset_noise, copy.deepcopy(cart).data.qpos.any()) == (0.2, False)
    walker = classes_on(Ours, tmp_path)["Walker"]()
    walker.reset(seed=3)
    walker.step(np.ones(1))
    other = copy.deepcopy(walker)
    for _ in range(20):
        check_same("step", walker.step(np.zeros(1)), other.step(np.zeros(1)))
    check_same("reset", walker.reset(), other.reset())


def test_what_cannot_run(tmp_path: Path) -> None:
    cart = classes_on(Ours, tmp_path)["Cart"]
    env = cart()
    with pytest.raises(TypeError, match=r"mj_step(.|\n)*functions of the mujoco package do not take"):
        mujoco.mj_step(env.model, env.data)

    class Loaded(cart):  # type: ignore[misc, valid-type]
        def _initialize_simulation(self) -> Any:
            super()._initialize_simulation()
            model = mujoco.MjModel.from_xml_string(CART)
            return model, mujoco.MjData(model)

    with pytest.raises(TypeError, match=r"_initialize_simulation returned .*pass its path"):
        Loaded()
    with pytest.raises(OSError, match="does not exist"):
        Ours("nothing.xml", 1, None)
    with pytest.raises(NotImplementedError, match="Ours defines no step"):
        Ours(str(tmp_path / "cart.xml"), 1, None).step(np.zeros(1))
    assert env.mj_name2id("body", "nobody") == -1
    assert env.mj_id2name("body", env.mj_name2id(mujoco.mjtObj.mjOBJ_BODY, "pole")) == "pole"
    env.close()
    env.close()
