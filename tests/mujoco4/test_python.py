"""Python with both engines: which one computes, that each equals Gymnasium or itself alone, and what is refused.

MuJoCo 2.2.2 is compiled into build/libmjenv.so. This Python has Gymnasium and MuJoCo 4.0.
"""

from __future__ import annotations

import copy
import inspect
import os
import pickle
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

import mjenv
from mjenv import verify
from mjenv.verify import check_same

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Path(os.environ["MJENV_LIBRARY"])  # conftest.py sets it
LIBRARY_4 = LIBRARY.with_name("libmjenv-mujoco4.so")
MUJOCO = next(Path(mujoco.__file__).parent.glob("libmujoco.so.4.0.*"))


def play(env: Any, steps: int = 100) -> bytes:
    env.action_space.seed(1)
    written = [env.reset(seed=1)[0].tobytes()]
    for _ in range(steps):
        obs, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        written.append(obs.tobytes() + repr((reward, terminated, truncated)).encode())
        if terminated is True or truncated is True:
            env.reset()
    return b"".join(written)


# For other processes.
PLAY = f"from typing import Any\n{inspect.getsource(play)}\n"


def python(text: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Another process, whose environment has nothing of mjenv's but what is given here and MJENV_LIBRARY."""
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith("MJENV_") or name == "MJENV_LIBRARY"
    }
    return subprocess.run(
        [sys.executable, "-c", PLAY + text], capture_output=True, text=True, env={**kept, **environment}, timeout=300
    )


def printed(text: str, **environment: str) -> str:
    run = python(text, **environment)
    assert (run.returncode, run.stderr) == (0, "")
    return run.stdout


def error_of(text: str, **environment: str) -> str:
    """The last line of what a failed process says."""
    run = python(text, **environment)
    assert run.returncode == 1, run.stdout
    return run.stderr.splitlines()[-1]


# ---- which engine computes ----


def test_both_engines_can_be_used() -> None:
    assert mjenv.engines() == ("2.2.2", "4.0")
    assert mjenv.version().endswith("(MuJoCo 2.2.2)")
    assert mjenv.version("4.0").partition(" (MuJoCo 4.0")[0] == mjenv.version().partition(" (")[0]
    assert set(mjenv.ids()) - set(mjenv.ids("4.0")) <= {"Pusher-v4"}  # Gymnasium refuses it on MuJoCo 4.0
    assert mjenv.make("Ant-v5").engine == "2.2.2"


@pytest.mark.parametrize("id", ["Humanoid-v5", "Pusher-v5", "Walker2d-v4"])
def test_equals_gymnasium(id: str) -> None:
    """Gymnasium here is on MuJoCo 4.0; tests/live compares all ids."""
    with verify.quiet():
        for run in verify.draw_runs(id, option_sets=1, seeds=1, steps=100, engine="4.0"):
            verify.play(run)


def test_every_way_to_choose() -> None:
    """make, make_vec, specs, and Gymnasium's functions."""
    expected = play(mjenv.make("Ant-v5", engine="4.0"))
    assert expected != play(mjenv.make("Ant-v5"))
    spec = mjenv.spec("Ant-v5", engine="4.0")
    made = mjenv.make("Ant-v5", engine="4.0")
    for env in (
        gymnasium.make("mjenv/Ant-v5", engine="4.0"),
        gymnasium.make(spec),
        gymnasium.make(made.spec),
        mjenv.make(spec),
        mjenv.make(made.spec),
        mjenv.Environment("Ant-v5", engine="4.0"),
    ):
        assert env.unwrapped.engine == "4.0"
        assert play(env) == expected
    assert mjenv.make(spec, engine="2.2.2").engine == "2.2.2"


def test_every_way_to_choose_for_vectors() -> None:
    envs = mjenv.make_vec("Hopper-v5", 3, engine="4.0")
    expected = play(envs)
    assert expected != play(mjenv.make_vec("Hopper-v5", 3))
    assert expected == play(gymnasium.make_vec("Hopper-v5", 3, vectorization_mode="sync"))
    for other in (
        gymnasium.make_vec("mjenv/Hopper-v5", 3, engine="4.0"),
        gymnasium.make_vec(envs.spec),
        mjenv.make_vec(mjenv.spec("Hopper-v5", engine="4.0"), 3),
        mjenv.make_vec("Hopper-v5", 3, engine="4.0", num_threads=2),
        mjenv.VectorEnv("Hopper-v5", 3, engine="4.0"),
    ):
        assert (other.engine, other.envs[2].engine) == ("4.0", "4.0")
        assert play(other) == expected
    mixed = gymnasium.make_vec("mjenv/Hopper-v5", 3, vectorization_mode="async", engine="4.0")
    assert play(mixed) == expected
    mixed.close()


def test_rows_sent_and_received() -> None:
    envs = [mjenv.make_vec("Hopper-v5", 4, engine="4.0", num_threads=2) for _ in range(2)]
    for env in envs:
        env.reset(seed=2)
    actions = np.full((4, 3), 0.3)
    envs[0].send(actions)
    rows, *received = envs[0].recv()
    assert rows.tolist() == [0, 1, 2, 3]
    for one, other in zip(received[:4], envs[1].step(actions), strict=False):
        check_same("recv", one, other)


def test_a_process_has_its_own_default() -> None:
    text = "import mjenv; env = mjenv.make('Ant-v5'); print(env.engine, mjenv.version().split('MuJoCo ')[1][:3]); "
    text += "print(play(env).hex()); print(mjenv.make('Pusher-v4', engine='2.2.2').engine)"
    expected = {name: play(mjenv.make("Ant-v5", engine=name)).hex() for name in mjenv.engines()}
    for environment, name in (
        ({"MJENV_ENGINE": "4.0"}, "4.0"),
        ({"MJENV_ENGINE": "2.2.2", "MJENV_LIBRARY": str(LIBRARY_4)}, "2.2.2"),
        ({"MJENV_LIBRARY": str(LIBRARY_4)}, "4.0"),
        ({}, "2.2.2"),
    ):
        assert printed(text, **environment) == f"{name} {name[:3]}\n{expected[name]}\n2.2.2\n"


def test_gymnasium_knows_the_ids_on_the_other_default() -> None:
    text = "import mjenv, gymnasium; print(gymnasium.make('mjenv/Ant-v5').unwrapped.engine)"
    assert printed(text, MJENV_ENGINE="4.0") == "4.0\n"


# ---- both in one process, and mujoco beside them ----

ALONE = "import mjenv; print(play(mjenv.make('Ant-v5', engine='{}')).hex())"
TOGETHER = """
one, other = mjenv.make('Ant-v5'), mjenv.make('Ant-v5', engine='4.0')
print(play(one).hex()); print(play(other).hex()); print(play(one).hex())
files = {line.split()[-1] for line in open('/proc/self/maps') if 'libmujoco.so.4' in line}
print(len(files))
"""
PHYSICS = """
import mujoco
model = mujoco.MjModel.from_xml_string('''<mujoco><worldbody><geom type="plane" size="5 5 1"/><body pos="0 0 1">
<freejoint/><geom type="box" size=".1 .2 .3" euler="20 30 40"/></body></worldbody></mujoco>''')
data = mujoco.MjData(model)
mujoco.mj_step(model, data, 500)
assert data.ncon > 0
print(data.qpos.tobytes().hex())
"""


@cache
def printed_alone() -> tuple[str, ...]:
    return tuple(printed(text) for text in (ALONE.format("2.2.2"), ALONE.format("4.0"), PHYSICS))


@pytest.mark.parametrize(
    "flags",
    ["", "import os, sys; sys.setdlopenflags(os.RTLD_NOW | os.RTLD_GLOBAL)\n"],
    ids=["local", "global"],
)
@pytest.mark.parametrize("first", ["mujoco", "mjenv"])
def test_together_each_gives_what_it_gives_alone(first: str, flags: str) -> None:
    old, new, of_mujoco = printed_alone()
    together = "import mjenv\n" + TOGETHER
    text = PHYSICS + together if first == "mujoco" else together + PHYSICS
    # One file: the engine uses the library that the package mujoco uses.
    ours = f"{old}{new}{old}1\n"
    assert printed(flags + text) == (of_mujoco + ours if first == "mujoco" else ours + of_mujoco)


def test_mujoco_is_not_imported() -> None:
    text = "import sys, mjenv; mjenv.make('Ant-v5', engine='4.0'); print('mujoco' in sys.modules)"
    assert printed(text) == "False\n"


def test_named_library(tmp_path: Path) -> None:
    """MJENV_MUJOCO comes before the package."""
    named = shutil.copy(MUJOCO, tmp_path)
    text = "import mjenv; mjenv.make('Ant-v5', engine='4.0')\n"
    text += "print({line.split()[-1] for line in open('/proc/self/maps') if 'libmujoco.so.4' in line})"
    assert printed(text, MJENV_MUJOCO=str(named)) == f"{ {str(named)} }\n"


# ---- copies, pickles and snapshots ----


@pytest.mark.parametrize("make", [mjenv.make, lambda id, **options: mjenv.make_vec(id, 2, **options)])
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_keep_their_engine(make: Any, duplicate: Any) -> None:
    env = make("Hopper-v5", engine="4.0")
    env.reset(seed=3)
    env.step(np.zeros(env.action_space.shape))
    other = duplicate(env)
    assert other.engine == "4.0"
    assert play(other) == play(env)


@pytest.mark.parametrize(("engine", "default"), [("2.2.2", "4.0"), ("4.0", "2.2.2")])
def test_a_pickle_finds_its_engine_in_another_process(engine: str, default: str) -> None:
    with mjenv.make("Ant-v5", engine=engine) as env:
        env.reset(seed=3)
        pickled = pickle.dumps(env)
        expected = env.step(np.full(8, 0.1))[0].tobytes().hex()
    text = f"import pickle, numpy; env = pickle.loads(bytes.fromhex('{pickled.hex()}'))\n"
    text += "print(env.engine, env.step(numpy.full(8, 0.1))[0].tobytes().hex())"
    assert printed(text, MJENV_ENGINE=default) == f"{engine} {expected}\n"


@pytest.mark.parametrize(("ours", "other"), [("2.2.2", "4.0"), ("4.0", "2.2.2")])
def test_the_other_engine_refuses_a_snapshot(ours: str, other: str) -> None:
    env, refusing = mjenv.make("Ant-v5", engine=ours), mjenv.make("Ant-v5", engine=other)
    env.reset(seed=3), refusing.reset(seed=3)
    with pytest.raises(mjenv.SnapshotError, match=f"made on MuJoCo {ours}.*uses MuJoCo {other}.*on MuJoCo {ours}"):
        refusing.restore(env.snapshot())
    assert refusing.step(np.zeros(8))[0].shape == (105,)


# ---- own tasks ----


PLUGIN = ROOT / "build/tests/tasks/libhopper_c.so"


@pytest.mark.parametrize("how", ["before", "after", "variable"])
def test_plugins_on_both(how: str) -> None:
    load = {
        "before": f"mjenv.load_tasks('{PLUGIN.name}'); os.chdir('/')\nmjenv.make('Ant-v5', engine='4.0')",
        "after": f"mjenv.make('Ant-v5', engine='4.0')\nmjenv.load_tasks('{PLUGIN.name}')",
        "variable": "",
    }[how]
    text = f"""
import os, mjenv; os.chdir({str(PLUGIN.parent)!r})
{load}
for engine in mjenv.engines():
    print(play(mjenv.make("OwnHopper-v5", engine=engine)) == play(mjenv.make("Hopper-v5", engine=engine)))
"""
    environment = {"MJENV_TASKS": str(PLUGIN)} if how == "variable" else {}
    assert printed(text, **environment) == "True\nTrue\n"


# ---- what Python itself knows of MuJoCo ----


NEVER_HAD = ("plastic", "qLDiagInv", "J", "J_colind", "J_rowadr", "J_rownnz", "wrapadr", "wrapnum")


def test_every_array_of_objects() -> None:
    """data.body("torso").xpos and all other named access, and the types of the arrays."""
    with verify.quiet():
        theirs: Any = gymnasium.make("Humanoid-v5").unwrapped
    ours = mjenv.make("Humanoid-v5", engine="4.0")
    ours.reset(seed=1), theirs.reset(seed=1)
    ours.step(np.full(17, 0.2)), theirs.step(np.full(17, 0.2))
    compared = 0
    for kind in ("body", "joint", "geom", "camera", "light", "actuator", "tendon", "sensor", "site"):
        if not getattr(ours.model, {"camera": "ncam", "joint": "njnt"}.get(kind, f"n{kind}")):
            continue
        for place in ("model", "data"):
            mine, other = (getattr(getattr(env, place), kind)(0) for env in (ours, theirs))
            for name in dir(other):
                if name.startswith("_") or name in ("id", "name", *NEVER_HAD):
                    continue
                check_same(f"{place}.{kind}.{name}", getattr(mine, name), np.array(getattr(other, name)))
                compared += 1
    assert compared > 100
    for name in ("jnt_limited", "actuator_ctrllimited", "body_simple", "geom_sameframe", "light_castshadow"):
        check_same(name, getattr(ours.model, name), np.array(getattr(theirs.model, name)))


@pytest.mark.parametrize("flag", ["mjVIS_CONTACTPOINT", "mjVIS_CONTACTFORCE", "mjVIS_JOINT", "mjVIS_INERTIA"])
def test_flags_of_pictures(flag: str) -> None:
    """visual_options has MuJoCo's numbers, which differ between 2.2.2 and 4.0."""
    flags = {int(getattr(mujoco.mjtVisFlag, flag)): True}
    keywords: Any = {"render_mode": "rgb_array", "width": 160, "height": 160}
    envs = (
        gymnasium.make("Ant-v5", **keywords, visual_options=flags),
        mjenv.make("Ant-v5", engine="4.0", **keywords, visual_options=flags),
        mjenv.make("Ant-v5", engine="4.0", **keywords),
    )
    for env in envs:
        env.reset(seed=1)
        for _ in range(40):
            env.step(np.zeros(8, np.float32))
    theirs, ours, plain = (env.render() for env in envs)
    assert (ours != plain).any()
    check_same("picture", ours, theirs)


def test_flags_that_are_not_drawn() -> None:
    for flag in (15, 24, -1):
        with mjenv.make("Ant-v5", engine="4.0", render_mode="rgb_array", visual_options={flag: True}) as env:
            env.reset(seed=1)
            with pytest.raises(KeyError, match=f"flag {flag}"):
                env.render()


# ---- the command line ----


DELAYED = """
<mujoco><worldbody><body><joint name="hinge" axis="0 1 0"/><geom size=".1" pos="0 0 .5"/></body></worldbody>
<actuator><position joint="hinge" kp="2" delay=".006" nsample="4"/></actuator></mujoco>
"""


def test_a_relative_path_of_a_library() -> None:
    text = f"import os; os.chdir({str(LIBRARY.parent)!r}); import mjenv; os.chdir('/'); print(mjenv.engines())"
    assert printed(text, MJENV_LIBRARY=f"./{LIBRARY.name}") == "('2.2.2', '4.0')\n"


# ---- bad input ----


def test_an_engine_of_another_type() -> None:
    for engine in (4.0, 4, Path("4.0"), b"4.0", ["4.0"]):
        with pytest.raises(mjenv.OptionError, match=r"engine is a str, '4\.0' for example"):
            mjenv.make("Ant-v5", engine=engine)


def test_an_unknown_default() -> None:
    assert "EngineError: there is no engine '5.0'; there are 2.2.2, 4.0" in error_of("import mjenv", MJENV_ENGINE="5.0")


def test_misspelt() -> None:
    with pytest.raises(mjenv.OptionError, match="Did you mean 'engine'"):
        mjenv.make("Ant-v5", engin="4.0")


@pytest.fixture(scope="session")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with both libraries, which do not know where MuJoCo was when they were built."""
    folder = tmp_path_factory.mktemp("alone")
    shutil.copy(LIBRARY, folder / LIBRARY.name)
    content = LIBRARY_4.read_bytes()
    dynamic = subprocess.run(["readelf", "--dynamic", "--wide", LIBRARY_4], capture_output=True, text=True, check=True)
    paths = [line.split("[")[1].rstrip("]") for line in dynamic.stdout.splitlines() if "PATH)" in line]
    for path in paths:
        content = content.replace(path.encode(), b"/nowhere".ljust(len(path), b"\0"))
    (folder / LIBRARY_4.name).write_bytes(content)
    return folder


MAKE = "import mjenv; print(mjenv.engines()); mjenv.make('Ant-v5', engine='4.0')"
WITHOUT_PACKAGE = "import sys; sys.modules['mujoco'] = None\n"


def test_no_mujoco(alone: Path) -> None:
    library = str(alone / LIBRARY.name)
    told = error_of(WITHOUT_PACKAGE + MAKE, MJENV_LIBRARY=library)
    assert told.startswith(
        "mjenv.errors.EngineError: engine 4.0: there is no library of MuJoCo 4.0; install MuJoCo 4.0"
    )
    assert "pip install 'mujoco-core>=4.0,<4.1'" in told
    assert "MJENV_MUJOCO" in told
    run = python(WITHOUT_PACKAGE + MAKE, MJENV_LIBRARY=library)
    assert run.stdout == "('2.2.2',)\n"


def test_mujoco_that_comes_later(alone: Path) -> None:
    """An engine that could not be used can be used as soon as MuJoCo is there; tasks are registered then."""
    text = f"""
import ctypes, os, sys; sys.modules['mujoco'] = None
import mjenv
class Own(mjenv.Task):
    model, observation_fields = "hopper.xml", {{"x": 1}}
    reset = observe = step = ctypes.CFUNCTYPE(ctypes.c_int32)(lambda: 0)
mjenv.register("Own-v0", Own)
try:
    mjenv.make("Own-v0", engine="4.0")
except mjenv.EngineError:
    os.environ["MJENV_MUJOCO"] = {str(MUJOCO)!r}
print(mjenv.make("Own-v0", engine="4.0").engine)
"""
    assert printed(text, MJENV_LIBRARY=str(alone / LIBRARY.name)) == "4.0\n"


def test_mujoco_of_the_system(alone: Path) -> None:
    folder = str(MUJOCO.parent)
    assert printed(WITHOUT_PACKAGE + MAKE, MJENV_LIBRARY=str(alone / LIBRARY.name), LD_LIBRARY_PATH=folder)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot open shared object file"),
        (b"", "file too short"),
        (b"not a library" * 100, "invalid ELF header"),
        (MUJOCO.read_bytes()[:100_000], "it is damaged: it ends before what its headers describe"),
    ],
    ids=["missing", "empty", "text", "cut off"],
)
def test_a_broken_mujoco(content: bytes | None, message: str, tmp_path: Path) -> None:
    """The one that MJENV_MUJOCO names, and the one in the package."""
    package = tmp_path / "mujoco"
    package.mkdir()
    named = package / "libmujoco.so.4.0.0"
    if content is not None:
        named.write_bytes(content)
    told = error_of(MAKE, MJENV_MUJOCO=str(named))
    assert message in told
    assert "EngineError: engine 4.0: MJENV_MUJOCO: " in told
    assert "pip install 'mujoco-core>=4.0,<4.1'" in told
    if content is not None:
        (package / "__init__.py").touch()
        told = error_of(f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{MAKE}")
        assert f"EngineError: cannot load {named}: " in told
        assert message in told
        assert "pip install --force-reinstall mujoco-core" in told


def test_another_version_of_mujoco(tmp_path: Path) -> None:
    """A library that says that it is MuJoCo 3.3.7."""
    source = 'int mj_version(void) { return 3003007; } const char* mj_versionString(void) { return "3.3.7"; }'
    named = tmp_path / "libmujoco.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", named], input=source, text=True, check=True)
    told = error_of(MAKE, MJENV_MUJOCO=str(named))
    assert "MuJoCo's library is 3.3.7, and this mjenv is for MuJoCo 4.0" in told
    assert "pip install 'mujoco-core>=4.0,<4.1'" in told


def test_an_installation_without_the_engine(tmp_path: Path) -> None:
    library = shutil.copy(LIBRARY, tmp_path)
    told = error_of(MAKE, MJENV_LIBRARY=str(library))
    assert "EngineError: this installation has no engine 4.0, which is " in told
    assert "pip install" in told
    assert "MJENV_LIBRARY" in told


def test_a_library_under_another_name(tmp_path: Path) -> None:
    library = shutil.copy(LIBRARY, tmp_path)
    shutil.copy(LIBRARY, tmp_path / LIBRARY_4.name)
    assert f"{tmp_path / LIBRARY_4.name} is engine 2.2.2, not 4.0" in error_of(MAKE, MJENV_LIBRARY=str(library))


def test_a_plugin_that_has_gone(tmp_path: Path) -> None:
    """What cannot be registered in an engine that is loaded later is reported, every time."""
    plugin = shutil.copy(PLUGIN, tmp_path)
    text = f"""
import os, mjenv
mjenv.load_tasks({str(plugin)!r}); os.remove({str(plugin)!r})
for _ in range(2):
    try:
        mjenv.make("Ant-v5", engine="4.0")
    except mjenv.TaskError as error:
        print(error)
"""
    assert printed(text) == 2 * f'plug-in "{plugin}": No such file or directory\n'
