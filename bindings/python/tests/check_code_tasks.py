"""Tasks in machine code. tests/run gives these tests a process of their own, because a task stays registered."""

import ctypes
import gc
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np
import pytest

import mjenv
from interrupts import interrupted_before
from mjenv.capi import handle, task_declarations
from mjenv.capi.engine import ENGINES, Engines
from mjenv.task import Field
from mjenv.task.registered import Registered
from tasks_of_python import NumpyHopper, flat

INCLUDE = Path(__file__).resolve().parents[3] / "capi" / "include"
PENDULUM = """<mujoco><worldbody><body name="pole"><joint name="hinge" type="hinge" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.05"/></body></worldbody>
<actuator><motor joint="hinge" ctrllimited="true" ctrlrange="-1 1"/></actuator></mujoco>"""

CODE = """
#include <mjenv/task.h>
int32_t reset(const double *self, mjenv_start *start) {
  start->qpos[0] = mjenv_random_uniform(start->random, -self[0], self[0]);
  start->carried[1] = start->carry_count;
  return 0;
}
int32_t observe(const double *self, const mjenv_sim *sim, double *observation) {
  observation[0] = sim->qpos[0], observation[1] = sim->qvel[0], observation[2] = sim->carried[1];
  return 0;
}
int32_t step(const double *self, const mjenv_sim *sim, mjenv_outcome *outcome) {
  if (sim->action[0] > 0.9) return mjenv_task_fail(sim->api, "too strong");
  outcome->reward = self[0] + sim->action[0], outcome->carried[1] += 1;
  outcome->info[0] = sim->geom_xpos[2], outcome->terminated = sim->qpos[0] > self[1];
  return 0;
}
"""

SIZES = r"""
#include <mjenv/task.h>
#include <stdio.h>
#define SHOW(type, last) printf(#type " %zu %zu\n", sizeof(type), offsetof(type, last))
int main(void) {
  SHOW(mjenv_task_option, reserved); SHOW(mjenv_task_field, group); SHOW(mjenv_task_camera, elevation);
  SHOW(mjenv_sim, reserved2); SHOW(mjenv_start, own); SHOW(mjenv_outcome, qvel); SHOW(mjenv_control, qvel);
  SHOW(mjenv_task_api, control_forward); SHOW(mjenv_builder, task); SHOW(mjenv_task, compute_reward);
}
"""


def compiled(folder: Path, source: str, *options: str) -> Path:
    (folder / "code.c").write_text(source)
    made = folder / "code.so"
    subprocess.run(["cc", "-I", INCLUDE, *options, "-o", made, folder / "code.c"], check=True)
    return made


LIBRARY = ctypes.CDLL(str(compiled(Path(tempfile.mkdtemp()), CODE, "-shared", "-fPIC")))


def changed(**attributes: Any) -> type[mjenv.Task]:
    return type("Changed", (Coded,), attributes)


def test_structs_are_those_of_the_header(tmp_path: Path) -> None:
    shown = subprocess.run([compiled(tmp_path, SIZES)], check=True, capture_output=True, text=True).stdout
    assert len(shown.splitlines()) == 10
    for line in shown.splitlines():
        name, size, offset = line.split()
        struct = getattr(task_declarations, name)
        assert (ctypes.sizeof(struct), getattr(struct, struct._fields_[-1][0]).offset) == (int(size), int(offset)), name


class Coded(mjenv.Task):
    model = PENDULUM
    options = {"spread": 0.25}  # noqa: RUF012
    needs = ("geom_xpos",)
    state = {"a": (), "b": ()}  # noqa: RUF012
    observation_fields = {"all": 3}  # noqa: RUF012
    info_fields = {"height": Field(doc="of the geom, m")}  # noqa: RUF012
    reset, observe, step = LIBRARY.reset, LIBRARY.observe, LIBRARY.step

    def build(self, model: Any) -> Any:
        assert model.index("body", "pole") == 1
        return [self.spread, 0.1]  # type: ignore[attr-defined]


mjenv.register("Coded-v0", Coded)


def test_functions_of_a_shared_object() -> None:
    gc.collect()
    envs = mjenv.make_vec("Coded-v0", 4, num_threads=2, spread=0.5)
    obs, _ = envs.reset(seed=1)
    drawn = [np.random.default_rng(1 + row).uniform(-0.5, 0.5) for row in range(4)]
    np.testing.assert_array_equal(obs[:, 0], drawn)
    np.testing.assert_array_equal(obs[:, 2], 2)
    image = envs.snapshot()
    first = envs.step(np.full((4, 1), 0.5))
    np.testing.assert_array_equal(first[1], 1.0)
    np.testing.assert_array_equal(first[0][:, 2], 3)
    np.testing.assert_array_equal(first[2], first[0][:, 0] > 0.1)
    assert (first[4]["height"] < 0).all()
    envs.restore(image)
    assert flat(envs.step(np.full((4, 1), 0.5))) == flat(first)
    with pytest.raises(mjenv.TaskError, match="too strong"):
        envs.step(np.ones((4, 1)))

    class Bounded(Coded):
        state_bounds = {"b": (0, 2)}  # noqa: RUF012

    mjenv.register("BoundedCode-v0", Bounded)
    bounded = mjenv.make_vec("BoundedCode-v0", 1)
    bounded.reset(seed=1)
    with pytest.raises(mjenv.TaskError, match=r"step: carried\[1\] is 3, not 0 to 2"):
        bounded.step(np.zeros((1, 1)))

    class Refused(Coded):
        def build(self, model: Any) -> Any:
            return [model.index("body", "leg")]

    mjenv.register("Refused-v0", Refused)
    with pytest.raises(mjenv.ModelError, match="leg"):
        mjenv.make_vec("Refused-v0", 1)


@pytest.mark.parametrize(
    ("id", "task", "error", "message"),
    [
        ("Coded-v0", Coded, mjenv.InvalidValueError, "already registered"),
        ("Ant-v5", Coded, mjenv.InvalidValueError, "built-in"),
        ("New-v0", Coded(), mjenv.OptionError, "a class derived from mjenv.Task"),
        ("New-v0", changed(reset=None), mjenv.OptionError, "does not define reset"),
        ("New-v0", changed(needs="qpos"), mjenv.OptionError, "needs is a sequence of names, not 'qpos'"),
        ("New-v0", changed(frame_skip=0), mjenv.InvalidValueError, "frame_skip is 0"),
        ("New-v0", changed(carry=lambda self, sim: None), mjenv.OptionError, "so carry must be, too"),
        ("New-v0", changed(reset_row=lambda self, start: {}), mjenv.OptionError, "so reset_row must be, too"),
    ],
)
def test_bad_tasks(id: str, task: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        mjenv.register(id, task)
    assert "New-v0" not in mjenv.ids()


def test_what_computes_numpy_tasks_is_a_program_beside_the_wrapper() -> None:
    with pytest.raises(mjenv.OptionError, match=r"NumpyHopper has no machine code, .* is not installed"):
        mjenv.register("New-v0", NumpyHopper)
    assert "New-v0" not in mjenv.ids()
    with pytest.raises(AttributeError, match="has no attribute 'Sim'"):
        mjenv.task.Sim  # noqa: B018


# ---- Interrupts ----


def builds_a_task(code: CodeType) -> bool:
    names = ("create", "_build_environment", "prepare", "describe", "open")
    return code.co_name in names and code.co_filename == mjenv.task.registered.__file__


def test_an_interrupt_of_a_build_is_a_keyboard_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)  # ctypes reports what leaves a callback
    instruction = 0
    while interrupted_before(lambda: mjenv.make_vec("Coded-v0", 2), instruction, builds_a_task):
        instruction += 1
    assert instruction > 200
    with closing(mjenv.make_vec("Coded-v0", 2)) as envs:
        envs.reset(seed=1)


def tells_engines(code: CodeType) -> bool:
    files = mjenv.capi.engine.__file__, mjenv.task.registered.__file__, mjenv.registration.__file__
    return code.co_filename in files and code.co_name in ("get", "_load", "register", "_register", "registration")


def test_an_interrupt_of_a_registration_leaves_nothing_half_made() -> None:
    """The task has its id and works, or it can be registered again; no thread waits for ever."""
    instruction = 0
    while True:
        id = f"Interrupted-v{instruction}"
        kind = type("Copied", (Coded,), {})
        if not interrupted_before(lambda id=id, kind=kind: mjenv.register(id, kind), instruction, tells_engines):
            break
        gc.collect()
        with ThreadPoolExecutor(1) as thread:
            thread.submit(ENGINES.register, lambda engine: None).result(timeout=60)
        if id not in mjenv.ids():
            mjenv.register(id, kind)
        with closing(mjenv.make_vec(id, 1)) as envs, closing(mjenv.make_vec("Coded-v0", 1)) as others:
            assert flat(envs.reset(seed=1)) == flat(others.reset(seed=1))
            assert flat(envs.step(np.full((1, 1), 0.5))) == flat(others.step(np.full((1, 1), 0.5)))
        instruction += 1
    assert instruction > 100


def test_an_interrupt_while_an_engine_is_loaded() -> None:
    instruction = 0
    while True:
        engines, id = Engines(), f"Loaded-v{instruction}"
        engines.register(Registered(id, Coded).register)
        if not interrupted_before(engines.get, instruction, tells_engines):
            break
        assert id in handle.ids(engines.get())
        instruction += 1
    assert instruction > 50


def test_a_registration_that_fails_changes_nothing() -> None:
    """Also where an interrupt comes when it has failed: then an engine tells once, and works from then on."""
    with pytest.raises(mjenv.InvalidValueError, match="built-in"):
        mjenv.register("Hopper-v5", Coded)
    failed = instruction = 0
    while interrupted_before(lambda: refuse("Hopper-v5"), instruction, tells_engines):
        try:
            ENGINES.get()
        except mjenv.InvalidValueError:
            failed += 1
        assert isinstance(mjenv.make("Hopper-v5").unwrapped, mjenv.Environment)
        instruction += 1
    assert failed > 0


def refuse(id: str) -> None:
    with suppress(mjenv.InvalidValueError):
        mjenv.register(id, Coded)
