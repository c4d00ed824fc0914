"""The viewer without a browser."""

from __future__ import annotations

import contextlib
import copy
import io
import math
import os
import pickle
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import imageio.v3 as imageio
import numpy as np
import pytest

import mjenv
from mjenv_command import main
from mjenv_viewer import watch
from mjenv_viewer.controls import Page
from mjenv_viewer.notebook import html_of
from mjenv_viewer.panels.watch import WatchPanel
from mjenv_viewer.poses import along, forces_of, quaternions
from mjenv_viewer.scene import scene_of
from mjenv_viewer.server import Server
from mjenv_viewer.session import HISTORY
from waiting import wait_until

PLUGINS = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
ROOT = Path(__file__).parents[3]

# All geom types, a site, a spatial tendon, a height field, a mesh, textures, and groups.
EVERYTHING = """
<mujoco><asset>
<texture name="grid" type="2d" builtin="checker" width="16" height="16" rgb1="1 0 0" rgb2="0 0 1"/>
<texture name="cube" type="cube" builtin="flat" width="8" height="48" rgb1="0 1 0" rgb2="0 1 0"/>
<material name="grid" texture="grid" texrepeat="4 4"/><material name="cube" texture="cube"/>
<hfield name="hill" nrow="4" ncol="5" size="1 1 .5 .1"/>
<mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
<worldbody><geom type="plane" size="3 3 .1" material="grid"/><geom type="hfield" hfield="hill" pos="5 0 0"/>
<body pos="0 0 2"><freejoint/>
<geom type="sphere" size=".2" material="cube"/><site name="top" pos="0 0 .3" size=".05"/></body>
<body pos="1 0 2"><joint type="hinge" axis="0 1 0"/><geom type="capsule" size=".1 .3"/>
<geom type="ellipsoid" size=".1 .2 .3" group="4"/>
<geom type="cylinder" size=".1 .2"/><geom type="box" size=".1 .2 .3" rgba="1 0 0 .5"/><geom type="mesh" mesh="wedge"/>
<site name="end" pos=".2 0 0"/></body></worldbody>
<tendon><spatial width=".01"><site site="top"/><site site="end"/></spatial></tendon></mujoco>"""


@contextlib.contextmanager
def still(*arguments: Any) -> Iterator[Page]:
    """A session without a thread of its own, which the test steps."""
    session = Page(*arguments, port=0)
    session.playing = False
    session.ask = lambda function, timeout=0.0: function()  # type: ignore[method-assign]
    with contextlib.closing(session):
        yield session


@pytest.mark.parametrize("id", mjenv.ids())
def test_every_id_can_be_viewed(id: str) -> None:
    with still(id, 3) as session:
        for switch in session.picture.switches:
            session.picture.switches[switch] = True
        session.source = "random"
        session.step()
        assert session.steps.tolist() == [1, 1, 1]
        session.picture.show(session.picture.read())
        assert session.picture.scene.batches


def test_all_that_a_model_can_have_is_drawn() -> None:
    with still("Model-v0", 4, {"xml_string": EVERYTHING}) as session:
        kinds = [(batch.kind, len(batch.shape.faces) > 0, batch.group) for batch in session.picture.scene.batches]
        assert len(kinds) == 10  # 8 geom types, and two sites
        assert all(has_faces for _, has_faces, _ in kinds)
        for switch in session.picture.switches:
            session.picture.switches[switch] = True
        session.ask(session.picture_anew)
        poses = session.ask(session.picture.read)
        assert {"tendons", "joints", "centres of mass", "contacts", "contact forces"} <= poses[0].marks.keys()
        tendon = poses[0].marks["tendons"]
        ends = session.ask(lambda: np.array(session.envs.envs[0].data.site_xpos))
        assert np.allclose(tendon.position[0], ends[0])
        assert np.isclose(tendon.size[0, 2], np.linalg.norm(ends[1] - ends[0]))
        session.ask(lambda: session.picture.show(poses))


@pytest.mark.parametrize(("kind", "group"), [("geom", 3), ("geom", 5), ("site", 4)])
def test_a_robot_whose_groups_mujoco_hides_is_shown(kind: str, group: int) -> None:
    """Also after its environment was built anew. Groups that MuJoCo shows stay as they are."""
    size = "0.1" if kind == "geom" else "0.1 0.1 0.1"
    imu = '<site size="0.01"/>' if kind == "geom" else ""  # which does not make the robot visible
    body = f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><{kind} size="{size}" group="%d"/>{imu}'
    model = f'<mujoco><worldbody><geom type="plane" size="1 1 1"/><body><freejoint/>{body}</body></worldbody></mujoco>'
    for chosen, hint in ((group, f"The robot's {kind}s are in group {group},"), (2, None)):
        with still("Model-v0", 1, {"xml_string": model % chosen}) as session:
            for _ in range(2):
                stage = session.picture.stage
                assert all(node.visible for _, node, _ in stage._nodes)
                shown = [number for number, is_shown in enumerate(stage.groups[kind]) if is_shown]
                assert shown == sorted({0, 1, 2, chosen})
                assert (session.picture.hint or "").startswith(hint or "")
                assert (session.picture.hint is None) == (hint is None)
                session.rebuild({**session.options, "frame_skip": 2})


def test_a_new_environment_keeps_the_groups_that_are_shown() -> None:
    with still("Ant-v5") as session:
        session.picture.stage.show_group("geom", 0, False)
        session.rebuild({"frame_skip": 4})
        assert not session.picture.stage.groups["geom"][0]
        assert not any(node.visible for batch, node, _ in session.picture.stage._nodes if batch.group == 0)


def test_turns_are_those_of_the_matrices() -> None:
    rng = np.random.default_rng(0)
    expected = rng.normal(size=(200, 4))
    expected[:4] = np.eye(4)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    w, x, y, z = expected.T
    matrices = np.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        axis=1,
    )
    assert np.allclose(np.abs(np.sum(quaternions(matrices) * expected, axis=1)), 1)
    directions = np.array([[0, 0, 2.0], [0, 0, -3], [1, 0, 0], [-1, 2, 3]])
    w, x, y, z = along(directions).T
    axes = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    assert np.allclose(axes, directions / np.linalg.norm(directions, axis=1, keepdims=True))


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_contact_forces_carry_the_weight(cone: str) -> None:
    box = f"""<mujoco><option cone="{cone}"/><worldbody><geom type="plane" size="5 5 1"/><body pos="0 0 .1"><freejoint/>
    <geom type="box" size=".1 .1 .1" mass="3"/></body></worldbody></mujoco>"""
    with mjenv.make("Model-v0", xml_string=box, frame_skip=2000) as env:
        env.reset(seed=0)
        env.step(np.zeros(0))
        _, forces = forces_of(env.data)
        assert np.allclose(forces.sum(axis=0), [0, 0, 3 * 9.81], atol=1e-6)


def test_going_back_restores_every_bit() -> None:
    with still("Hopper-v5", 2) as session:
        session.ask(lambda: setattr(session, "source", "random"))
        session.ask(lambda: session.reset(3))
        images = [session.envs.snapshot(0)]
        observations = [session.obs[0].copy()]
        for _ in range(120):  # some episodes end
            session.ask(session.step)
            images.append(session.envs.snapshot(0))
            observations.append(session.obs[0].copy())
        assert session.steps[0] < 120
        other = session.envs.snapshot(1)
        for image, obs in zip(images[-2::-1], observations[-2::-1], strict=True):
            session.ask(session.back)
            assert session.envs.snapshot(0) == image
            assert np.array_equal(session.obs[0], obs)
        session.ask(session.back)  # there is nothing more
        assert session.envs.snapshot(0) == images[0]
        assert session.envs.snapshot(1) == other


def test_going_back_by_many_steps_keeps_to_the_history() -> None:
    with still("Swimmer-v5", 1, {"max_episode_steps": 2000}) as session:
        images = []
        recorder, plots = session.controls.files.recorder, session.controls.plots
        for _ in range(HISTORY + 20):
            images.append(session.envs.snapshot(0))
            session.step()
        recorder.begin()
        for _ in range(30):
            images.append(session.envs.snapshot(0))
            session.step()
        assert len(recorder) == 31
        session.back(10)
        assert session.envs.snapshot(0) == images[-10]
        assert session.steps[0] == HISTORY + 40
        assert len(recorder) == 21
        assert plots.times[-1] == HISTORY + 40
        session.back(5000)
        assert session.envs.snapshot(0) == images[50]
        assert session.steps[0] == 50
        assert len(recorder) == 1  # it begins anew
        assert not session.history
        session.back(10)
        assert session.steps[0] == 50


def test_the_page_answers_while_steps_take_longer_than_real_time() -> None:
    with Page("Ant-v5", 2, port=0) as session:
        session.do(lambda: setattr(session, "speed", 1e9))
        before = session.ask(lambda: session.steps[0])
        drawn: list[Any] = []
        session.ask(lambda: setattr(session, "on_tick", lambda: drawn.append(session.steps[0])))
        wait_until(lambda: len(drawn) > 1, "pictures")
        assert session.ask(lambda: session.steps[0]) > before


def test_the_grid_is_in_the_middle_until_a_row_is_chosen() -> None:
    with still("Hopper-v5", 4) as session:
        session.step()
        picture = session.picture
        roots = [np.array(row.data.xpos)[1] for row in picture.rows]
        picture.show(picture.read())
        assert np.array_equal(picture.stage.origin, [*roots[0][:2], 0])
        picture.set_dark(True)
        session.choose_row(2)
        picture.show(picture.read())
        assert np.array_equal(picture.stage.origin, [*(roots[2] + picture.stage.offsets[2])[:2], 0])
        session.rebuild({"frame_skip": 5})
        assert session.picture is not picture
        assert session.picture.dark
        session.picture.show(session.picture.read())
        assert np.array_equal(session.picture.stage.origin[1], picture.stage.offsets[2][1])


def test_snapshots_return_to_a_state() -> None:
    with still("Ant-v5", 2) as session:
        session.step()
        saved, total = session.envs.snapshot(0), session.totals[0]
        name = session.save()
        assert name == "1: row 0, step 1"
        session.step()
        session.step()
        assert session.envs.snapshot(0) != saved
        session.restore(name)
        assert session.envs.snapshot(0) == saved
        assert (session.steps[0], session.totals[0]) == (1, total)
        session.choose_row(1)  # into another row
        session.restore(name)
        assert session.envs.snapshot(1) == saved


def test_sliders_write_the_model() -> None:
    with still("Model-v0", 2, {"xml_string": EVERYTHING}) as session:
        model, state = session.envs.envs[1].model, session.envs.envs[1].state_vector()
        mass, weight, friction = (
            np.array(model.body_mass),
            np.array(model.body_invweight0),
            np.array(model.geom_friction),
        )
        session.ask(lambda: session.controls.values.scale("Masses", 2.0))
        session.ask(lambda: session.controls.values.scale("Friction", 0.5))
        session.ask(lambda: session.controls.values.scale("Gravity", 0.0))
        model = session.envs.envs[1].model
        assert np.array_equal(model.body_mass, 2 * mass)
        assert np.allclose(model.body_invweight0, weight / 2)  # no joint has an armature
        assert np.array_equal(model.geom_friction[:, 0], friction[:, 0] / 2)
        assert np.array_equal(model.geom_friction[:, 1:], friction[:, 1:])
        assert not np.any(model.opt.gravity)
        assert np.array_equal(session.envs.envs[1].state_vector(), state)


def test_live_parameters_are_written() -> None:
    mjenv.load_tasks(PLUGINS / "liblive.so")
    with still("CppLive-v0", 3) as session:
        panel = session.controls.parameters
        labels = [handle.label for handle in panel.inputs.values()]
        assert labels == ["speed", "gains[0]", "gains[1]", "gains[2]"]
        speed = panel.inputs["speed", 0]
        assert (speed.min, speed.max, speed.value) == (-2, 2, 0.5)
        panel.write("speed", 0, 1.5)
        assert session.envs.parameters["speed"].tolist() == [1.5, 1.5, 1.5]
        assert session.obs[:, 0].tolist() == [1.5, 1.5, 1.5]
        session.choose_row(1)
        panel.everywhere.value = False
        panel.write("gains", 2, 7.0)
        assert session.envs.parameters["gains"].tolist() == [[1, 2, 3], [1, 2, 7], [1, 2, 3]]
        assert panel.inputs["gains", 2].value == 7
        session.choose_row(0)
        assert panel.inputs["gains", 2].value == 3
        with pytest.raises(mjenv.InvalidValueError, match="speed"):
            panel.write("speed", 0, 9.0)
        assert speed.value == 1.5
        session.step()
        panel.write("speed", 0, -0.5)  # of row 0 alone
        session.back()
        assert speed.value == 1.5  # snapshots contain them
        session.rebuild({"speed": 0.25})
        assert (speed.value, panel.inputs["gains", 2].value) == (0.25, 3)


def test_skins_move_with_the_bodies() -> None:
    with still("Model-v0", 2, {"xml_string": SKIN}) as session:
        row = session.envs.envs[0]
        row.set_state(np.array([0, 0, 5, 1, 0, 0, 0]), np.zeros(6))
        session.picture.show(session.picture.read())
        node = session.picture.stage.skins[0]
        assert node.color == (255, 0, 0)
        heights = np.asarray(node.vertices)[:, 2].tolist()
        assert heights == [5, 5, 5]
        session.picture.stage.show_group("skin", 1, False)
        session.picture.show(session.picture.read())
        assert not node.visible
        session.picture.stage.show_group("skin", 1, True)
        session.picture.show(session.picture.read())
        assert node.visible


SKIN = """
<mujoco><asset><material name="red" rgba="1 0 0 1"/>
<skin vertex="0 0 0  1 0 0  0 1 0" face="0 1 2" group="1" material="red">
<bone body="carrier" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/></skin></asset>
<worldbody><body name="carrier"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_video_has_a_picture_for_each_state(suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if suffix == ".gif":
        monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)  # as if it were not installed
    with still("Ant-v5", 1) as session:
        recorder = session.controls.files.recorder
        recorder.begin()
        session.source = "random"
        for _ in range(4):
            session.step()
        state = session.envs.snapshot(0)
        end, content = recorder.video()
        assert session.envs.snapshot(0) == state
        assert end == suffix
        pictures = imageio.imread(content, extension=suffix, index=None if suffix == ".mp4" else ...)
        assert pictures.shape[0] == 5
        with mjenv.make("Ant-v5", render_mode="rgb_array") as env:
            env.reset(seed=0)
            for picture, frame in zip(pictures, recorder.frames, strict=True):
                env.set_state(frame["qpos"], frame["qvel"])
                # A GIF has 256 colours, and an MP4 loses details.
                assert np.abs(picture.astype(int) - env.render()).mean() < 4
        assert np.abs(pictures[0].astype(int) - pictures[-1]).max() > 50


@pytest.mark.parametrize("observation", ["flat", "dict"])
def test_a_recording_has_the_states(observation: str) -> None:
    with still("Swimmer-v5", 1, {"observation": observation}) as session:
        recorder = session.controls.files.recorder
        session.ask(recorder.begin)
        states = [session.envs.envs[0].data.qpos.copy()]
        for _ in range(5):
            session.ask(session.step)
            states.append(session.envs.envs[0].data.qpos.copy())
        found = np.load(io.BytesIO(session.ask(recorder.trajectory)))
        assert np.array_equal(found["qpos"], states)
        assert np.array_equal(found["obs"][:, :3], found["qpos"][:, 2:])
        assert str(found["id"]) == "Swimmer-v5"


# ---- what a program steps ----


def play(envs: Any, steps: int = 150) -> list[Any]:
    rng = np.random.default_rng(0)
    results = [envs.reset(seed=7)[0]]
    for _ in range(steps):
        actions = rng.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
        results += envs.step(actions)[:4]
    return [*results, envs.snapshot()]


def equal(one: list[Any], other: list[Any]) -> bool:
    return all(a == b if isinstance(a, bytes) else np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_viewing_changes_no_bit(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Server, "is_watched", True)
    monkeypatch.setattr("mjenv_viewer.watch.PICTURES", 1e9)
    expected = play(mjenv.make_vec("Hopper-v5", 6, autoreset_mode=mode))
    envs = mjenv.make_vec("Hopper-v5", 6, autoreset_mode=mode)
    kind = type(envs)
    with mjenv.view(envs, port=0, share=1.0, quiet=True) as view:
        monkeypatch.setattr(view, "_share", math.inf)  # after each step, however long a picture takes on this machine
        for name in view.picture.switches:
            view.picture.switches[name] = True
        drawn = count_calls(monkeypatch, view.picture, "show")
        found = play(envs)
        assert len(drawn) > 20
        assert view.steps == 150
        assert isinstance(envs, kind)
        assert type(copy.deepcopy(envs)) is kind
        assert type(pickle.loads(pickle.dumps(envs))) is kind
    assert type(envs) is kind
    assert equal(found, expected)


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[None]:
    calls: list[None] = []
    method = getattr(owner, name)

    def counted(*arguments: Any) -> Any:
        calls.append(None)
        return method(*arguments)

    monkeypatch.setattr(owner, name, counted)
    return calls


def test_live_parameters_of_a_program() -> None:
    mjenv.load_tasks(PLUGINS / "liblive.so")
    envs = mjenv.make_vec("CppLive-v0", 4)
    with watch.View(envs, rows=2, port=0, quiet=True) as view:
        panel = WatchPanel(view)
        envs.reset(seed=0)
        view.do(lambda: panel.parameters.write("speed", 0, 1.5))
        obs, *_ = envs.step(np.zeros((4, 1)))
        assert obs[:, 0].tolist() == [1.5] * 4  # also of rows that are not drawn


def test_a_busy_machine_counts_the_time_of_other_threads_for_more(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = watch._Clock()
    times = {"perf_counter": 0.0, "thread_time": 0.0, "clock_gettime": 0.0}
    for name in times:
        monkeypatch.setattr(watch.time, name, lambda *_, name=name: times[name])
    clock._clocks = [1]
    clock.start()
    times |= {"perf_counter": 0.010, "thread_time": 0.010, "clock_gettime": 0.003}
    assert clock.stop() == pytest.approx(0.013)
    for _ in range(200):
        clock.start()
        times = {name: value + 0.010 for name, value in times.items()}
        times["perf_counter"] += 0.030  # four seconds pass for one of CPU time
        found = clock.stop()
    assert found == pytest.approx(0.040 + 4 * 0.010, rel=1e-4)


def test_a_single_environment_inside_wrappers() -> None:
    import gymnasium

    env = gymnasium.make("mjenv/Reacher-v5")
    with mjenv.view(env, port=0, quiet=True) as view:
        env.reset(seed=0)
        env.step(env.action_space.sample())
        assert view.steps == 1
    assert type(env.unwrapped) is mjenv.Environment


def test_a_pause_waits_and_steps_once() -> None:
    envs = mjenv.make_vec("Swimmer-v5", 2)
    with mjenv.view(envs, port=0, quiet=True) as view:
        view.do(lambda: setattr(view, "paused", True))
        envs.reset(seed=0)
        worker = threading.Thread(target=lambda: [envs.step(envs.action_space.sample()) for _ in range(20)])
        worker.start()
        time.sleep(0.3)
        assert view.steps == 0
        view.do(view.go_one_step)
        wait_until(lambda: view.steps == 1, "a step")
        time.sleep(0.2)
        assert view.steps == 1
        view.do(lambda: setattr(view, "paused", False))
        worker.join(20)
        assert view.steps == 20


# ---- what cannot be ----


def test_importing_mjenv_does_not_import_viser() -> None:
    code = "import sys, mjenv, mjenv_viewer; assert not {'viser', 'trimesh', 'PIL'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True)


def run(*arguments: str, code: str = "pass") -> subprocess.CompletedProcess[str]:
    start = f"import sys; {code}; from mjenv_command import main; sys.exit(main({list(arguments)!r}))"
    return subprocess.run([sys.executable, "-c", start], capture_output=True, text=True, timeout=60, check=False)


def test_without_viser_it_says_what_to_install() -> None:
    done = run("view", "Ant-v5", code="sys.modules['viser'] = None")
    assert done.returncode == 2
    assert 'pip install "mjenv[view]"' in done.stderr


def test_a_port_in_use_is_refused() -> None:
    server = Server(0)
    before = threading.active_count()
    with pytest.raises(mjenv.InvalidValueError, match=f"port {server.port} "):
        Server(server.port)
    wait_until(lambda: threading.active_count() <= before, "the end of the threads")
    done = run("view", "Ant-v5", "--port", str(server.port), "--no-browser")
    assert done.returncode == 2
    assert f"port {server.port} " in done.stderr
    server.close()
    with pytest.raises(mjenv.InvalidValueError, match="70000"):
        Server(70000)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["Unknown-v0"], "Unknown-v0"),
        (["Model-v0"], "xml_file"),
        (["Ant-v5", "--option", "frame_skip=0"], "frame_skip"),
        (["Ant-v5", "--option", "wrong=1"], "wrong"),
        (["Ant-v5", "--xml", "/nowhere.xml"], "/nowhere.xml"),
        (["Ant-v5", "--policy", "/nowhere.txt"], "/nowhere.txt"),
    ],
)
def test_what_cannot_be_built_is_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", *arguments, "--no-browser", "--port", "0"]) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize("file", ["/nowhere.py", "/nowhere.so"])
def test_tasks_that_cannot_be_loaded_are_refused(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refusal:
        main(["view", "Ant-v5", "--tasks", file, "--no-browser"])
    assert refusal.value.code == 2
    assert file in capsys.readouterr().err


def test_a_policy_of_stable_baselines3_says_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as file:
        file.writestr("data", "{}")
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    assert main(["view", "Ant-v5", "--policy", str(tmp_path / "model.zip"), "--no-browser", "--port", "0"]) == 2
    errors = capsys.readouterr().err
    assert "pip install stable-baselines3" in errors
    assert "Traceback" not in errors


def test_a_model_of_a_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    file = ROOT / "tests" / "golden" / "custom" / "spider.xml"
    monkeypatch.setattr(Page, "run", lambda session: print(session.envs.model.nbody.tolist()))
    assert main(["view", "Model-v0", "--xml", str(file), "--rows", "2", "--no-browser", "--port", "0"]) == 0
    bodies = 1 + file.read_text().count("<body ")  # with the world
    assert capsys.readouterr().out.splitlines()[1] == str([bodies, bodies])


@pytest.mark.parametrize(
    "show", [lambda envs: mjenv.view(envs, port=0), lambda envs: Page("Model-v0", 1, EMPTY, port=0)]
)
def test_a_model_without_geoms_is_refused(show: Any) -> None:
    before = threading.active_count()
    envs = mjenv.make_vec("Model-v0", 1, **EMPTY)
    with pytest.raises(mjenv.InvalidValueError, match="no geoms"):
        show(envs)
    envs.reset(seed=0)  # it is as it was
    wait_until(lambda: threading.active_count() <= before, "the end of the threads")


EMPTY = {"xml_string": "<mujoco><worldbody/></mujoco>"}


def test_a_task_in_a_python_file(tmp_path: Path) -> None:
    (tmp_path / "hold.py").write_text(TASK)
    code = "import mjenv; mjenv.load_tasks('hold.py'); from mjenv_viewer.controls"
    code += " import Page; from mjenv_viewer.parts import observation_parts; s = Page('Hold-v0', 2, port=0)"
    code += "; s.step()"
    code += "; print(observation_parts(s.envs.envs[0])); s.close()"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "slice(0, 2" in done.stdout, done.stderr


TASK = """
import mjenv, numpy as np
class Hold(mjenv.Task):
    model = "<mujoco><worldbody><body><joint/><geom size='.1' pos='1 0 0'/></body></worldbody></mujoco>"
    needs = ("qpos", "qvel")
    def reset(self, rng, rows):
        return rng.uniform(-1, 1, (rows, self.nq)), np.zeros((rows, self.nv)), {}
    def observe(self, sim):
        return np.concatenate([sim.qpos, sim.qvel], axis=1)
    def step(self, sim, action):
        return -np.abs(sim.qpos[:, 0]), np.zeros(len(action), bool), {}
mjenv.register("Hold-v0", Hold)
"""


@pytest.mark.parametrize("make", [mjenv.make, mjenv.make_vec])
def test_jupyter_shows_spaces_and_options(make: Any) -> None:
    env = make("Ant-v5", ctrl_cost_weight=0.125)
    env.reset(seed=0)
    before = env.snapshot()
    html = env._repr_html_()
    assert html == html_of(env)
    for part in ("Ant-v5", "<td>ctrl_cost_weight</td><td>0.125</td>", "(105,)", "qvel [13:27]", "healthy_z_range"):
        assert part in html
    assert env.snapshot() == before
    assert "qpos: Box (13,) float64, qvel: Box (14,) float64" in html_of(make("Ant-v5", observation="dict"))
    with mjenv.view(env, port=0, quiet=True) as view:
        assert f'<iframe src="{view.address}"' in view._repr_html_()


def test_a_radius_is_that_of_the_robot_alone() -> None:
    with mjenv.make("Ant-v5") as env:
        env.reset(seed=0)
        assert 0.8 < scene_of(env.model, env.data).radius < 1.6  # the floor is 40 m wide
