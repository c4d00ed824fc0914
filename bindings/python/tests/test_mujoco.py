"""env.unwrapped: data, model and the methods of Gymnasium's MuJoCo environments."""

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

import mjenv


def test_data_and_model(env: mjenv.Environment) -> None:
    model, data = env.unwrapped.model, env.unwrapped.data
    assert (model.nq, model.nv, model.nu, model.nbody) == (15, 14, 8, 14)
    assert type(model.nq) is int
    assert (model.opt.timestep, type(model.opt.timestep)) == (0.01, float)
    assert model.opt.gravity.tolist() == [0, 0, -9.81]
    assert (data.time, type(data.time)) == (0.0, float)
    assert (data.qpos.shape, data.qpos.dtype) == ((15,), np.float64)
    assert (data.xpos.shape, data.cinert.shape) == ((14, 3), (14, 10))
    assert (model.jnt_type.dtype, model.jnt_limited.dtype, model.geom_rgba.dtype) == (np.int32, np.uint8, np.float32)
    assert {"qpos", "xpos", "cfrc_ext", "body"} <= set(dir(data))
    assert {"nq", "body_mass", "opt", "stat"} <= set(dir(model))
    assert {"timestep", "gravity"} <= set(dir(model.opt))
    env.step(np.zeros(8))
    assert data.time == pytest.approx(0.05)


def test_objects_by_name_and_number(env: mjenv.Environment) -> None:
    model, data = env.model, env.data
    torso = data.body("torso")
    assert (torso.id, torso.name) == (1, "torso")
    assert model.body(1).name == "torso"
    assert (
        torso.xpos.tolist() == data.xpos[1].tolist() == data.body(1).xpos.tolist() == env.get_body_com("torso").tolist()
    )
    assert torso.cfrc_ext.shape == (6,)
    assert model.body("torso").mass.tolist() == [model.body_mass[1]]
    assert model.joint("root").qpos0.tolist() == model.qpos0[:7].tolist()
    assert data.joint("root").qpos.tolist() == data.qpos[:7].tolist()
    assert data.joint("root").qvel.tolist() == data.qvel[:6].tolist()
    hip = model.joint("hip_4").id
    assert data.joint("hip_4").qpos.tolist() == [data.qpos[model.jnt_qposadr[hip]]]
    assert data.joint("hip_4").qvel.tolist() == [data.qvel[model.jnt_dofadr[hip]]]
    assert model.joint("hip_4").damping.tolist() == [model.dof_damping[model.jnt_dofadr[hip]]]
    assert data.geom("floor").xpos.tolist() == data.geom_xpos[0].tolist()
    assert model.camera("track").id == model.cam("track").id == 0
    env.step(np.arange(8) / 8)
    assert data.actuator(3).ctrl.tolist() == [3 / 8]
    assert "xpos" in dir(torso)
    assert "mass" in dir(model.body(1))
    assert repr(torso) == "<body 1 'torso'>"


def test_contacts() -> None:
    """A dropped ant stands on the floor; tests/live/test_live.py compares with MuJoCo."""
    envs = mjenv.make_vec("Ant-v5", 1, arrays="contact.dist contact.geom1")
    envs.reset(seed=3)
    data = envs.envs[0].data
    assert (len(data.contact), data.contact.pos.shape) == (0, (0, 3))
    while data.ncon < 2:
        envs.step(np.zeros((1, 8)))
    contact = data.contact
    assert len(contact) == data.ncon
    assert (contact.dist.shape, contact.frame.shape, contact.geom1.dtype) == ((data.ncon,), (data.ncon, 9), np.int32)
    assert [one.geom1 for one in contact] == contact.geom1.tolist() == [0] * data.ncon  # the floor
    assert [one.geom2 for one in contact] == contact.geom2.tolist()
    assert contact[-1].pos.tolist() == contact.pos[data.ncon - 1].tolist()
    assert (type(contact[0].dist), type(contact[0].geom1)) == (float, int)
    assert contact[0].frame[:3].tolist() == [0, 0, 1]
    assert contact[0].geom.tolist() == contact.geom[0].tolist() == [0, contact[0].geom2]
    assert (data.warning[0].number, data.warning.number.tolist()) == (0, [0] * len(data.warning))
    assert data.efc_force.any()
    assert repr(contact[0]) == f"<contact 0 of geoms 0 and {contact[0].geom2}>"
    assert {"dist", "geom1", "frame"} <= set(dir(contact)) & set(dir(contact[0]))
    assert not contact.dist.flags.writeable
    exported = envs.arrays["contact.dist"][0]
    assert exported[: data.ncon].tobytes() == contact.dist.tobytes()
    assert not exported[data.ncon :].any()
    for index in (data.ncon, -data.ncon - 1):
        with pytest.raises(IndexError, match=f"there are {data.ncon} contacts"):
            contact[index]
    with pytest.raises(AttributeError, match="nothing"):
        contact[0].nothing  # noqa: B018
    with pytest.raises(AttributeError, match="read-only"):
        contact[0].dist = 0.0


def test_an_exported_number_is_a_view() -> None:
    """Of an array with one number, too, arrays has a view of the memory into which the library writes."""
    env = mjenv.make("Ant-v5", arrays="ncon xpos time")
    env.reset(seed=3)
    ncon, time = env.arrays["ncon"], env.arrays["time"]
    for _ in range(30):
        env.step(np.zeros(8))
        assert (ncon, time) == (env.data.ncon, env.data.time)
        assert env.arrays["xpos"].tolist() == env.data.xpos.tolist()
    assert ncon >= 2


def test_a_held_array_is_live(env: mjenv.Environment) -> None:
    """As in MuJoCo: an array, a view of it and a view of that show the present state, and can be written."""
    held = env.data.qpos, env.data.qpos[:3][1:], env.data.body("torso").xpos, env.data.contact
    before = env.data.qpos.copy()
    env.step(np.ones(8))
    assert held[0].tobytes() == env.data.qpos.tobytes() != before.tobytes()
    assert held[1].tolist() == env.data.qpos[1:3].tolist()
    assert held[2].tolist() == env.data.xpos[1].tolist()
    assert len(held[3]) == env.data.ncon
    held[1][0] = 2
    env.set_state(env.data.qpos * 1, env.data.qvel)
    assert (env.data.qpos[1], env.data.xpos[1, 1]) == (2, 2)
    image = env.snapshot()
    held[1][0] = 3
    env.restore(image)
    assert held[1][0] == 2
    env.close()
    assert held[0].shape == (15,)
    held[0][:] = 0  # memory of NumPy


def test_two_names_of_an_array(env: mjenv.Environment) -> None:
    gravity = env.model.opt.gravity
    assert getattr(env.model, "opt.gravity")[2] == -9.81
    gravity[2] = -1
    env.step(np.ones(8))
    assert gravity[2] == getattr(env.model, "opt.gravity")[2] == -1


def test_writing_as_in_gymnasium(env: mjenv.Environment) -> None:
    """Every way to assign to an array of the model writes it, also after a step; the arrays are NumPy's own."""
    model, data = env.model, env.data
    friction = model.geom_friction.copy()
    model.geom_friction[:, 0] *= 0.5
    assert model.geom_friction[:, 0].tolist() == (friction[:, 0] / 2).tolist()
    view = model.body_mass[2:4]
    mass = model.body_mass
    assert type(mass) is np.ndarray
    mass[1] = 7
    view += 1
    np.multiply(mass, 2, out=mass)
    env.step(np.zeros(8))
    assert model.body_mass[1] == 14
    assert model.body_mass.tolist() == mass.tolist()
    view.fill(3)
    np.copyto(mass[4:6], 4)
    env.step(np.zeros(8))
    assert mjenv.make("Ant-v5").model.body_mass[1] != model.body_mass[1] == 14
    assert env.model.body_mass[2:6].tolist() == [3, 3, 4, 4]
    other = pickle.loads(pickle.dumps(env))
    assert other.model.body_mass[2:6].tolist() == [3, 3, 4, 4]
    model.opt.timestep = 0.002
    assert env.dt == 0.002 * 5
    model.opt.gravity[2] = -1.5
    model.body("torso").mass = 2
    model.joint("hip_1").damping[:] = 4
    data.body("torso").xfrc_applied[2] = 100
    data.qpos[0] = 3
    data.time = 2
    model.qpos0[0] = 9
    other = copy.deepcopy(env)
    assert other.model.opt.gravity.tolist() == [0, 0, -1.5]
    assert (other.model.body("torso").mass.tolist(), other.model.dof_damping[6]) == ([2], 4)
    assert (other.data.xfrc_applied[1, 2], other.data.qpos[0], other.data.time) == (100, 3, 2)
    assert (other.model.qpos0[0], env.init_qpos[0]) == (9, 0)
    env.reset(seed=0)
    assert data.xfrc_applied.any() == 0
    assert model.body_mass[1] == 2


def test_what_cannot_be_written(env: mjenv.Environment) -> None:
    """An assignment to an attribute fails at once, one to elements in the next call, which then does nothing."""
    before, mass, time = env.model.body_mass.tolist(), env.model.body_mass, env.data.time
    with pytest.raises(ValueError, match=r"row 0: body_mass\[3\] is -1"):
        env.model.body_mass = [0, 5, 5, -1, *before[4:]]
    assert mass.tolist() == before
    states = env.data.qpos.copy(), env.data.qvel.copy()
    for call in (lambda: env.step(np.zeros(8)), env.reset, env.snapshot, lambda: env.set_state(*states)):
        mass[1] = np.nan
        with pytest.raises(ValueError, match=r"row 0: body_mass\[1\] is nan"):
            call()
        assert (mass.tolist(), env.data.time) == (before, time)
    with pytest.raises(KeyError, match="structure"):
        env.model.body_parentid = env.model.body_parentid
    with pytest.raises(ValueError, match="read-only"):
        env.model.body_parentid[1] = 3
    with pytest.raises(AttributeError, match="read-only"):
        env.data.xpos = np.zeros((14, 3))
    with pytest.raises(ValueError, match="read-only"):
        env.data.xpos[0] = 1
    with pytest.raises(AttributeError, match="nothing"):
        env.model.nothing = 1
    with pytest.raises(AttributeError, match="read-only"):
        env.data.body("torso").xpos = 1
    with pytest.raises(AttributeError, match="read-only"):
        env.data.contact = 1


@pytest.mark.parametrize("options", [{}, {"observation": "dict", "history": 2}])
def test_observe(options: dict[str, Any]) -> None:
    """The observation of the present state, as a step would give it; on the rows of a vector, too."""
    env, envs = mjenv.make("Hopper-v5", **options), mjenv.make_vec("Hopper-v5", 3, **options)
    obs, _ = env.reset(seed=1)
    envs.reset(seed=[0, 1, 2])
    assert data_equivalence(env.observe(), obs, exact=True)
    states = np.array([0, 1.2, 0.1, 0, 0, 0]), np.array([0, 11.0, 1, 0, 0, 0])
    env.set_state(*states)
    envs.envs[1].set_state(*states)
    assert data_equivalence(envs.envs[1].observe(), env.unwrapped._get_obs(), exact=True)
    if not options:
        assert env.observe().tolist() == [1.2, 0.1, 0, 0, 0, 0, 10, 1, 0, 0, 0]  # Gymnasium's formula
    image, before = env.snapshot(), env.observe()
    env.step(np.ones(3))
    env.restore(image)
    assert data_equivalence(env.observe(), before, exact=True)


def test_gymnasiums_attributes() -> None:
    """They read the option; what cannot change the environment cannot be assigned."""
    env = gymnasium.make("mjenv/HalfCheetah-v5", forward_reward_weight=2.5)
    envs = mjenv.make_vec("Ant-v5", 2, healthy_z_range=(0.3, 1.5))
    raw, row = env.unwrapped, envs.envs[1]
    assert (raw._forward_reward_weight, raw._ctrl_cost_weight, raw._reset_noise_scale) == (2.5, 0.1, 0.1)
    assert (row._healthy_z_range, row._main_body) == ((0.3, 1.5), 1)
    assert env.get_wrapper_attr("_forward_reward_weight") == 2.5
    assert not env.has_wrapper_attr("_healthy_reward")
    for given in (raw, row):
        for name in ("_ctrl_cost_weight", "ctrl_cost_weight", "frame_skip", "render_mode"):
            with pytest.raises(AttributeError, match=r"mjenv\.make\('.*-v5', .*=\.\.\.\)"):
                setattr(given, name, 3)
    with pytest.raises(AttributeError, match="make another one"):
        env.set_wrapper_attr("_ctrl_cost_weight", 100)
    env.set_wrapper_attr("note", 5)
    assert env.get_wrapper_attr("note") == 5


def test_rows_of_a_vector_differ() -> None:
    envs = mjenv.make_vec("Hopper-v5", 2)
    envs.reset(seed=[1, 1])
    envs.envs[1].model.body_mass[1] *= 3
    assert envs.envs[0].model.body_mass[1] * 3 == envs.envs[1].model.body_mass[1]
    first, second = envs.step(np.ones((2, 3)))[0]
    assert first.tobytes() != second.tobytes()


def test_arrays_of_all_rows() -> None:
    envs = mjenv.make_vec("Hopper-v5", 3)
    envs.reset(seed=0)
    mass = envs.envs[0].model.body_mass.copy()
    envs.model.body_mass[[0, 2], 1] = [5, 6]
    envs.model.body_mass[:, 2] *= 2
    assert envs.model.body_mass[:, 1].tolist() == [5, mass[1], 6]
    assert envs.envs[2].model.body_mass.tolist() == [0, 6, mass[2] * 2, *mass[3:]]
    envs.model.opt.timestep = [0.001, 0.002, 0.003]
    envs.model.opt.gravity[1, 2] = -1
    assert [row.dt for row in envs.envs] == [0.004, 0.008, 0.012]
    assert envs.model.opt.gravity[:, 2].tolist() == [-9.81, -1, -9.81]
    envs.data.xfrc_applied[:, 1, 0] = [1, 2, 3]
    assert [row.data.xfrc_applied[1, 0] for row in envs.envs] == [1, 2, 3]
    assert envs.data.xpos.shape == (3, 5, 3)
    envs.model.body_mass[1, 1] = -1
    with pytest.raises(ValueError, match=r"row 1: body_mass\[1\]"):
        envs.reset()
    assert envs.data.body("torso").xpos.tolist() == envs.data.xpos[:, 1].tolist()
    assert envs.data.joint("rootz").qpos.tolist() == envs.data.qpos[:, 1:2].tolist()
    both, row = envs.data.qvel, envs.envs[1].data.qvel
    both[1, 0], row[1] = 5, 6  # two readers of a row
    assert envs.data.qvel[1, :2].tolist() == envs.envs[1].data.qvel[:2].tolist() == [5, 6]
    assert both[1].tolist() == row.tolist()
    envs.step(np.zeros((3, 3)))
    assert both[1].tolist() == row.tolist() == envs.data.qvel[1].tolist()
    with pytest.raises(ValueError, match="read-only"):
        envs.data.xpos[0] = 0
    with pytest.raises(AttributeError, match="nothing"):
        envs.model.nothing = 1
    assert {"body_mass", "opt"} <= set(dir(envs.model))
    total = envs.model.body_subtreemass.copy()
    envs.model.body_mass[:] = 2 * np.stack([mass] * 3)
    envs.set_constants()
    assert envs.model.body_subtreemass.tolist() == (2 * total).tolist()


def test_set_constants(env: mjenv.Environment) -> None:
    before = env.model.body_subtreemass.copy()
    env.model.body_mass[:] *= 2
    env.set_constants()
    assert env.model.body_subtreemass.tolist() == (2 * before).tolist()


def test_initial_state(env: mjenv.Environment) -> None:
    assert env.init_qpos.tolist() == [0, 0, 0.75, 1] + [0] * 11
    assert env.init_qvel.tolist() == [0] * 14


def test_set_state_and_state_vector(env: mjenv.Environment) -> None:
    qpos, qvel = env.init_qpos + 0.01, env.init_qvel - 0.02
    qpos[3:7] = [0.6, 0.8, 0, 0]
    assert env.set_state(qpos, qvel) is None
    assert env.state_vector().tolist() == [*qpos, *qvel]
    assert env.data.body("torso").xpos.tolist() == qpos[:3].tolist()
    env.set_state(qpos.tolist(), qvel.tolist())
    assert env.state_vector().tolist() == [*qpos, *qvel]


def test_set_state_makes_an_environment_ready() -> None:
    env = mjenv.make("Swimmer-v5")
    env.set_state(np.zeros(5), np.zeros(5))
    obs = env.step(np.zeros(2))[0]
    assert obs.tolist() == [0.0] * 8


def test_do_simulation_counts_no_step() -> None:
    env, other = (mjenv.make("Hopper-v5", max_episode_steps=2) for _ in range(2))
    for each in (env, other):
        each.reset(seed=1)
    action = np.array([0.1, 0.2, 0.3])
    env.do_simulation(action, env.frame_skip)
    other.step(action)
    assert env.state_vector().tobytes() == other.state_vector().tobytes()
    assert [env.step(action)[3] for _ in range(2)] == [False, True]


def test_arrays_show_what_the_handle_writes(env: mjenv.Environment) -> None:
    for _ in range(2):  # an array that is read in every state is kept up to date
        env.step(np.zeros(8))
        held = env.data.xfrc_applied
        assert not held.any()
    env.handle.write(0, "xfrc_applied", np.ones(6 * 14))
    assert env.data.xfrc_applied.all()
    assert held.all()
