"""MuJoCo 2.2.2 refuses a model of today with the engine that knows it, for all that MuJoCo 4.0's schema lists."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from ctypes import CDLL, create_string_buffer
from pathlib import Path

import mujoco
import pytest

import mjenv

Schema = dict[tuple[str, ...], set[str]]  # the attributes of each element, which is named with its parents


def schema(library: Path) -> Schema:
    """What mj_printSchema prints: a line begins with an element and a mark, deeper elements farther to the right."""
    text = create_string_buffer(1_000_000)
    CDLL(str(library)).mj_printSchema(b"", text, len(text), 0, 0)
    found: Schema = {}
    path: tuple[str, ...] = ()
    for line in text.value.decode().splitlines():
        begun = re.match(r"( *)(?:\(world\))?(\w+) \([!?*R]\)(.*)", line)
        if begun:
            path = (*path[: len(begun[1]) // 3], begun[2])
            found[path] = set()
        found[path] |= set((begun[3] if begun else line).split())
    return found


def refusal(path: tuple[str, ...], attribute: str = "") -> str:
    inner = f'<{path[-1]} {attribute}="1"></{path[-1]}>' if attribute else f"<{path[-1]}/>"
    for element in reversed(path[:-1]):
        inner = f"<{element}>{inner}</{element}>"
    inner = inner.replace("<body", "<worldbody><body", 1).replace("</body>", "</body></worldbody>")
    with pytest.raises(mjenv.ModelError) as refused:
        mjenv.make("Model-v0", engine="2.2.2", xml_string=inner, trust_xml="yes")
    return str(refused.value)


def test_every_element_and_attribute_of_today() -> None:
    listed = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    (installed,) = {line.split()[-1] for line in listed.splitlines() if "libmujoco.so.2.2.2 " in line}
    old = schema(Path(installed))
    new = schema(next(Path(mujoco.__file__).parent.glob("libmujoco.so.4.0.*")))
    # MuJoCo does not say where it found an element, so one that 2.2.2 has in other places tells nothing. mjenv itself
    # refuses plugins and models without a file.
    names = {path[-1] for path in old} | {"plugin", "model"}
    wanted = [(path, "") for path in new if path[-1] not in names and path[:-1] in old]
    wanted += [(path, attribute) for path in new if path in old for attribute in sorted(new[path] - old[path])]
    assert len(wanted) > 200
    without = [
        f"{'/'.join(path)} {attribute}: {told}"
        for path, attribute in wanted
        if not re.search(
            r"; this is MuJoCo 2\.2\.2; if a newer MuJoCo knows it, load .* engine=\"4\.0\" in Python",
            told := refusal(path, attribute),
        )
    ]
    assert without == []


NOP = bytes.fromhex("662e0f1f840000000000")  # an instruction that does nothing; its last bytes do not matter


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (b"", b"", ""),
        (NOP, NOP[:-1] + b"\1", "and its library is another build of {}"),
        (b"\x004.0.", b"\x004.9.", "and its library is 4.9"),
    ],
)
def test_lanes_of_libraries(tmp_path: Path, old: bytes, new: bytes, why: str) -> None:
    """Rows step in lanes on the published libraries alone, and all others say why they do not."""
    library = Path(os.environ.get("MJENV_MUJOCO") or next(Path(mujoco.__file__).parent.glob("libmujoco.so.4.0.*")))
    changed = tmp_path / library.name
    changed.write_bytes(library.read_bytes().replace(old, new, 1))
    program = "import mjenv; env = mjenv.make_vec('Hopper-v5', 8, engine='4.0'); print(env.lanes, env.lanes_reason)"
    environment = os.environ | {"MJENV_MUJOCO": str(changed)}
    told = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    lanes, _, reason = told.stdout.strip().partition(" ")
    assert (int(lanes) > 0) == (why == "")
    assert why.format(library.name[-5:]) in reason if why else reason == ""


def test_assets_stay() -> None:
    """MuJoCo 4.0's header lists what mj_setConst writes: nothing of what mjenv lets it share between rows."""
    folder = Path(mujoco.__file__).parent / "include" / "mujoco"
    lines = (folder / "mjxmacro.h").read_text(encoding="utf-8").split("#define MJSETCONST_ARRAYS")[1].splitlines()
    written = {line.split("(")[1].split(",")[0].strip() for line in lines if "mjSC_OUT" in line or "mjSC_INOUT" in line}
    assert {"body_subtreemass", "dof_length", "bvh_aabb", "eq_data"} <= written
    source = (Path(__file__).parents[2] / "core" / "engine" / "constants.cpp").read_text(encoding="utf-8")
    assets = re.findall(r'"(\w+)"', source.split("beginnings{")[1].split("}")[0])
    assert len(assets) > 4
    assert not [name for name in written if name.startswith(tuple(assets))]
