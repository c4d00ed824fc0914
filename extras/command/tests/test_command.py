"""The command line: python -m mjenv."""

import json
import os
import platform
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import mjenv
from mjenv.beside import listed
from mjenv.capi.declarations import Role
from mjenv.capi.engine import FILES
from mjenv_command import arguments, bench, main, modules_for, parser, snapshots
from systems import WINDOWS, needs_bash, needs_terminal, not_on_windows
from test_schema import SCHEMA

MATH, PLATFORM = ("portable", "win-") if WINDOWS else ("system", "linux-")


def run(*words: str | Path) -> int:
    return main([str(word) for word in words])


def output(capsys: pytest.CaptureFixture[str], *words: str | Path, status: int = 0) -> Any:
    """What a command prints with --json."""
    assert run(*words, "--json") == status
    return json.loads(capsys.readouterr().out)


def refusal(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    """What a command says that cannot do what it is asked for."""
    try:
        status = run(*words)
    except SystemExit as end:
        status = int(end.code or 0)
    assert status == 2
    return capsys.readouterr().err


def lanes() -> list[int]:
    """The numbers of lanes that this CPU can do, by the instructions that it has; Wine shows Linux' files."""
    if platform.machine() == "aarch64":
        return [2]
    flags = Path("/proc/cpuinfo").read_text().split()
    needs = {2: {"sse2"}, 4: {"avx2"}, 8: {"avx512f", "avx512dq"}}
    return [width for width, instructions in needs.items() if instructions.issubset(flags)]


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    found = {entry["id"]: entry for entry in output(capsys, "list")}
    assert sorted(found) == sorted(SCHEMA)
    for id, entry in found.items():
        spec = gymnasium.spec(id)
        assert entry["max_episode_steps"] == spec.max_episode_steps
        assert entry["reward_threshold"] == (None if np.isnan(spec.reward_threshold or 0) else spec.reward_threshold)
    assert (found["Ant-v5"]["observation"], found["Ant-v5"]["action"], found["Ant-v5"]["dt"]) == (105, 8, 0.05)


def test_list_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("list") == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.split()[:3] == ["id", "observation", "action"]
    assert "Reacher-v5 10 2 0.02 50 -3.75".split() in [line.split() for line in lines]


@pytest.mark.parametrize("id", SCHEMA)
def test_info(id: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What make gives, and Gymnasium's options in its order."""
    found = output(capsys, "info", id)
    with mjenv.make(id) as env:
        for name, space in (("observation", env.observation_space), ("action", env.action_space)):
            assert tuple(found["spaces"][name]["shape"]) == space.shape
            assert found["spaces"][name]["dtype"] == space.dtype
            bounds = [[float(x) for x in found["spaces"][name][side]] for side in ("low", "high")]
            assert np.array_equal(np.array(bounds).astype(space.dtype), [space.low, space.high])
            sizes = [int(np.prod(field["shape"])) for field in found[name]]
            assert sum(sizes) == space.shape[0]
            assert [field["offset"] for field in found[name]] == [sum(sizes[:i]) for i in range(len(sizes))]
        _, reset_info = env.reset(seed=0)
        *_, info = env.step(np.zeros(env.action_space.shape, np.float32))
        assert [field["name"] for field in found["info"]] == list(info)
        assert [field["name"] for field in found["reset_info"]] == list(reset_info)
        assert found["model"]["nq"] == len(env.data.qpos)
        assert found["model"]["bodies"][1:] == [env.model.body(i).name for i in range(1, found["model"]["nbody"])]
        assert found["model"]["dt"] == env.dt
    assert found["library"]["version"] == mjenv.version()
    assert found["library"]["math"] == MATH
    assert Path(found["library"]["file"]).name == FILES["2.2.2"]
    assert found["library"]["platform"].startswith(PLATFORM)
    assert found["library"]["instructions"] == platform.machine()
    assert found["library"]["lanes"] == lanes()
    stages = found["lanes"].pop("stages")
    assert found["lanes"] == {"rows": 8, "together": 4 if 4 in lanes() else 2, "reason": ""}
    assert stages["kinematics, centres of mass, inertia"] == "lanes"
    singly = {stage for stage, how in stages.items() if how not in ("lanes", "absent")}
    assert singly == ({"contacts"} if id.startswith("Pusher") else set())  # capsules beside cylinders
    names = [words[0] for words in SCHEMA[id].get("option", [])]
    assert [option["name"] for option in found["options"]][: len(names)] == names
    other = {option["name"] for option in found["options"] if option["default"] != option["vector_default"]}
    assert other == {"num_threads", "autoreset_mode"}


@pytest.mark.parametrize("id", SCHEMA)
def test_model(id: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The text that it prints is the model that the id has when nothing is chosen."""
    assert run("model", id) == 0
    xml = capsys.readouterr().out
    assert xml == mjenv.model_xml(f"mjenv/{id}")
    own = mjenv.make(id.replace("-v4", "-v5"), xml_string=xml).model  # only v5 takes a text
    for name in ("body_mass", "geom_friction", "geom_size", "actuator_ctrlrange", "qpos0"):
        assert np.array_equal(getattr(own, name), getattr(mjenv.make(id).model, name))


def test_info_of_stages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """How lanes compute each stage, also of a model of one's own."""
    stages = output(capsys, "info", "Hopper-v5")["lanes"]["stages"]
    assert (stages["contacts"], stages["sensors"]) == ("lanes", "absent")
    model = tmp_path / "model.xml"
    model.write_text("<mujoco><option solver='PGS' jacobian='sparse'/><worldbody><geom type='plane' size='1 1 1'/>"
                     "<body><freejoint/><geom size='1'/></body></worldbody></mujoco>")  # fmt: skip
    found = output(capsys, "info", "--xml", model)
    assert found["id"] == "Model-v0"
    assert found["lanes"]["stages"]["solver"] == "row by row: PGS with sparse Jacobians"
    assert run("info", "--xml", model) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["solver", *"row by row: PGS with sparse Jacobians".split()] in lines
    assert "not allowed with" in refusal(capsys, "info", "Hopper-v5", "--xml", model)


def test_info_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", "Walker2d-v5", "--option", "healthy_z_range=0.5,inf", "--option", "frame_skip=2") == 0
    text = capsys.readouterr().out
    assert "Spaces" in text
    assert "2 mj_steps of 0.002 s make a step of 0.004 s" in text
    assert "[given: 0.5, inf]" in text or "[given: [0.5, inf]]" in text
    assert "'disabled'; make_vec: 'next_step'" in text
    assert f"mjenv {mjenv.version()} with {MATH} math, on {PLATFORM}" in text
    assert f"lanes: {4 if 4 in lanes() else 2} rows step together\n" in text
    assert f"instruction set {platform.machine()}, with {', '.join(map(str, lanes()))} lanes" in text


@pytest.mark.parametrize(
    ("assignment", "value"),
    [
        ("frame_skip=3", 3),
        ("ctrl_cost_weight=1", 1),
        ("ctrl_cost_weight=1e-1", 0.1),
        ("healthy_z_range=-inf,2", [-np.inf, 2]),
        ("terminate_when_unhealthy=False", False),
        ("main_body=torso", "torso"),
        ("main_body=2", 2),
        ("xml_file=a=b.xml", "a=b.xml"),
    ],
)
def test_options(assignment: str, value: Any) -> None:
    found = arguments.options_of("Ant-v5", [assignment])
    assert found == {assignment.partition("=")[0]: value}
    assert type(*found.values()) is type(value)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["info", "Ant-v6"], 'no environment "Ant-v6"; nearest: Ant-v4, Ant-v5; '),
        (["info", "Ant-v5", "--option", "nothing=1"], "no option 'nothing'"),
        (["info", "Ant-v5", "--option", "strict"], "not NAME=VALUE"),
        (["info", "Ant-v5", "--option", "strict=perhaps"], "'strict' is of the kind flag, not 'perhaps'"),
        (["info", "Ant-v5", "--option", "frame_skip=0"], "frame_skip"),
        (["bench", "--rows", "0"], "less than 1"),
        (["bench", "--seconds", "inf"], "no positive number"),
        (["snapshot", "show", "missing.image"], "missing.image"),
        (["convert", "model.xml"], "--out"),
        (["convert", "model.xml", "--out", "out.xml", "--engine", "4.0"], "invalid choice: '4.0'"),
        (["dance"], "invalid choice"),
        ([], "COMMAND"),
    ],
)
def test_refusals(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert message in refusal(capsys, *words)


def test_convert_needs_mujoco(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """extras/convert/tests converts models."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert 'pip install "mujoco==4.0.*"' in refusal(capsys, "convert", "model.xml", "--out", tmp_path / "out.xml")
    monkeypatch.setitem(sys.modules, "mujoco", types.SimpleNamespace(__version__="3.3.0"))
    monkeypatch.setitem(sys.modules, "mjenv_convert.older_mjcf", types.ModuleType("older_mjcf"))
    assert "has the version 3.3.0" in refusal(capsys, "convert", "model.xml", "--out", tmp_path / "out.xml")


def test_bench(capsys: pytest.CaptureFixture[str]) -> None:
    words = "bench", "Reacher-v5", "--alone", "--rows", "3", "--threads", "2", "--rounds", "2", "--seconds", "0.002"
    [result] = output(capsys, *words)["results"]
    assert (result["id"], result["rows"], result["threads"]) == ("Reacher-v5", 3, 2)
    assert [one["name"] for one in result["contenders"]] == ["mjenv make", "mjenv make_vec 3"]
    assert result["contenders"][0]["ratio"] == 1
    assert all(one["steps_per_second"] > 0 for one in result["contenders"])
    assert (result["lanes"], result["lanes_reason"]) == (0, "the environment has only 3 rows for 2 threads")
    assert run(*words) == 0
    text = capsys.readouterr().out
    assert "mjenv make_vec 3" in text
    assert "rows step one after the other (the environment has only 3 rows for 2 threads)" in text


def test_bench_counts_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that only environments move: the rate is one over what a step takes."""
    clock = 0.0

    class Slow(gymnasium.Env[Any, Any]):
        action_space = gymnasium.spaces.Box(-1, 1, (1,))

        def reset(self, **_: Any) -> Any:
            return 0, {}

        def step(self, action: Any) -> Any:
            nonlocal clock
            clock += 0.25
            return 0, 0.0, False, False, {}

    monkeypatch.setattr(bench.time, "perf_counter", lambda: clock)
    assert bench.Contender("one", Slow(), 0, 2.0).rate() == 4
    assert bench.Contender("many", Slow(), 6, 2.0).rate() == 24


@pytest.fixture
def envs(tmp_path: Path) -> mjenv.VectorEnv:
    made = mjenv.make_vec("Ant-v5", 2)
    made.reset(seed=3)
    for _ in range(4):
        made.step(np.full((2, 8), 0.3))
    return made


def kept(envs: mjenv.VectorEnv, file: Path, row: int | None = None) -> Path:
    file.write_bytes(envs.snapshot(row))
    return file


def test_snapshot_show(envs: mjenv.VectorEnv, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = output(capsys, "snapshot", "show", kept(envs, tmp_path / "all"))
    assert found["id"] == "Ant-v5"
    for row, fields in zip(envs.envs, found["rows"], strict=True):
        state = row.np_random.bit_generator.state["state"]
        assert (int(fields["stream.state"]), int(fields["stream.increment"])) == (state["state"], state["inc"])
        assert fields["steps"] == 4
        for name in ("qpos", "qvel", "qacc_warmstart", "ctrl"):
            assert fields[name] == getattr(row.data, name).tolist()
        assert fields["time"] == [row.data.time]
    assert run("snapshot", "show", kept(envs, tmp_path / "one", 1)) == 0
    assert "Ant-v5: 1 row(s)" in capsys.readouterr().out


def test_snapshot_diff(envs: mjenv.VectorEnv, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = kept(envs, tmp_path / "before")
    assert output(capsys, "snapshot", "diff", before, kept(envs, tmp_path / "same"))["equal"]
    stream = envs._pool.rows.stream(1)
    state = stream["state"]["state"]
    envs._pool.rows.set_stream(1, {**stream, "state": {**stream["state"], "state": state ^ 1}})
    found = output(capsys, "snapshot", "diff", before, kept(envs, tmp_path / "stream"), status=1)
    assert [(one["row"], one["field"]) for one in found["differences"]] == [(1, "stream.state")]
    assert [int(found["differences"][0][side]) for side in ("first", "second")] == [state, state ^ 1]

    envs._pool.rows.set_stream(1, stream)
    row = envs.envs[0]
    qpos, qvel = row.data.qpos.copy(), row.data.qvel.copy()
    row.set_state(qpos, qvel)
    same = kept(envs, tmp_path / "set")
    qpos[7] += 2**-10
    row.set_state(qpos, qvel)
    moved = kept(envs, tmp_path / "moved")
    found = output(capsys, "snapshot", "diff", same, moved, status=1)
    named = {one["field"]: one for one in found["differences"]}
    assert named["qpos"]["index"] == 7
    assert named["qpos"]["differing"] == 1
    assert named["qpos"]["greatest"] == abs(named["qpos"]["second"] - named["qpos"]["first"])
    assert {one["row"] for one in found["differences"]} == {0}
    assert "steps" not in named
    assert run("snapshot", "diff", same, moved) == 1
    assert "qpos" in capsys.readouterr().out


def test_snapshots_of_other_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with mjenv.make("Hopper-v5", ctrl_cost_weight=0.5, frame_skip=2) as env:
        env.reset(seed=1)
        file = tmp_path / "image"
        file.write_bytes(env.handle.snapshot(0))
    assert "name its id and options" in refusal(capsys, "snapshot", "show", file)
    assert "another id, model" in refusal(capsys, "snapshot", "show", file, "--id", "Hopper-v5")
    chosen = "--id", "Hopper-v5", "--option", "ctrl_cost_weight=0.5", "--option", "frame_skip=2"
    assert output(capsys, "snapshot", "diff", file, file, *chosen)["equal"]


@not_on_windows("it has neither /dev/zero nor mkfifo")
def test_snapshots_without_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe")
    for file in (Path("/dev/zero"), tmp_path / "pipe"):
        assert f"{file} is not a regular file" in refusal(capsys, "snapshot", "show", file)
        assert f"{file} is not a regular file" in refusal(capsys, "snapshot", "diff", file, file)


def test_bad_snapshots(envs: mjenv.VectorEnv, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = envs.snapshot()
    file = tmp_path / "image"
    for data, message in (
        (b"", "too few"),
        (b"x" * 400, "no snapshot"),
        (whole[:-8], "damaged"),
        (whole[:80] + b"!" + whole[81:], "damaged"),
        (whole[:24] + bytes(8) + whole[32:], "damaged"),
        (whole[:8] + b"\1" + whole[9:], "version 1"),
    ):
        file.write_bytes(data)
        assert message in refusal(capsys, "snapshot", "show", file)
    assert "is not a regular file" in refusal(capsys, "snapshot", "show", tmp_path)
    other = kept(envs, tmp_path / "one", 0)
    assert "can be compared" in refusal(capsys, "snapshot", "diff", other, kept(envs, file))


def test_every_byte_of_a_row_is_compared(envs: mjenv.VectorEnv, tmp_path: Path) -> None:
    """The head and the fields make up the whole of a row, whose parts the image names with their lengths."""
    rows = envs._pool.rows
    rows.write(0, "body_mass", 2 * rows.read(0, rows.array(Role.MODEL, "body_mass")))
    rows.set_constants(0)
    image = envs.snapshot(0)
    *_, part_count, array_count, _ = snapshots.STAMP.unpack_from(image)
    entries = [snapshots._entry(image, index) for index in range(part_count + array_count)]
    parts, arrays = entries[:part_count], entries[part_count:]
    assert [name for name, _, _ in parts] == [
        "head", "carried", "first_state", "first_values", "set_constants_values", "state", "values",
    ]  # fmt: skip
    start = len(image) - sum(size for _, _, size in parts)
    row, end = snapshots._row(image, start, parts, snapshots._contents(envs.envs[0], [name for name, _, _ in arrays]))
    assert end == len(image)
    doubles = sum(value.size for value in row.values() if isinstance(value, np.ndarray))
    assert snapshots.HEAD.size + 8 * doubles == sum(size for _, _, size in parts)
    assert row["carried"].size == 2  # x and y of the torso


def test_a_snapshot_shows_the_arrays_of_a_row(
    envs: mjenv.VectorEnv, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = envs._pool.rows
    rows.write(1, "opt.timestep", 0.004)
    rows.write(0, "geom_contype", rows.value(Role.MODEL, "geom_contype", 0))
    found = output(capsys, "snapshot", "show", kept(envs, tmp_path / "own"))
    assert [row["own.opt.timestep"] for row in found["rows"][:2]] == [[0.01], [0.004]]
    envs.step(envs.action_space.sample())
    other = output(capsys, "snapshot", "diff", tmp_path / "own", kept(envs, tmp_path / "later"), status=1)
    named = {difference["field"]: difference for difference in other["differences"] if "own" in difference["field"]}
    assert list(named) == ["first.own.opt.timestep"]  # kept from the write to the step
    assert named["first.own.opt.timestep"]["second"] == "absent"


@needs_terminal
def test_on_a_terminal() -> None:
    """bench shows on stderr what is done, and only there."""
    import pty

    main_end, end = pty.openpty()
    bench = "bench", "Reacher-v5", "--alone", "--rounds", "2", "--seconds", "0.002"
    done = subprocess.run([sys.executable, "-m", "mjenv", *bench], stdout=subprocess.PIPE, stderr=end, check=True)
    os.close(end)
    shown = os.read(main_end, 65536)
    os.close(main_end)
    assert b"measuring 2/2" in shown
    assert b"measuring" not in done.stdout


@needs_bash
def test_into_a_pipe() -> None:
    """Plain text, and no complaint when the reader leaves early."""
    command = f"{sys.executable} -m mjenv info Humanoid-v5 | head -n 1"
    ended = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=True)
    assert ended.stdout == "Humanoid-v5: at most 1000 steps an episode\n"
    assert ended.stderr == ""


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    text = capsys.readouterr().out
    for command in ("list", "info", "bench", "verify", "convert", "snapshot"):
        assert f"\n    {command}" in text
        with pytest.raises(SystemExit):
            main([command, "--help"])
        assert len(capsys.readouterr().out.splitlines()) > 5
    with pytest.raises(SystemExit):
        main(["--version"])
    assert capsys.readouterr().out == f"mjenv {mjenv.version()}\n"


def test_a_command_imports_its_own_module() -> None:
    commands = listed("COMMANDS")
    for module in set(commands.values()):
        made = parser([module])
        [action] = [action for action in made._actions if action.dest == "command"]
        assert list(action.choices or ()) == [name for name, home in commands.items() if home == module]
    assert modules_for(["--engine", "2.2.2", "train", "Hopper-v5"]) == ["mjenv_learn.command"]
    assert modules_for(["--tasks", "train", "info", "Hopper-v5"]) == ["mjenv_command.catalogue", "mjenv_learn.command"]
    for words in ([], ["trian"], ["--help", "train"]):
        assert modules_for(words) == [*dict.fromkeys(commands.values())]
