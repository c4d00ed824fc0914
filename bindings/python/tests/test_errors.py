"""Bad input: each gives the exception that a Python user expects, names the culprit, and leaves things usable."""

import os
import pickle
import subprocess
import sys
import threading
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import mjenv
from mjenv import Status
from systems import WINDOWS

NAN, INF = float("nan"), float("inf")


def refused(kind: type[BaseException], status: Status, match: str) -> Any:
    """pytest.raises for a mjenv.Error of that status that is also `kind`."""

    class Refused:
        def __enter__(self) -> None:
            self.raises = pytest.raises(kind, match=match)
            self.info = self.raises.__enter__()

        def __exit__(self, *exception: Any) -> bool:
            caught = bool(self.raises.__exit__(*exception))
            assert isinstance(self.info.value, mjenv.Error)
            assert self.info.value.status == status
            assert str(self.info.value) == self.info.value.message
            return caught

    return Refused()


@pytest.mark.parametrize("call", [mjenv.make, mjenv.spec, mjenv.options])
@pytest.mark.parametrize(
    ("id", "near"), [("Ant-v3", "nearest: Ant-v4, Ant-v5; "), ("ant-v5", "nearest: Ant-v5; "), ("", "")]
)
def test_unknown_id(call: Any, id: str, near: str) -> None:
    with refused(gymnasium.error.UnregisteredEnv, Status.E_NAME, f'"{id}"; {near}mjenv_id_at lists all'):
        call(id)


@pytest.mark.parametrize(
    ("id", "option"),
    [
        ("Ant-v5", "healthy"),
        ("Ant-v4", "frame_skip"),
        ("Reacher-v4", "xml_file"),
        ("Reacher-v5", "reset_noise_scale"),
        ("Ant-v4", "default_camera_config"),
        ("Ant-v5", "observation_space"),
        ("Ant-v5", "model_path"),
        ("Ant-v5", ""),
    ],
)
def test_unknown_option(id: str, option: str) -> None:
    """The message begins with Python's words, by which TorchRL, for one, drops a keyword that it can do without."""
    words = f"^{id} got an unexpected keyword argument '{option}'.*mjenv\\.options\\('{id}'\\) lists all"
    for make in (mjenv.make, mjenv.make_vec):
        with refused(TypeError, Status.E_NAME, f"(?!.*Did you mean '{option}'){words}"):
            make(id, **{option: None})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(mjenv.OptionError, match=words):
            gymnasium.make(f"mjenv/{id}", **{option: None})


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("frame_skip", 5.0),
        ("frame_skip", None),
        ("frame_skip", "5"),
        ("ctrl_cost_weight", None),
        ("ctrl_cost_weight", "0.5"),
        ("ctrl_cost_weight", (0.5,)),
        ("ctrl_cost_weight", 1j),
        ("healthy_z_range", 0.2),
        ("healthy_z_range", None),
        ("healthy_z_range", "ab"),
        ("healthy_z_range", [[0.2, 1.0]]),
        ("healthy_z_range", ("0.2", "1.0")),
        ("healthy_z_range", [0.2, [1.0]]),
        ("xml_file", 3),
        ("xml_file", None),
        ("main_body", 1.5),
        ("main_body", None),
        ("terminate_when_unhealthy", 0.5),
        ("terminate_when_unhealthy", None),
        ("norm", 1),
    ],
)
def test_wrong_type(option: str, value: Any) -> None:
    with refused(TypeError, Status.E_TYPE, option):
        mjenv.make("Ant-v5", **{option: value})


@pytest.mark.parametrize(
    ("option", "value", "status"),
    [
        ("frame_skip", 0, Status.E_VALUE),
        ("frame_skip", -1, Status.E_VALUE),
        ("frame_skip", 2**70, Status.E_VALUE),
        ("ctrl_cost_weight", NAN, Status.E_VALUE),
        ("reset_noise_scale", -0.1, Status.E_VALUE),
        ("reset_noise_scale", INF, Status.E_VALUE),
        ("healthy_z_range", (0.2, NAN), Status.E_VALUE),
        ("healthy_z_range", (0.2, 1.0, 2.0), Status.E_SIZE),
        ("healthy_z_range", (), Status.E_SIZE),
        ("terminate_when_unhealthy", 2, Status.E_VALUE),
        ("norm", "best", Status.E_VALUE),
        ("autoreset_mode", "next_step", Status.E_ARGUMENT),
        ("main_body", -1, Status.E_VALUE),
        ("xml_file", "ant.xml\0", Status.E_VALUE),
        ("xml_file", "", Status.E_VALUE),
    ],
)
def test_value_out_of_range(option: str, value: Any, status: Status) -> None:
    with refused(ValueError, status, option):
        mjenv.make("Ant-v5", **{option: value})


@pytest.mark.parametrize("steps", [0, -2, 5.0, "5"])
def test_max_episode_steps(steps: Any) -> None:
    with pytest.raises(ValueError, match="max_episode_steps"):
        mjenv.make("Ant-v5", max_episode_steps=steps)


@pytest.mark.parametrize(
    ("keywords", "kind"),
    [
        ({"width": None}, TypeError),
        ({"height": 4.0}, TypeError),
        ({"width": 10**12}, TypeError),
        ({"camera_name": 4}, TypeError),
        ({"camera_id": 0, "camera_name": "track"}, ValueError),
    ],
)
def test_rendering_keywords_that_gymnasium_refuses(keywords: dict[str, Any], kind: type[Exception]) -> None:
    with pytest.raises(kind, match=next(iter(keywords))):
        mjenv.make("Ant-v5", **keywords)


@pytest.mark.parametrize("mode", ["rgb", "ansi", "rgb_array_lists", "ansi_list", ""])
@pytest.mark.parametrize("make", [mjenv.make, mjenv.make_vec, lambda id, **kw: gymnasium.make(f"mjenv/{id}", **kw)])
@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium's own
def test_an_unknown_render_mode(make: Any, mode: str) -> None:
    with refused(ValueError, Status.E_ARGUMENT, f"human, rgb_array, depth_array, rgbd_tuple, not '{mode}'"):
        make("Ant-v5", render_mode=mode)


@pytest.mark.parametrize(
    ("misspelt", "meant"),
    [
        ("rendermode", "render_mode"),
        ("camera_nam", "camera_name"),
        ("default_camera_configuration", "default_camera_config"),
        ("ctrl_cost", "ctrl_cost_weight"),
        ("max_steps", "max_episode_steps"),
    ],
)
def test_a_misspelt_keyword(misspelt: str, meant: str) -> None:
    for make in (mjenv.make, mjenv.make_vec):
        with refused(TypeError, Status.E_NAME, f"'{misspelt}'.*Did you mean '{meant}'"):
            make("Ant-v5", **{misspelt: 1})


@pytest.mark.parametrize("call", [mjenv.make, mjenv.make_vec, mjenv.spec, mjenv.options, mjenv.model_xml])
@pytest.mark.parametrize("id", [None, 5, b"Ant-v5", ["Ant-v5"]])
def test_an_id_of_another_type(call: Any, id: Any) -> None:
    with refused(TypeError, Status.E_TYPE, "the id is a str, 'Ant-v5' for example"):
        call(id)
    with refused(TypeError, Status.E_TYPE, "the id"):
        mjenv.Environment(id)


def test_an_environment_instead_of_an_id(env: mjenv.Environment) -> None:
    for call in (mjenv.make, mjenv.make_vec):
        with refused(TypeError, Status.E_TYPE, "this is an environment, and make needs its id"):
            call(env)


# ---- models ----


@pytest.mark.parametrize(
    "file", ["nothing.xml", "./nothing.xml", "/nowhere/ant.xml", "~/nothing.xml", Path("nothing.xml")]
)
def test_a_missing_model_file(file: Any) -> None:
    with refused(OSError, Status.E_FILE, r"nothing\.xml|/nowhere/ant\.xml"):
        mjenv.make("Ant-v5", xml_file=file)


@pytest.mark.parametrize(
    ("id", "keywords", "match"),
    [
        ("Ant-v5", {"xml_string": "<mujoco>"}, "XML"),
        ("Ant-v5", {"xml_string": "<mujoco><worldbody/></mujoco>"}, "positions"),
        ("Ant-v4", {"xml_string": "<mujoco><worldbody/></mujoco>"}, "positions|torso"),
        ("Pusher-v5", {"xml_file": "ant.xml"}, "tips_arm|positions"),
        ("Ant-v5", {"main_body": "nose"}, "nose.*torso"),
        ("Ant-v5", {"main_body": 99}, "99.*14 bodies"),
    ],
)
def test_a_model_that_does_not_serve(id: str, keywords: dict[str, Any], match: str) -> None:
    with refused(ValueError, Status.E_MODEL, match):
        mjenv.make(id, **keywords)


def test_a_model_file_by_every_kind_of_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = "<mujoco><worldbody><body><joint type='slide'/><geom size='1'/></body></worldbody></mujoco>"
    (tmp_path / "m\u00f6del.xml").write_text(model)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("USERPROFILE" if WINDOWS else "HOME", str(tmp_path))
    for file in ("./m\u00f6del.xml", "~/m\u00f6del.xml", str(tmp_path / "m\u00f6del.xml"), Path("m\u00f6del.xml")):
        assert mjenv.make("HalfCheetah-v5", xml_file=file).model.nq == 1


# ---- steps and resets ----


def test_step_before_reset() -> None:
    with refused(gymnasium.error.ResetNeeded, Status.E_NOT_RESET, "reset"):
        mjenv.make("Ant-v5").step(np.zeros(8))


def test_step_after_the_end() -> None:
    env = mjenv.make("Reacher-v5", max_episode_steps=1)
    env.reset(seed=0)
    assert env.step(np.zeros(2))[3]
    with refused(gymnasium.error.ResetNeeded, Status.E_EPISODE_ENDED, "ended.*strict"):
        env.step(np.zeros(2))
    env.reset()
    env.step(np.zeros(2))
    lenient = mjenv.make("Reacher-v5", max_episode_steps=1, strict=False)
    lenient.reset(seed=0)
    assert [lenient.step(np.zeros(2))[3] for _ in range(3)] == [True] * 3


@pytest.mark.parametrize(
    "action", [np.zeros(7), np.zeros(9, np.float32), np.zeros((8, 1)), np.zeros((1, 8)), 0.0, [], [0] * 7]
)
def test_an_action_of_another_shape(env: mjenv.Environment, action: Any) -> None:
    before = env.state_vector()
    with refused(ValueError, Status.E_SIZE, r"shape.*\(8,\)"):
        env.step(action)
    assert env.state_vector().tobytes() == before.tobytes()


@pytest.mark.parametrize(
    "action", [None, "abcdefgh", [None] * 8, np.zeros(8, complex), np.zeros(8, np.float16), [{}] * 8]
)
def test_an_action_that_holds_no_numbers_we_take(env: mjenv.Environment, action: Any) -> None:
    with refused(TypeError, Status.E_TYPE, "float32 or float64"):
        env.step(action)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("value", [NAN, INF, -INF])
def test_an_action_that_is_not_finite(env: mjenv.Environment, value: float, dtype: Any) -> None:
    before = env.state_vector()
    action = np.zeros(8, dtype)
    action[3] = value
    with refused(ValueError, Status.E_VALUE, r"action\[3\]"):
        env.step(action)
    assert env.state_vector().tobytes() == before.tobytes()
    env.step(np.zeros(8))


@pytest.mark.parametrize("seed", [-1, 1.0, "1", np.int64(1), [1]])
def test_a_seed_that_gymnasium_refuses(env: mjenv.Environment, seed: Any) -> None:
    before = env.state_vector()
    with pytest.raises(gymnasium.error.Error, match="seed"):
        env.reset(seed=seed)
    assert env.state_vector().tobytes() == before.tobytes()
    assert env.np_random_seed == 3


# ---- state ----


@pytest.mark.parametrize(
    ("qpos", "qvel", "match"),
    [
        (np.zeros(14), np.zeros(14), "nq"),
        (np.zeros(15), np.zeros(15), "nv"),
        (np.zeros((15, 1)), np.zeros(14), "shape"),
        (np.full(15, NAN), np.zeros(14), r"qpos\[0\]"),
        (np.zeros(15), np.full(14, INF), r"qvel\[0\]"),
    ],
)
def test_set_state(env: mjenv.Environment, qpos: Any, qvel: Any, match: str) -> None:
    before = env.state_vector()
    with pytest.raises(ValueError, match=match):
        env.set_state(qpos, qvel)
    assert env.state_vector().tobytes() == before.tobytes()


def test_do_simulation(env: mjenv.Environment) -> None:
    with refused(ValueError, Status.E_SIZE, "shape"):
        env.do_simulation(np.zeros(7), 5)
    with refused(ValueError, Status.E_VALUE, "frames"):
        env.do_simulation(np.zeros(8), 0)
    for frames in (2**64 + 1, -(2**64) + 1):
        with refused(ValueError, Status.E_VALUE, str(frames)):
            env.do_simulation(np.zeros(8), frames)
    assert env.data.time == 0
    with pytest.raises(TypeError):
        env.do_simulation(np.zeros(8), 1.5)  # type: ignore[arg-type]


def test_unknown_arrays_and_objects(env: mjenv.Environment) -> None:
    with pytest.raises(AttributeError, match="velocity"):
        _ = env.data.velocity
    with pytest.raises(AttributeError, match="xpos"):
        _ = env.model.body("torso").xpos
    with refused(KeyError, Status.E_NAME, "nose.*torso"):
        env.get_body_com("nose")
    with refused(IndexError, Status.E_NAME, "99"):
        env.data.body(99)
    for index in (2**64, 1 - 2**64):
        with pytest.raises(IndexError):
            env.data.body(index)
    with pytest.raises(TypeError):
        env.data.body(1.0)  # type: ignore[arg-type]
    with pytest.raises(AttributeError, match="read-only"):
        env.data.xpos = np.zeros(15)
    with pytest.raises(ValueError, match="read-only"):
        env.data.xpos[0] = 1


# ---- handles ----


@pytest.mark.parametrize(
    "use",
    [
        lambda env: env.step(np.zeros(8)),
        lambda env: env.reset(seed=1),
        lambda env: env.reset(),
        lambda env: env.set_state(np.zeros(15), np.zeros(14)),
        lambda env: env.state_vector(),
        lambda env: env.get_body_com("torso"),
        lambda env: env.do_simulation(np.zeros(8), 1),
        pickle.dumps,
    ],
)
def test_use_after_close(env: mjenv.Environment, use: Any) -> None:
    env.close()
    with pytest.raises(mjenv.ClosedError, match="closed"):
        use(env)
    env.close()


def test_two_threads() -> None:
    """The later of two threads is refused, whatever it calls, and the first is not disturbed."""
    env = mjenv.make("Humanoid-v5", frame_skip=2000, terminate_when_unhealthy=False)
    alone = mjenv.make("Humanoid-v5", frame_skip=2000, terminate_when_unhealthy=False)
    env.reset(seed=1), alone.reset(seed=1)
    action = np.full(17, 0.1)
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(env.step(action)))
    thread.start()
    uses = (lambda: env.step(-action), env.reset, env.close, env.state_vector, lambda: pickle.dumps(env))
    refusals = []
    while thread.is_alive():
        for use in uses:
            try:
                use()
            except mjenv.BusyError as error:
                refusals.append(error)
            else:
                break
    thread.join()
    assert len(refusals) >= len(uses)
    assert all(isinstance(error, RuntimeError) and error.status == Status.E_BUSY for error in refusals)
    assert results[0][0].tobytes() == alone.step(action)[0].tobytes()


def test_errors_can_be_pickled() -> None:
    with pytest.raises(mjenv.ModelFileError) as caught:
        mjenv.make("Ant-v5", xml_file="/nowhere.xml")
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is mjenv.ModelFileError
    assert (str(again), again.status) == (str(caught.value), Status.E_FILE)


ANOTHER = "msvcrt.dll" if WINDOWS else "libm.so.6"


@pytest.mark.parametrize("library", ["/nowhere/libmjenv.so", __file__, ANOTHER])
def test_a_library_that_is_none(library: str) -> None:
    run = subprocess.run(
        [sys.executable, "-c", "import mjenv"],
        env={**os.environ, "MJENV_LIBRARY": library},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    assert f"mjenv.errors.EngineError: {'cannot load ' if library != ANOTHER else ''}{library}" in run.stderr
