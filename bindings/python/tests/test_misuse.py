"""What programs do to environments by accident: threads, garbage in any order, forks, the end of the process."""

import gc
import importlib.util
import multiprocessing
import os
import pickle
import random
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from contextlib import closing, suppress
from types import CodeType
from typing import Any

import numpy as np
import pytest

import mjenv
from interrupts import interrupted_before
from mjenv.capi.engine import ENGINES
from mjenv.capi.handle import Changing, Rows
from mjenv.capi.turns import Turns
from systems import needs_alarms, needs_fork, needs_signals

# ---- Threads ----


def test_the_interpreter_goes_on_while_a_step_runs() -> None:
    with closing(mjenv.make_vec("HumanoidStandup-v5", num_envs=64)) as envs:
        envs.reset(seed=1)
        actions = np.zeros((64, 100, 17), np.float32)
        thread = threading.Thread(target=envs.rollout, args=(actions,))
        thread.start()
        turns = 0
        while thread.is_alive():
            turns += 1
        thread.join()
    # Without the lock this thread would not have had a turn before the end.
    assert turns > 1000


def test_threads_of_their_own() -> None:
    """As many bits are equal as in one thread."""

    def play(results: list[Any], i: int) -> None:
        with mjenv.make("Hopper-v5") as env:
            obs, _ = env.reset(seed=i % 2)
            total = obs.sum()
            for _ in range(200):
                obs, reward, ended, _, _ = env.step(np.full(3, 0.1, np.float32))
                total += obs.sum() + reward
                if ended:
                    obs, _ = env.reset(seed=i % 2)
            results[i] = total

    results: list[Any] = [None] * 6
    threads = [threading.Thread(target=play, args=(results, i)) for i in range(len(results))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results[0] == results[2] == results[4]
    assert results[1] == results[3] == results[5]


def test_closed_under_a_thread() -> None:
    """A thread that steps gets an exception once another has closed the environment."""
    env = mjenv.make_vec("Reacher-v5", num_envs=8)
    env.reset(seed=1)
    raised: list[Exception] = []
    started = threading.Event()

    def step() -> None:
        action = np.zeros(env.action_space.shape, np.float32)
        while True:
            time.sleep(0.0005)  # or close would hardly ever find the environment free
            try:
                env.step(action)
            except mjenv.BusyError:
                continue
            except mjenv.Error as error:
                raised.append(error)
                return
            finally:
                started.set()

    thread = threading.Thread(target=step)
    thread.start()
    started.wait()
    while True:
        try:
            env.close()
            break
        except mjenv.BusyError:
            continue
    thread.join()
    assert isinstance(raised[0], mjenv.ClosedError)


# ---- Interrupts ----


def interrupted(use: Callable[[], Any], mend: Callable[[], Any]) -> None:
    """Interrupts uses at moments of all kinds; afterwards the environment works."""

    came = False

    def interrupt(*_: Any) -> None:
        nonlocal came
        came = True
        raise KeyboardInterrupt

    rng = random.Random(3)
    gc.collect()  # pytest reports an interrupt that comes while Python finalizes the garbage of earlier tests
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        for _ in range(1500):
            came = False
            with suppress(KeyboardInterrupt):
                signal.setitimer(signal.ITIMER_REAL, rng.uniform(2e-5, 2e-4))
                # Python drops an exception of a finalizer, so an interrupt that comes within one does not end a use.
                while not came:
                    use()
            mend()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@needs_alarms
def test_an_interrupted_environment_works() -> None:
    with mjenv.make("InvertedPendulum-v5", strict=False) as env:
        env.reset(seed=1)
        interrupted(lambda: env.step(np.zeros(1, np.float32)), lambda: env.reset(seed=1))
        interrupted(lambda: env.data.qpos, lambda: env.step(np.zeros(1)))


@needs_alarms
def test_an_interrupted_vector_environment_works() -> None:
    with closing(mjenv.make_vec("InvertedPendulum-v5", num_envs=2)) as envs:
        envs.reset(seed=1)
        actions = np.zeros((2, 1), np.float32)
        interrupted(lambda: envs.step(actions), lambda: envs.reset(seed=1))


@needs_alarms
def test_interrupted_between_send_and_recv() -> None:
    """Rows are under way or they are not, and the environment knows."""
    with closing(mjenv.make_vec("InvertedPendulum-v5", num_envs=2)) as envs:
        envs.reset(seed=1)
        actions = np.zeros((2, 1), np.float32)

        def use() -> None:
            envs.send(actions)
            envs.recv()

        def mend() -> None:
            with suppress(mjenv.NoAsyncCallError):
                envs.recv()
            envs.reset(seed=1)

        interrupted(use, mend)


def takes_a_turn(code: CodeType) -> bool:
    functions = Rows.enter, Turns.take, Changing.__enter__, Changing.__exit__
    return "turn" in code.co_varnames or code in [function.__code__ for function in functions]


def test_interrupted_before_every_instruction() -> None:
    """Whichever instructions a version of Python lets interrupts come before, the environment is free afterwards."""
    with mjenv.make("InvertedPendulum-v5", strict=False) as env:
        action = np.zeros(1, np.float32)
        for use in (lambda: env.step(action), env.reset, lambda: env.data.qpos):
            env.reset(seed=1)
            instruction = 0
            while interrupted_before(use, instruction, takes_a_turn):
                assert env.step(action)[0].shape == (4,)
                instruction += 1
            assert instruction > 20


def test_interrupted_while_an_earlier_exception_is_kept() -> None:
    """A kept exception keeps the variables of the function that had the turn, but not the turn."""
    with mjenv.make("InvertedPendulum-v5") as env:
        env.reset(seed=1)
        with pytest.raises(mjenv.Error) as kept:
            env.step(np.array([np.inf]))
        assert any("turn" in frame.frame.f_locals for frame in kept.traceback)
        instruction = 0
        while interrupted_before(env.reset, instruction, {Rows.enter.__code__, Turns.take.__code__}.__contains__):
            assert env.step(np.zeros(1))[0].shape == (4,)
            instruction += 1
        assert instruction > 5


@pytest.fixture
def handles(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The environments and options that exist."""
    engine, found = ENGINES.get(), set[int]()

    def count(create: str, destroy: str) -> None:
        creates, destroys = getattr(engine, create), getattr(engine, destroy)

        def counted_create(*arguments: Any) -> int:
            status: int = creates(*arguments)
            if not status:
                found.add(arguments[-1]._obj.value)
            return status

        def counted_destroy(handle: Any) -> None:
            found.discard(getattr(handle, "value", handle))
            destroys(handle)

        monkeypatch.setattr(engine, create, counted_create)
        monkeypatch.setattr(engine, destroy, counted_destroy)

    count("mjenv_create", "mjenv_destroy")
    count("mjenv_options_create", "mjenv_options_destroy")
    return found


def makes_an_environment(code: CodeType) -> bool:
    return code.co_name in ("__init__", "_prepare", "_restored") and code.co_filename in (
        module.__file__ for module in (mjenv.capi.handle, mjenv.rows.pool, mjenv.gym.env, mjenv.gym.vector)
    )


@pytest.mark.parametrize("way", ["make", "make_vec", "unpickle"])
def test_an_interrupted_make_leaves_nothing(handles: set[int], way: str) -> None:
    id = "InvertedPendulum-v5"
    with closing(mjenv.make_vec(id, 2)) as envs:
        image = pickle.dumps(envs)
    del envs
    ways: dict[str, Callable[[], Any]] = {
        "make": lambda: mjenv.make(id),
        "make_vec": lambda: mjenv.make_vec(id, 2),
        "unpickle": lambda: pickle.loads(image),
    }
    instruction = 0
    while interrupted_before(ways[way], instruction, makes_an_environment):
        if handles:
            gc.collect()
        assert not handles, instruction
        instruction += 1
    assert instruction > 300


# ---- Garbage ----


def test_garbage_in_any_order() -> None:
    """Environments, their data, spaces, bound methods and cycles of them, dropped one by one in random order."""
    rng = random.Random(7)
    gone = []
    for _ in range(30):
        env, envs = mjenv.make("Hopper-v5"), mjenv.make_vec("Reacher-v5", num_envs=3, num_threads=2)
        obs, _ = env.reset(seed=1)
        gone += [weakref.ref(env), weakref.ref(envs)]
        cycle: dict[str, Any] = {"env": env, "envs": envs}
        cycle["self"] = cycle
        held = [env, envs, env.data, env.model, env.action_space, env.step, obs, envs.reset(seed=1), cycle]
        del env, envs, obs, cycle
        rng.shuffle(held)
        while held:
            held.pop()
            if rng.random() < 0.3:
                gc.collect(rng.randrange(3))
    gc.collect()
    assert [ref for ref in gone if ref() is not None] == []


def test_data_outlives_the_environment() -> None:
    env = mjenv.make("Hopper-v5")
    env.reset(seed=1)
    qpos, data = env.data.qpos, env.data
    kept = qpos.copy()
    env.close()
    del env
    gc.collect()
    assert (qpos == kept).all()
    with pytest.raises(mjenv.ClosedError):
        _ = data.qvel


def test_dropped_while_rows_are_under_way_and_a_thread_reads() -> None:
    """The handle is freed when the thread that is inside has dropped it."""
    envs = mjenv.make_vec("HumanoidStandup-v5", num_envs=64, num_threads=2)
    envs.reset(seed=1)
    rows = envs._pool.rows
    gone = weakref.ref(rows)
    envs.send(np.zeros((64, 17), np.float32))
    turn = rows.enter()  # as a thread is that reads envs.envs[0].data
    try:
        del envs
        gc.collect()
        assert not rows.closed
    finally:
        rows.leave(turn)
    del rows
    gc.collect()
    assert gone() is None


def test_collected_in_a_callback_of_the_collector() -> None:
    made = []

    def during(phase: str, info: dict[str, int]) -> None:
        if phase == "start" and len(made) < 20:
            made.append(mjenv.make("InvertedPendulum-v5").reset(seed=3)[0])

    gc.callbacks.append(during)
    try:
        for _ in range(20):
            gc.collect()
    finally:
        gc.callbacks.remove(during)
    assert len(made) == 20
    assert all((obs == made[0]).all() for obs in made)


# ---- The end of the process ----

ENDINGS = {
    "a global": "env = mjenv.make('Hopper-v5'); env.reset(seed=1)",
    "a cycle": "env = mjenv.make('Hopper-v5'); env.me = env; env.reset(seed=1)",
    "a vector with threads": "envs = mjenv.make_vec('Ant-v5', num_envs=4, num_threads=2); envs.reset(seed=1)",
    "used at exit": """
import atexit
env = mjenv.make('Hopper-v5')
atexit.register(lambda: env.reset(seed=1))""",
    "rows under way while data is read": """
import numpy
envs = mjenv.make_vec('HumanoidStandup-v5', num_envs=64, num_threads=2)
envs.reset(seed=1)
data, rows = envs.envs[0].data, envs._pool.rows
envs.send(numpy.zeros((64, 17)))
turn = rows.enter()
del envs
rows.leave(turn)""",
    "closed at exit": """
import atexit
env = mjenv.make('Hopper-v5')
atexit.register(env.close)
env.reset(seed=1)""",
    "used by an object's end": """
class Holder:
    def __init__(self): self.env = mjenv.make('Hopper-v5')
    def __del__(self): self.env.reset(seed=1); self.env.close()
holder = Holder()""",
    "in the modules": "sys.modules['kept'] = mjenv.make_vec('Reacher-v5', num_envs=2, num_threads=2)",
    "a daemon thread inside": """
import threading, time
envs = mjenv.make_vec('HumanoidStandup-v5', num_envs=32, num_threads=2)
envs.reset(seed=1)
def run():
    while True: envs.step(envs.action_space.sample())
threading.Thread(target=run, daemon=True).start()
time.sleep(0.2)""",
    "an exception": "env = mjenv.make('Hopper-v5'); env.reset(seed=1); sys.exit(0)",
    "interrupted": """
import os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
env = mjenv.make('Hopper-v5')
env.reset(seed=1)
try:
    os.kill(os.getpid(), signal.SIGINT)
    while True: env.reset()
except KeyboardInterrupt:
    pass
env.reset(seed=2)""",
}


def run(text: str, *options: str) -> str:
    """What a Python program says; it has to end well."""
    command = [sys.executable, *options, "-c", f"import sys, mjenv\n{text}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.mark.parametrize(
    "ending",
    [pytest.param(name, marks=needs_signals) if name == "interrupted" else name for name in ENDINGS],
)
def test_the_end_of_the_process(ending: str) -> None:
    assert run(ENDINGS[ending]) == ""


# ---- Processes ----


def _play(env: Any) -> Any:
    return [env.step(np.full(3, 0.1, np.float32))[0] for _ in range(20)]


def _work(env: Any, pipe: Any) -> None:
    pipe.send(_play(env))
    pipe.close()


@pytest.mark.parametrize(
    "method", [pytest.param("fork", marks=needs_fork), "spawn", pytest.param("forkserver", marks=needs_fork)]
)
def test_multiprocessing(method: str) -> None:
    """An environment goes on in another process, bit for bit, and stays as it was in this one."""
    context = multiprocessing.get_context(method)
    with mjenv.make("Hopper-v5") as env:
        env.reset(seed=3)
        here, there = context.Pipe()
        process = context.Process(target=_work, args=(env, there))
        process.start()
        there.close()
        seen = here.recv()
        process.join(60)
        assert process.exitcode == 0
        np.testing.assert_array_equal(seen, _play(env))


@pytest.mark.parametrize("method", [pytest.param("fork", marks=needs_fork), "spawn"])
def test_a_pool_of_processes(method: str) -> None:
    with multiprocessing.get_context(method).Pool(2) as pool, mjenv.make("Hopper-v5") as env:
        env.reset(seed=3)
        results = pool.map(_play, [env] * 4)
        for result in results:
            np.testing.assert_array_equal(result, results[0])


@needs_fork
def test_a_child_drops_what_its_parent_made() -> None:
    env, envs = mjenv.make("Hopper-v5"), mjenv.make_vec("Reacher-v5", num_envs=4, num_threads=2)
    envs.reset(seed=1)
    pid = os.fork()
    if pid == 0:
        fine = False
        try:
            try:
                envs.step(np.zeros((4, 2), np.float32))
            except mjenv.ForkedError:
                fine = True
            del env, envs
            gc.collect()
            with closing(mjenv.make_vec("Reacher-v5", num_envs=4, num_threads=2)) as own:
                own.reset(seed=1)
        finally:
            os._exit(0 if fine else 1)
    assert os.waitpid(pid, 0)[1] == 0
    envs.step(np.zeros((4, 2), np.float32))
    envs.close()
    env.close()


# ---- Interpreters in an interpreter ----

INTERPRETERS = next((name for name in ("_interpreters", "_xxsubinterpreters") if importlib.util.find_spec(name)), "")


@pytest.mark.skipif(not INTERPRETERS, reason="this Python has no subinterpreters")
def test_subinterpreters() -> None:
    """NumPy refuses some kinds of them with an ImportError; where it does not, environments work. Nothing crashes.

    In Python 3.10 and 3.11 each of them, by importing ctypes, gives ctypes.POINTER other types in this interpreter.
    """
    said = run(
        f"""
import {INTERPRETERS} as interpreters
import ctypes
import os
import numpy as np

does_nothing = ctypes.CFUNCTYPE(ctypes.c_int32)(lambda: 0)

class Slider(mjenv.Task):
    model = '''<mujoco><worldbody><body><joint name="x" type="slide"/><geom size=".1"/></body></worldbody>
      <actuator><motor joint="x"/></actuator></mujoco>'''
    camera = {{"distance": 2.0}}
    observation_fields = {{"x": 1}}
    reset = observe = step = does_nothing

def use(version):
    envs = mjenv.make_vec("Reacher-v5", 2, randomize={{"body_mass": mjenv.Scale(0.5, 1.5)}}, history=2)
    envs.reset(seed=3)
    envs.step(envs.action_space.sample())
    envs.copy_row(0, np.array([False, True]))
    envs.restore(envs.snapshot())
    mjenv.register("Slider-v%d" % version, Slider)
    mjenv.make("Slider-v%d" % version).reset(seed=3)

use(0)
env = mjenv.make("Reacher-v5")
first, _ = env.reset(seed=3)
read, write = os.pipe()
text = '''
import os
try:
    import warnings
    warnings.simplefilter("ignore")
    import mjenv
    said = mjenv.make("Reacher-v5").reset(seed=3)[0].tobytes()
except ImportError:
    said = b"refused"
os.write(%d, said)
''' % write
for version in (1, 2, 3):
    inner = interpreters.create()
    interpreters.run_string(inner, text)
    said = os.read(read, 4096)
    interpreters.destroy(inner)
    print("refused" if said == b"refused" else "works" if said == first.tobytes() else said)
    use(version)
assert (env.reset(seed=3)[0] == first).all()"""
    )
    assert set(said.split()) <= {"refused", "works"}
    assert len(said.split()) == 3
