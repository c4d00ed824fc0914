"""mjenv info for models of one's own."""

import json
from pathlib import Path

import pytest

import mjenv
from mjenv_command import main

PENDULUM = """<mujoco><worldbody><body pos="0 0 1"><joint axis="0 1 0"/><geom size="0.1" pos="0 0 0.3"/></body>
</worldbody></mujoco>"""


def test_whose_model_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "part.xml").write_text(PENDULUM)
    (tmp_path / "robot").mkdir()
    path = tmp_path / "robot" / "model.xml"
    path.write_text('<mujoco><include file="../part.xml"/></mujoco>')
    assert mjenv.options("Model-v0")["trust_xml"].choices == ("auto", "yes", "no")
    assert mjenv.make("Model-v0", xml_file=path).model.nq == 1
    with pytest.raises(mjenv.ModelError, match="outside of the model's folder"):
        mjenv.make("Model-v0", xml_file=path, trust_xml="no")
    with pytest.raises(mjenv.ModelError, match=r'from memory.*"trust_xml" to "yes"'):
        mjenv.make("Model-v0", xml_string=path.read_text())
    with pytest.raises(mjenv.OptionError, match="trust_xml"):
        mjenv.make("Model-v0", xml_file=path, trust_xml=True)
    assert main(["info", "Model-v0", "--option", f"xml_file={path}", "--json"]) == 0
    assert main(["info", "Model-v0", "--option", f"xml_file={path}", "--option", "trust_xml=no", "--json"]) == 2
    assert "outside" in capsys.readouterr().err


def test_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "Model-v0", "--option", "xml_file=hopper.xml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(field["name"], field["shape"]) for field in found["observation"]] == [("qpos", [6]), ("qvel", [6])]
    assert main(["info", "Model-v0"]) == 2
    assert "xml_string" in capsys.readouterr().err
