"""Models from strangers: damaged, absurd and malicious ones, and a few good ones that must keep working."""

from __future__ import annotations

import dataclasses
import math
import pathlib
import random
import re
import struct
import zlib
from collections.abc import Iterator

ASSETS = pathlib.Path(__file__).parents[2] / "assets"


@dataclasses.dataclass
class Case:
    """A model in a folder of its own.

    ``expect`` is "works", "refused" or "either"; ``words`` are parts of the reason that is given.
    A file's content may be bytes, ("link", target) or "pipe". ``is_drawn``: what is nasty in it may change a picture.
    """

    name: str
    xml: str | bytes
    files: dict[str, object] = dataclasses.field(default_factory=dict)
    expect: str = "either"
    words: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    is_drawn: bool = True


# ---- Files ----


def png(width: int, height: int, rows: bytes | None = None, extra: bytes = b"", *, color: int = 2) -> bytes:
    """An image of one color, or of the rows given."""
    channels = {0: 1, 2: 3, 6: 4}[color]
    if rows is None:
        rows = (b"\0" + b"\x80" * channels * width) * height
    header = struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0)
    packed = zlib.compress(rows, 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
TRIANGLES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def stl(triangles: list[tuple[int, int, int]] | None = None, corners: list | None = None) -> bytes:
    triangles, corners = triangles or TRIANGLES, corners or CORNERS
    faces = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(float(x) for corner in face for x in corners[corner]), 0) for face in triangles
    )
    return bytes(80) + struct.pack("<I", len(triangles)) + faces


def msh(corners: list | None = None, triangles: list | None = None, sizes: tuple | None = None) -> bytes:
    corners, triangles = corners or CORNERS, triangles or TRIANGLES
    sizes = sizes or (len(corners), 0, 0, len(triangles))
    return (
        struct.pack("<4i", *sizes)
        + b"".join(struct.pack("<3f", *corner) for corner in corners)
        + b"".join(struct.pack("<3i", *face) for face in triangles)
    )


def fans(number: int) -> bytes:
    """Two corners, each beside all of the others, which are on a circle."""
    turns = [2 * math.pi * i / number for i in range(number)]
    corners = [(0, 0, 1), (0, 0, -1), *((math.cos(turn), math.sin(turn), 0) for turn in turns)]
    pairs = [(2 + i, 2 + (i + 1) % number) for i in range(number)]
    return msh(corners, [(0, i, j) for i, j in pairs] + [(1, j, i) for i, j in pairs])


def obj(body: str = "", faces: str = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n") -> bytes:
    return ("".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + body + faces).encode()


def skn(sizes: tuple = (4, 0, 4, 1), faces: list | None = None, body: bytes = b"torso", vertices: int = 4) -> bytes:
    content = struct.pack("<4i", *sizes) + b"".join(struct.pack("<3f", *corner) for corner in CORNERS)
    content += b"".join(struct.pack("<3i", *face) for face in faces or TRIANGLES)
    content += body.ljust(40, b"\0") + struct.pack("<7f", 0, 0, 0, 1, 0, 0, 0) + struct.pack("<i", vertices)
    return content + struct.pack("<4i", 0, 1, 2, 3) + struct.pack("<4f", 1, 1, 1, 1)


def heights(rows: int, columns: int, values: bytes | None = None) -> bytes:
    return struct.pack("<2i", rows, columns) + (bytes(4 * rows * columns) if values is None else values)


# ---- Models ----


def model(body: str = "", sections: str = "", assets: str = "") -> str:
    """A body on three joints, above a floor."""
    return f"""<mujoco>
  <asset>{assets}</asset>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
    <body name="torso" pos="0 0 0.5">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="y" axis="0 1 0"/>
      <geom name="trunk" size="0.1" mass="1"/>
      <site name="here" size="0.01"/>
      {body}
    </body>
  </worldbody>
  <actuator><motor joint="x" ctrlrange="-1 1" ctrllimited="true"/></actuator>
  {sections}
</mujoco>
"""


RICH = """<mujoco model="rich">
  <compiler angle="degree" autolimits="true" boundmass="0.001" inertiafromgeom="auto" settotalmass="-1">
    <lengthrange mode="muscle" timestep="0.01" inttotal="2" inteval="0.5" accel="20" maxforce="0" tolrange="0.2"/>
  </compiler>
  <option timestep="0.002" gravity="0 0 -9.81" iterations="50" tolerance="1e-8" solver="Newton" cone="elliptic"
    integrator="Euler" noslip_iterations="2" mpr_iterations="50" density="1.2" viscosity="0.1" wind="1 0 0"
    impratio="1" o_margin="0" jacobian="auto">
    <flag energy="enable" sensornoise="enable" multiccd="enable"/>
  </option>
  <size njmax="400" nconmax="80" nstack="100000" nuserdata="4" nkey="2" nuser_body="1" nuser_jnt="1" nuser_geom="1"
    nuser_site="1" nuser_cam="1" nuser_tendon="1" nuser_actuator="1" nuser_sensor="1"/>
  <visual>
    <global fovy="45" ipd="0.068" linewidth="1" glow="0.3" offwidth="64" offheight="48"/>
    <quality shadowsize="512" offsamples="2" numslices="8" numstacks="8" numquads="4"/>
    <headlight ambient="0.1 0.1 0.1" diffuse="0.4 0.4 0.4" specular="0.5 0.5 0.5" active="1"/>
    <map stiffness="100" stiffnessrot="500" force="0.005" torque="0.1" alpha="0.3" fogstart="3" fogend="10" znear="0.01"
      zfar="50" haze="0.3" shadowclip="1" shadowscale="0.6" actuatortendon="2"/>
    <scale forcewidth="0.1" contactwidth="0.3" contactheight="0.1" connect="0.2" com="0.4" camera="0.3" light="0.3"
      selectpoint="0.2" jointlength="1" jointwidth="0.1" actuatorlength="0.7" actuatorwidth="0.2" framelength="1"
      framewidth="0.1" constraint="0.1" slidercrank="0.2"/>
    <rgba fog="0 0 0 1" haze="1 1 1 1" force="1 0.5 0.5 1"/>
  </visual>
  <statistic meaninertia="1" meanmass="1" meansize="0.5" extent="2" center="0 0 1"/>
  <default><default class="thin"><geom rgba="1 0 0 1" condim="4" friction="1 0.1 0.1" solref="0.02 1"
    solimp="0.9 0.95 0.001" margin="0.001" gap="0" solmix="1" priority="1"/></default></default>
  <custom>
    <numeric name="n" size="3" data="1 2 3"/>
    <text name="t" data="text"/>
    <tuple name="u"><element objtype="body" objname="torso" prm="1"/></tuple>
  </custom>
  <asset>
    <texture name="grid" type="2d" builtin="checker" width="32" height="32" mark="edge" random="0.01" rgb1="1 1 1"/>
    <texture name="sky" type="skybox" builtin="gradient" width="16" height="16"/>
    <material name="gridded" texture="grid" texrepeat="2 2" specular="0.5" shininess="0.5" reflectance="0.1"
      emission="0.1" texuniform="true" rgba="1 1 1 0.5"/>
    <mesh name="tetra" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 0 3 2 1 2 3" scale="0.1 0.1 0.1"
      refpos="0 0 0" refquat="1 0 0 0"/>
    <mesh name="cloud" vertex="0 0 0 1 0 0 0 1 0 0 0 1 1 1 1" scale="0.1 0.1 0.1"/>
    <hfield name="hills" nrow="8" ncol="9" size="2 2 0.5 0.1"/>
    <skin name="hide" vertex="0 0 0 1 0 0 0 1 0" face="0 1 2" group="1" inflate="0.1">
      <bone body="torso" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/>
    </skin>
  </asset>
  <worldbody>
    <light pos="0 0 3" dir="0 0 -1" cutoff="45" exponent="10" attenuation="1 0 0" directional="false"
      castshadow="true" active="true" ambient="0 0 0" diffuse="0.7 0.7 0.7" specular="0.3 0.3 0.3"/>
    <camera name="eye" pos="0 -3 1" fovy="45" ipd="0.068" mode="targetbody" target="torso" user="1"/>
    <geom name="floor" type="plane" size="9 9 1" material="gridded"/>
    <geom name="ground" type="hfield" hfield="hills" pos="3 0 0"/>
    <geom name="stone" type="mesh" mesh="tetra" pos="0 2 0.2"/>
    <body name="torso" pos="0 0 0.5" quat="1 0 0 0" user="1">
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
      <joint name="x" type="slide" axis="1 0 0" damping="1" stiffness="2" armature="0.1" frictionloss="0.1" user="1"/>
      <joint name="z" type="slide" axis="0 0 1" range="-1 1" margin="0.01" springdamper="0 0" ref="0" springref="0"/>
      <joint name="y" type="hinge" axis="0 1 0" range="-90 90" solreflimit="0.02 1" solimplimit="0.9 0.95 0.001"/>
      <geom name="trunk" type="capsule" size="0.05 0.1" mass="1" class="thin" fluidshape="ellipsoid"
        fluidcoef="0.5 0.25 1.5 1 1" group="1" user="1"/>
      <geom name="tail" type="cylinder" fromto="0 0 0 -0.3 0 0" size="0.02" density="1000"/>
      <site name="here" size="0.01 0.01 0.01" type="box" euler="0 0 10" user="1"/>
      <site name="there" pos="0.2 0 0" size="0.01"/>
      <body name="leg" pos="0.1 0 0">
        <joint name="ball" type="ball" range="0 80"/>
        <geom name="shin" type="ellipsoid" size="0.05 0.06 0.07" contype="1" conaffinity="1"/>
        <geom name="foot" type="mesh" mesh="cloud"/>
        <geom name="fit" type="box" mesh="tetra" fitscale="1"/>
        <site name="toe" pos="0 0 -0.1" size="0.01"/>
      </body>
    </body>
    <body name="ghost" mocap="true" pos="1 1 1"><geom type="sphere" size="0.1" contype="0" conaffinity="0"/></body>
    <body name="free" pos="3 0 1"><freejoint name="loose"/><geom name="crate" type="box" size="0.1 0.1 0.1"/></body>
    <body name="cloth" pos="0 0 2"><joint type="hinge"/><geom size="0.05"/>
      <composite type="grid" count="3 3 1" spacing="0.1" offset="0 0 1" flatinertia="0.01">
        <joint kind="main" damping="0.1"/><skin texcoord="true" subgrid="2" inflate="0.01"/>
        <geom type="sphere" size="0.02" mass="0.01"/><pin coord="0 0"/>
      </composite>
    </body>
  </worldbody>
  <contact>
    <pair geom1="crate" geom2="trunk" condim="3" friction="1 1 0.1 0.1 0.1" solref="0.02 1" margin="0.01" gap="0"/>
    <exclude body1="torso" body2="leg"/>
  </contact>
  <equality>
    <connect body1="leg" body2="free" anchor="0 0 0" active="false" solref="0.02 1"/>
    <weld body1="torso" body2="ghost" relpose="0 0 0 1 0 0 0" torquescale="1" active="false"/>
    <joint joint1="x" joint2="z" polycoef="0 1 0 0 0" active="false"/>
    <tendon tendon1="rope" tendon2="sum" polycoef="0 1 0 0 0" active="false"/>
  </equality>
  <tendon>
    <spatial name="rope" width="0.01" range="0 9" stiffness="1" damping="1" springlength="0.1" frictionloss="0.1"
      user="1">
      <site site="here"/><geom geom="tail" sidesite="toe"/><site site="toe"/><pulley divisor="2"/>
      <site site="there"/><site site="toe"/>
    </spatial>
    <fixed name="sum" range="-9 9" margin="0.1"><joint joint="x" coef="1"/><joint joint="z" coef="-1"/></fixed>
  </tendon>
  <actuator>
    <motor name="m" joint="x" gear="1" ctrlrange="-1 1" forcerange="-5 5" user="1"/>
    <position joint="z" kp="10" ctrlrange="-1 1"/>
    <velocity joint="y" kv="1" ctrlrange="-1 1"/>
    <damper joint="y" kv="1" ctrlrange="0 1"/>
    <adhesion body="leg" gain="1" ctrlrange="0 1"/>
    <intvelocity joint="x" kp="1" ctrlrange="-1 1" actrange="-1 1"/>
    <cylinder joint="z" timeconst="1" area="0.1" bias="0 0 0" ctrlrange="-1 1"/>
    <muscle tendon="rope" ctrlrange="0 1" timeconst="0.01 0.04" range="0.75 1.05" force="1" lmin="0.5" lmax="1.6"
      vmax="1.5" fpmax="1.3" fvmax="1.2" lengthrange="0.1 1"/>
    <general site="toe" refsite="here" gear="1 0 0 0 0 0" dyntype="filter" dynprm="1" gaintype="affine" gainprm="1 1 1"
      biastype="affine" biasprm="0 1 1" ctrlrange="-1 1"/>
  </actuator>
  <sensor>
    <touch site="here" cutoff="1" noise="0.1"/><accelerometer site="here"/><velocimeter site="here"/><gyro site="here"/>
    <force site="here"/><torque site="here"/><magnetometer site="here"/><rangefinder site="toe"/>
    <jointpos joint="x"/><tendonpos tendon="rope"/><actuatorpos actuator="m"/><actuatorfrc actuator="m"/>
    <ballquat joint="ball"/><ballangvel joint="ball"/><jointlimitpos joint="z"/><tendonlimitfrc tendon="rope"/>
    <framepos objtype="body" objname="leg" reftype="site" refname="here"/><framelinacc objtype="geom" objname="shin"/>
    <subtreecom body="torso"/><subtreeangmom body="torso"/><clock/>
    <user name="own" objtype="body" objname="torso" dim="3" needstage="acc" datatype="real" user="1"/>
  </sensor>
  <keyframe><key name="k" time="1" ctrl="0 0 0 0 0 0 0 0 0"/></keyframe>
</mujoco>
"""

# What an attribute's first number, or all of its text, is replaced by.
NASTY = (
    "-1",
    "0",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "2147483647",
    "-2147483648",
    "99999999999999999999",
    "x",
    "",
)


def swept() -> Iterator[Case]:
    """Every attribute of the rich model, each with two or three of the nasty values."""
    values = random.Random(8)
    for number, found in enumerate(re.finditer(r'(\w+)="([^"]*)"', RICH)):
        section = re.findall(r"\w+", RICH[: found.start()].rpartition("\n  <")[2])[0]  # "visual", "actuator" and so on
        for value in values.sample(NASTY, 3):
            changed = " ".join([value, *found[2].split()[1:]])
            xml = RICH[: found.start(2)] + changed + RICH[found.end(2) :]
            is_drawn = section in ("visual", "statistic", "default", "asset", "worldbody")
            yield Case(f"swept-{number:03}-{found[1]}={value}", xml, is_drawn=is_drawn)


def damaged() -> Iterator[Case]:
    """The built-in models and the rich one, cut short and with bytes, attributes and elements changed."""
    chance = random.Random(2)
    sources = [(path.name, path.read_text()) for path in sorted(ASSETS.glob("*.xml"))] + [("rich.xml", RICH)]
    for name, text in sources:
        for number in range(3):
            yield Case(f"cut-{name}-{number}", text[: chance.randrange(len(text))], expect="refused")
        for number in range(4):
            data = bytearray(text.encode())
            for _ in range(1 + 3 * number):
                data[chance.randrange(len(data))] = chance.randrange(256)
            yield Case(f"bytes-{name}-{number}", bytes(data))
        for number in range(4):
            numbers = list(re.finditer(r"(?<=[ \"])-?\d+\.?\d*(?=[ \"])", text))
            at = chance.choice(numbers)
            yield Case(f"number-{name}-{number}", text[: at.start()] + chance.choice(NASTY) + text[at.end() :])
        for number in range(2):
            lines = text.splitlines()
            first, second = chance.randrange(len(lines)), chance.randrange(len(lines))
            lines[first], lines[second] = lines[second], lines[first]
            yield Case(f"swapped-{name}-{number}", "\n".join(lines))


def sizes() -> Iterator[Case]:
    """Numbers that ask for more memory or time than there is."""
    for attribute in (
        "njmax",
        "nconmax",
        "nstack",
        "nuserdata",
        "nkey",
        "nuser_body",
        "nuser_jnt",
        "nuser_geom",
        "nuser_site",
    ):
        for value in ("1000000000", "2147483647", "99999999999999", "-7"):
            yield Case(f"size-{attribute}={value}", model(sections=f'<size {attribute}="{value}"/>'), expect="refused")
    for attribute in ("njmax", "nconmax", "nstack", "nuserdata", "nkey", "nuser_body"):
        yield Case(f"size-{attribute}=0", model(sections=f'<size {attribute}="0"/>'))
        yield Case(f"size-{attribute}=1", model(sections=f'<size {attribute}="1"/>'))
    yield Case("size-njmax=5000", model(sections='<size njmax="5000"/>'), expect="works")
    for attribute in ("iterations", "noslip_iterations", "mpr_iterations"):
        yield Case(
            f"option-{attribute}",
            model(sections=f'<option {attribute}="2000000000" tolerance="0"/>'),
            expect="refused",
            words=(attribute,),
        )
    yield Case(
        "option-iterations-many",
        model(sections='<option iterations="9999" tolerance="0" solver="PGS"/>'),
        expect="works",
    )
    for timestep in ("0", "-1", "1e-300", "1e300"):
        yield Case(f"option-timestep={timestep}", model(sections=f'<option timestep="{timestep}"/>'))
    for side in ("100000 100000", "46341 46341", "65536 65536", "2147483647 2", "-5 5", "0 0"):
        rows, columns = side.split()
        field = f'<hfield name="h" nrow="{rows}" ncol="{columns}" size="1 1 1 1"/>'
        yield Case(f"hfield-{rows}x{columns}", model('<geom type="sphere" size="1"/>', assets=field), expect="refused")
    yield Case(
        "hfield-1x1",
        model(assets='<hfield name="h" nrow="1" ncol="1" size="1 1 1 1"/>').replace(
            'type="plane" size="9 9 1"', 'type="hfield" hfield="h"'
        ),
    )
    yield Case(
        "hfield-1x2",
        model(assets='<hfield name="h" nrow="1" ncol="2" size="1 1 1 1"/>').replace(
            'type="plane" size="9 9 1"', 'type="hfield" hfield="h"'
        ),
    )
    for size in ("1e-300 1e-300 1 1", "1e300 1e300 1 1", "inf inf 1 1"):
        field = f'<hfield name="h" nrow="9" ncol="9" size="{size}"/>'
        yield Case(
            f"hfield-{size}", model(assets=field).replace('type="plane" size="9 9 1"', 'type="hfield" hfield="h"')
        )
    for kind in ("2d", "cube", "skybox"):
        for side in ("20000 20000", "2147483647 2147483647", "65536 65536"):
            width, height = side.split()
            texture = f'<texture name="t" type="{kind}" builtin="checker" width="{width}" height="{height}"/>'
            yield Case(f"texture-{kind}-{width}", model(assets=texture), expect="refused")
        for mark in ("cross", "edge", "random"):
            texture = f'<texture name="t" type="{kind}" builtin="checker" mark="{mark}" width="1" height="1"/>'
            yield Case(f"texture-{kind}-{mark}-1", model(assets=texture))
    for grid in ("65536 65536", "13 1", "-1 -12", "0 0", "2147483647 2147483647"):
        files = {"t.png": png(12, 12)}
        yield Case(
            f"gridsize-{grid}", model(assets=f'<texture name="t" file="t.png" gridsize="{grid}"/>'), files, "refused"
        )
    yield Case("numeric", model(sections='<custom><numeric name="n" size="2000000000"/></custom>'), expect="refused")
    yield Case(
        "user-sensor",
        model(sections='<sensor><user objtype="body" objname="torso" dim="2000000000"/></sensor>'),
        expect="refused",
    )
    yield Case(
        "user-sensors",
        model(sections="<sensor>" + '<user objtype="body" objname="torso" dim="1000000"/>' * 3000 + "</sensor>"),
        expect="refused",
        words=("user data",),
    )
    yield Case(
        "user-sensor-negative",
        model(sections='<sensor><user objtype="body" objname="torso" dim="-5"/></sensor>'),
        expect="refused",
    )
    for count in ("100000 100000 1", "1000 1000 1000", "2147483647 1 1", "-3 3 3", "0 0 0", "65536 65536 2"):
        for kind in ("grid", "particle", "box"):
            composite = f'<composite type="{kind}" count="{count}" spacing="0.1"><geom size="0.01"/></composite>'
            yield Case(f"composite-{kind}-{count}", model(composite), expect="refused")
    for kind in ("particle", "grid", "rope", "loop", "cloth", "box", "cylinder", "ellipsoid"):
        for count in ("1 1 1", "2 2 2", "3 3 3", "5 1 1", "9 9 1", "1 1 9", "4 4 4"):
            geom = '<geom type="sphere" size="0.01"/>'
            composite = f'<composite type="{kind}" count="{count}" spacing="0.1">{geom}</composite>'
            yield Case(f"composite-{kind}-{count}-works", model(f"<body>{composite}</body>"))
    skin = (
        '<composite type="cloth" count="20 20 1" spacing="0.1"><skin subgrid="2147483647"/>'
        '<geom type="capsule" size="0.01 0.01"/></composite>'
    )
    yield Case("composite-subgrid", model(skin), expect="refused")
    rope = '<composite type="rope" count="2001 1 1" spacing="0.1"><geom type="sphere" size="0.01"/></composite>'
    yield Case("composite-rope-long", model(rope))


def counts() -> Iterator[Case]:
    """Many elements, deep and wide."""
    deep = 20_000
    yield Case("deep-bodies", model('<body><geom size="1"/>' * deep + "</body>" * deep), expect="refused")
    yield Case("deep-unclosed", "<mujoco>" * deep, expect="refused")
    yield Case("deep-defaults", f"<mujoco>{'<default>' * deep}{'</default>' * deep}</mujoco>", expect="refused")
    yield Case("deep-90", model('<body><joint/><geom size="0.1" contype="0"/>' * 90 + "</body>" * 90), expect="works")
    yield Case("wide-geoms", model('<geom size="1"/>' * 200_000), expect="refused", words=("elements",))
    yield Case("wide-empty", "<mujoco>" + "<size/>" * 3_000_000 + "</mujoco>", expect="refused")
    yield Case("wide-attributes", "<mujoco " + 'a="" ' * 1_000_000 + "/>", expect="refused")
    yield Case("wide-joints", model('<joint axis="1 0 0"/>' * 5000), expect="refused")
    yield Case(
        "wide-free",
        model(sections="<worldbody>" + '<body><freejoint/><geom size="1"/></body>' * 600 + "</worldbody>"),
        expect="refused",
        words=("degrees of freedom",),
    )
    for kind in ("free", "ball"):
        bodies = '<body><joint/><geom size="0.01"/></body>' * 1100
        nested = f'<default><default class="a"><joint type="{kind}"/></default></default>'
        for name, default in {"": f'<default><joint type="{kind}"/></default>', "-class": nested}.items():
            yield Case(
                f"wide-default-{kind}{name}",
                f"<mujoco>{default}<worldbody>{bodies}</worldbody></mujoco>",
                expect="refused",
                words=("degrees of freedom",),
            )
    yield Case(
        "default-free",
        "<mujoco><default><joint type='free'/></default><worldbody>"
        + "".join(f"<body pos='{i} 0 0'><joint/><geom size='0.1'/></body>" for i in range(20))
        + "</worldbody></mujoco>",
        expect="works",
    )
    yield Case("wide-sites", model('<site size="0.1"/>' * 19_000), expect="works")
    yield Case(
        "wide-names",
        model("".join(f'<geom name="g{i}" size="0.1" contype="0" conaffinity="0"/>' for i in range(10_000))),
        expect="works",
    )
    yield Case("wide-keys", model(sections=f"<keyframe>{'<key/>' * 19_000}</keyframe>"), expect="works")
    yield Case(
        "wide-classes",
        model(sections="<default>" + "".join(f'<default class="c{i}"/>' for i in range(5000)) + "</default>"),
    )
    yield Case(
        "many-motors", model(sections="<actuator>" + '<motor joint="x"/>' * 5000 + "</actuator>"), expect="works"
    )
    for number, expect in ((19_000, "works"), (45_000, "refused")):
        words = ("elements",) if expect == "refused" else ()
        positions = "<sensor>" + '<jointpos joint="x"/>' * number + "</sensor>"
        yield Case(f"many-positions-{number}", model(sections=positions), {}, expect, words)
        numerics = "<custom>" + "".join(f'<numeric name="n{i}" data="1"/>' for i in range(number)) + "</custom>"
        yield Case(f"many-numerics-{number}", model(sections=numerics), {}, expect, words)
    for length in (90, 200):
        names = "".join(f'<default class="{"n" * length}{i}"/>' for i in range(19_000))
        yield Case(
            f"many-names-{length}",
            model(sections=f"<default>{names}</default>"),
            expect="refused" if length == 200 else "works",
        )
    for number, words in ((200, ("Schema",)), (80_000, ("80000 attributes",))):
        attributes = " ".join(f"a{i}='>'" for i in range(number))
        for begin, end in (
            ("", ""),
            ("<!-- it's <a b='' -->", ""),
            ("<?a ' ?><![CDATA[ ' ]]>", ""),
            ("a < ' >", "</b>"),
        ):
            xml = f"{begin}<mujoco><!--'-->{'<b>' * bool(end)}<a {attributes}/>{end}</mujoco>"
            broken = begin.startswith("a")
            yield Case(f"many-attributes-{number}-{begin}", xml, {}, "refused", () if broken else words)
    yield Case("many-sensors", model(sections="<sensor>" + '<rangefinder site="here"/>' * 5000 + "</sensor>"))
    yield Case(
        "many-contacts",
        model(
            sections="<size nconmax='2000' njmax='8000'/><worldbody>"
            + '<body pos="0 0 0.01"><freejoint/><geom size="0.1"/></body>' * 100
            + "</worldbody>"
        ),
        expect="refused",
        words=("solver",),
    )
    for name, number, expect, option, geom in (
        ("few", 20, "works", "", "type='ellipsoid' size='1 .9 .8'"),
        ("many", 2000, "refused", "", "type='ellipsoid' size='1 .9 .8'"),
        ("RK4", 300, "refused", "<option integrator='RK4'/>", "type='ellipsoid' size='1 .9 .8'"),
        (
            "margin",
            600,
            "refused",
            "<option o_margin='9'><flag override='enable'/></option>",
            "type='cylinder' size='.1 .1'",
        ),
        ("fans", 120, "refused", "", "type='mesh' mesh='fans'"),
        ("multiccd", 60, "refused", "<option><flag multiccd='enable'/></option>", "type='mesh' mesh='fans'"),
    ):
        bodies = "".join(f"<body pos='{x} 0 0'><freejoint/>{f'<geom {geom}/>' * number}</body>" for x in (0, 1))
        mesh = "<asset><mesh name='fans' file='fans.msh'/></asset>"
        xml = f"<mujoco>{option}{mesh}<worldbody>{bodies}</worldbody></mujoco>"
        yield Case(f"overlaps-{name}", xml, {"fans.msh": fans(2000)}, expect)
    yield Case("long-name", model(f'<geom name="{"n" * 100}" size="1"/>'), expect="works")
    yield Case("longer-name", model(f'<geom name="{"n" * 101}" size="1"/>'), expect="refused", words=("name", "100"))
    yield Case("long-unknown", f"<mujoco><{'u' * 1_000_000}/></mujoco>", expect="refused")
    yield Case("long-user", model(f'<geom size="1" user="{"1 " * 1_000_000}"/>'))
    yield Case("long-numbers", model(f'<geom size="{"1 " * 1_000_000}"/>'), expect="refused")
    yield Case("long-digits", model(f'<geom size="0.{"1" * 1_000_000}"/>'))
    yield Case("long-text", "<mujoco>" + "x" * 20_000_000 + "</mujoco>", expect="refused", words=("bytes",))
    muscles = "<actuator>" + '<muscle joint="x"/><muscle joint="z"/>' + "</actuator>"
    yield Case("muscles", model(sections=muscles))
    for timestep, total in (
        ("1e-300", "10"),
        ("0", "10"),
        ("-1", "1e300"),
        ("0.01", "1e300"),
        ("1e-9", "10"),
        ("0.01", "inf"),
    ):
        ranges = f'<compiler><lengthrange timestep="{timestep}" inttotal="{total}"/></compiler>'
        yield Case(
            f"muscles-{timestep}-{total}",
            model(sections=muscles + ranges + '<option timestep="1e-300"/>'),
            expect="refused",
        )
    # As MuJoCo reads them: 1e-400 is 0, and a vertical tab and a form feed are white space.
    for name, ranges in {
        "underflow": 'timestep="1e-400"',
        "tab": 'timestep="&#11;1e-9"',
        "feed": 'timestep="&#12;1e-9"',
        "plus": 'timestep="+1e-9"',
        "total": 'inttotal="&#11;1e12"',
        "rest": 'timestep="1e-9garbage"',
        "hexadecimal": 'timestep="0x1p-30"',
        "comma": 'timestep="0,01"',
        "overflow": 'timestep="1e400"',
        "blank": 'timestep=" "',
        "infinity": 'inttotal="infinity"',
    }.items():
        words = ("lengths",) if name in ("underflow", "tab", "feed", "plus", "total") else ("not a number",)
        sections = f'{muscles}<compiler><lengthrange {ranges}/></compiler><option timestep="1e-9"/>'
        yield Case(f"muscles-{name}", model(sections=sections), expect="refused", words=words)
    for stack in ("30", "60", "100", "200", "400"):
        sections = muscles + f'<size nstack="{stack}"/><compiler><lengthrange mode="all" inttotal="1"/></compiler>'
        yield Case(f"muscles-stack-{stack}", model(sections=sections))
    unstable = muscles + '<compiler><lengthrange mode="all" accel="1e30" maxforce="0" timeconst="1e-9"/></compiler>'
    yield Case("muscles-unstable", model(sections=unstable))
    stated = '<actuator><muscle joint="x" lengthrange="-1 1"/></actuator>'
    yield Case("muscles-stated", model(sections=stated), expect="works")
    # MuJoCo writes an element of a sparse Jacobian each time, behind the matrix.
    twice = '<tendon><fixed><joint joint="x" coef="1"/><joint joint="x" coef="2"/></fixed></tendon>'
    each = twice.replace('joint="x" coef="2"', 'joint="z" coef="2"')
    for name, tendon, jacobian, expect in (
        ("twice", twice, "sparse", "refused"),
        ("twice-dense", twice, "dense", "works"),
        ("each", each + each, "sparse", "works"),
    ):
        sections = f'{tendon}<option jacobian="{jacobian}"/>'
        words = ('joint "x" twice',) if expect == "refused" else ()
        yield Case(f"tendon-joint-{name}", model(sections=sections), expect=expect, words=words)


def texts() -> Iterator[Case]:
    """What is not XML, or not MJCF."""
    whole = {
        "empty": b"",
        "blank": b" \n",
        "nul": b"\0",
        "nul-inside": model().replace("torso", "tor\0so").encode(),
        "binary": bytes(range(256)) * 10,
        "declaration-only": b"<?xml version='1.0'?>",
        "comment-only": b"<!-- -->",
        "open-comment": b"<mujoco><!-- ",
        "open-cdata": b"<mujoco><![CDATA[",
        "open-entity": b"<mujoco model='&#x",
        "open-attribute": b"<mujoco model='",
        "wrong-end": b"<mujoco></worldbody>",
        "two-roots": b"<mujoco/><mujoco/>",
        "html": b"<html/>",
        "urdf": b"<robot name='r'><link name='l'/></robot>",
        "urdf-file": b"<robot name='r'><link name='l'><visual><geometry><mesh filename='/etc/passwd'/></geometry>"
        b"</visual></link></robot>",
        "repeated-attribute": b"<mujoco model='a' model='b'/>",
        "upper-case": b"<MUJOCO/>",
        "utf-16": model().encode("utf-16"),
        "bad-utf-8": b"<mujoco model='\xff\xfe\x80'/>",
        "doctype-bomb": b"<!DOCTYPE m [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;'>]><mujoco model='&b;'/>",
        "external-entity": b"<!DOCTYPE m [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><mujoco model='&x;'/>",
        "world-joint": b"<mujoco><worldbody><joint/></worldbody></mujoco>",
        "no-mass": b"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>",
    }
    for name, xml in whole.items():
        yield Case(f"text-{name}", xml, expect="refused")
    yield Case("text-percent", model('<geom name="%s%n%s%n%s%n" size="-1"/>'), expect="refused", words=("size",))
    yield Case("text-percent-element", "<mujoco><%s%n%n/></mujoco>", expect="refused")
    yield Case("text-entity-bomb", f"<mujoco model='{'&lt;' * 1_000_000}'/>", expect="refused")
    yield Case("text-byte-order-mark", "\ufeff" + model(), expect="works")
    yield Case("text-comments", "<!-- a -->" + model() + "<!-- </mujoco> -->", expect="works")
    for name, space in {"space": " ", "tab": "&#9;", "vertical-tab": "&#11;", "form-feed": "&#12;"}.items():
        for nan in ("nan", "-NaN"):
            body = f'<body pos="0 0{space}{nan}"><geom size="1"/></body>'
            yield Case(f"text-{nan}-{name}", model(body), expect="refused", words=("not a number",))
    for name, body in {
        "cycle": '<geom name="a" size="1" class="none"/>',
        "body-named-world": '<body name="world"><geom size="1"/></body>',
        "twice": '<geom name="floor" size="1"/>',
        "childclass": '<body childclass="none"/>',
        "tiny-inertia": '<body><joint/><inertial pos="0 0 0" mass="1e-300" diaginertia="1e-300 1e-300 1e-300"/></body>',
        "bad-inertia": '<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 100"/></body>',
        "zero-quat": '<body quat="0 0 0 0"><geom size="1"/></body>',
        "zero-axis": '<joint axis="0 0 0"/>',
        "free-inside": "<freejoint/>",
        "bad-condim": '<geom size="1" condim="1000000"/>',
        "bad-group": '<geom size="1" group="1000000"/>',
        "bad-skin-group": "",
        "target": '<camera mode="targetbody" target="none"/>',
        "mocap-inside": '<body mocap="true"/>',
    }.items():
        yield Case(f"body-{name}", model(body))
    for name, sections in {
        "tendon-empty": "<tendon><spatial/></tendon>",
        "tendon-pulley": '<tendon><spatial><pulley divisor="0"/></spatial></tendon>',
        "tendon-one-site": '<tendon><spatial><site site="here"/></spatial></tendon>',
        "tendon-pulleys": '<tendon><spatial><site site="here"/>'
        '<pulley divisor="1"/><pulley divisor="1"/></spatial></tendon>',
        "tendon-wrap": '<tendon><spatial><site site="here"/>'
        '<geom geom="trunk" sidesite="none"/><site site="here"/></spatial></tendon>',
        "tendon-wrap-plane": '<tendon><spatial><site site="here"/>'
        '<geom geom="floor"/><site site="here"/></spatial></tendon>',
        "fixed-empty": "<tendon><fixed/></tendon>",
        "equality-self": '<equality><weld body1="torso" body2="torso"/>'
        '<connect body1="torso" body2="torso" anchor="0 0 0"/></equality>',
        "equality-world": '<equality><connect body1="world" body2="torso" anchor="1e300 0 0"/></equality>',
        "pair-self": '<contact><pair geom1="trunk" geom2="trunk"/></contact>',
        "pair-planes": '<contact><pair geom1="floor" geom2="floor"/></contact>',
        "exclude-twice": '<contact><exclude body1="torso" body2="world"/>'
        '<exclude body1="torso" body2="world"/></contact>',
        "actuator-none": '<actuator><motor joint="none"/></actuator>',
        "actuator-two": '<actuator><motor joint="x" tendon="none"/></actuator>',
        "actuator-crank": '<actuator><motor cranksite="here" slidersite="here" cranklength="1"/></actuator>',
        "actuator-crank-0": '<actuator><motor cranksite="here" slidersite="here" cranklength="0"/></actuator>',
        "actuator-user": '<actuator><general joint="x" dyntype="user" gaintype="user" biastype="user"/></actuator>',
        "actuator-empty-range": '<actuator><motor joint="x" ctrlrange="1 -1" ctrllimited="true"/></actuator>',
        "sensor-none": '<sensor><touch site="none"/></sensor>',
        "sensor-wrong-joint": '<sensor><ballquat joint="x"/></sensor>',
        "sensor-frame": '<sensor><framepos objtype="keyframe" objname="x"/></sensor>',
        "sensor-user-object": '<sensor><user objtype="body" objname="none" dim="1"/></sensor>',
        "tuple-self": '<custom><tuple name="t"><element objtype="tuple" objname="t"/></tuple></custom>',
        "key-wrong": '<keyframe><key qpos="1 2"/></keyframe>',
        "key-long": f'<keyframe><key qpos="{"1 " * 5000}"/></keyframe>',
        "default-twice": '<default class="a"/><default class="b"/>',
        "gravity": '<option gravity="1e300 1e300 1e300"/>',
        "magnetic": '<option magnetic="inf inf inf"/>',
        "all-solvers": '<option solver="CG" jacobian="sparse" cone="elliptic" integrator="implicit"/>',
        "collision": '<option collision="dynamic"/>',
    }.items():
        yield Case(f"section-{name}", model(sections=sections))


def meshes() -> Iterator[Case]:
    """Mesh, skin, height and texture files."""

    def mesh(
        name: str, content: object, expect: str = "refused", *, file: str = "m", attributes: str = "", words: tuple = ()
    ) -> Case:
        xml = model('<geom type="mesh" mesh="m" mass="1"/>', assets=f'<mesh name="m" file="{file}" {attributes}/>')
        return Case(f"mesh-{name}", xml, {file: content}, expect, words)

    whole = {"m.stl": stl(), "m.msh": msh(), "m.obj": obj(), "M.STL": stl()}
    for file, content in whole.items():
        yield mesh(f"good-{file}", content, "works", file=file)
        yield mesh(f"good-{file}-mirrored", content, "works", file=file, attributes='scale="-1 1 1"')
        yield mesh(f"{file}-empty", b"", file=file)
        yield mesh(f"{file}-pipe", "pipe", file=file, words=("regular",))
        yield mesh(f"{file}-scale-0", content, "either", file=file, attributes='scale="0 0 0"')
        yield mesh(f"{file}-scale-inf", content, "either", file=file, attributes='scale="1e300 1e300 1e300"')
        yield mesh(f"{file}-and-vertices", content, file=file, attributes='vertex="0 0 0 1 0 0 0 1 0 0 0 1"')
        chance = random.Random(file)
        for number in range(6):
            data = bytearray(content)
            for _ in range(2):
                data[chance.randrange(len(data))] = chance.randrange(256)
            yield mesh(f"{file}-bytes-{number}", bytes(data), "either", file=file)
        for number in range(3):
            yield mesh(f"{file}-cut-{number}", content[: chance.randrange(len(content) - 1)], "either", file=file)
    for name, content in {
        "index-high": obj(faces="f 1 2 99999999\n"),
        "index-5": obj(faces="f 1 2 5\n"),
        "index-0": obj(faces="f 0 1 2\n"),
        "index-negative": obj(faces="f -1 -2 -5\n"),
        "index-huge": obj(faces="f 1 2 99999999999999999999\n"),
        "index-text": obj(faces="f a b c\n"),
        "quad-high": obj(faces="f 1 2 3 9\n"),
        "polygon-high": obj(faces="f 1 2 3 4 1 2 3 99\n"),
        "polygon-long": obj(faces="f" + " 1 2 3" * 100_000 + "\n"),
        "normal-missing": obj("vn 0 0 1\n"),
        "normal-high": obj("vn 0 0 1\n", "f 1//9 2//9 3//9\n"),
        "texcoord-missing": obj("vt 0 0\n"),
        "texcoord-high": obj("vt 0 0\n", "f 1/9 2/9 3/9\n"),
        "no-vertices": b"f 1 2 3\n",
        "one-vertex": b"v 0 0 0\n",
        "three-vertices": b"v 0 0 0\nv 1 0 0\nv 0 1 0\n",
        "no-faces-one-normal": obj("vn 0 0 1\n", ""),
        "degenerate-faces": b"v 0 0 0\nv 1 0 0\nf 1 2\nusemtl none\n",
        "vertex-far": b"v 1e30 0 0\n" + obj(),
        "vertex-nan": b"v nan 0 0\n" + obj(),
        "vertex-text": b"v a b c\n" + obj(),
        "vertex-zero-times-infinity": b"v 0e999 0 0\n" + obj(),
        "vertex-long": b"v 1" + b"0" * 400 + b"e-399 0 0\n" + obj(),
        "normal-zero-times-infinity": obj("vn 0e+999 0 1\n", "f 1//1 3//1 2//1\nf 1//1 2//1 4//1\n"),
        "line-high": obj("l 1 2 99\n"),
        "line-low": obj("l 1 -5\n"),
        "line-0": obj("l 0 1\n"),
        "line-text": obj("l a b\n"),
        "line-texcoord-high": obj("l 1/9 2/9\n"),
        "line-short": obj("l 1\n"),
        "line-first-normals": obj("vn 0 0 1\nl 1 2\no second\n", "f 1//1 3//1 2//1\n"),
        "points": obj("p 99999999\n"),
        "tag": obj("t name 9/9/9 1 2\n"),
        "weights": obj("vw 1 1e300 1\n"),
        "nul": b"\0" + obj(),
    }.items():
        yield mesh(f"obj-{name}", content, file="m.obj")
    yield mesh("obj-exponents", b"v 1.5e-005 -2E+000 .5e1\n" + obj(), "works", file="m.obj")
    yield mesh("obj-no-faces", obj(faces=""), "works", file="m.obj")
    yield mesh("obj-quads", obj(faces="f 1 2 3 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"), "either", file="m.obj")
    yield mesh("obj-polygon-collapsed", b"v 0 0 0\nf 1 1 1 1 1\n", file="m.obj")
    # Nobody reads the files of materials.
    for materials in ("none.mtl", "./m.mtl", "m.mtl", "../m.mtl", "/etc/passwd", "/dev/zero"):
        named = mesh(
            f"obj-materials={materials}", f"mtllib {materials}\nusemtl a\n".encode() + obj(), "works", file="m.obj"
        )
        named.files["m.mtl"] = "pipe"
        yield named
    yield mesh("obj-lines", obj(faces="f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nl 1 2 3\nl 4 -1\n"), "works", file="m.obj")
    yield mesh("obj-lines-alone", obj("l 1 2 3 4\n", ""), "either", file="m.obj")
    yield mesh("obj-flat", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n", "either", file="m.obj")
    yield mesh("obj-flat-cloud", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n", file="m.obj")
    yield mesh("obj-same", b"v 1 1 1\n" * 9, file="m.obj")
    for name, content in {
        "header": bytes(83),
        "count-0": bytes(84),
        "count-huge": bytes(80) + b"\xff" * 4 + bytes(50),
        "count-wraps": bytes(80) + struct.pack("<I", 85899346) + bytes(4),
        "text": b"solid a\nfacet normal 0 0 1\n" * 20,
        "nan": stl(corners=[(float("nan"), 0, 0), *CORNERS[1:]]),
        "inf": stl(corners=[(float("inf"), 0, 0), *CORNERS[1:]]),
        "far": stl(corners=[(1e30, 0, 0), *CORNERS[1:]]),
        "flat": stl(corners=[(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]),
    }.items():
        yield mesh(f"stl-{name}", content, file="m.stl")
    yield mesh("stl-same", stl(corners=[(1, 1, 1)] * 4), "either", file="m.stl")
    for name, content in {
        "face-high": msh(triangles=[(0, 1, 2), (0, 1, 4)]),
        "face-negative": msh(triangles=[(0, 1, -2), (0, 1, 2)]),
        "sizes-negative": msh(sizes=(-4, 0, 0, 4)),
        "sizes-wrap": msh(sizes=(357913941, 0, 0, 4)),
        "sizes-huge": msh(sizes=(2**31 - 1, 2**31 - 1, 2**31 - 1, 2**31 - 1)),
        "few-vertices": msh(corners=CORNERS[:3], triangles=[(0, 1, 2)]),
        "nan": msh(corners=[(float("nan"),) * 3, *CORNERS[1:]]),
        "normals": msh(sizes=(4, 3, 0, 4)),
    }.items():
        yield mesh(f"msh-{name}", content, file="m.msh")
    sphere = random.Random(4)
    points = [tuple(sphere.gauss(0, 1) for _ in range(3)) for _ in range(20_000)]
    points = [tuple(x / sum(y * y for y in p) ** 0.5 for x in p) for p in points]
    yield mesh("msh-large-hull", msh(points, [(0, 1, 2)], (20_000, 0, 0, 1)), "either", file="m.msh")
    yield mesh("text", b"x", file="m.txt")
    yield mesh("no-extension", stl(), file="stl")
    yield mesh("folder", ("folder",), file="m.stl")

    inline = '<mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="{}"/>'
    for name, faces in {
        "negative": "0 1 -2",
        "high": "0 1 4",
        "huge": "0 1 99999999999",
        "half": "0 1",
        "text": "a b c",
        "flipped": "0 1 2 0 1 2",
    }.items():
        yield Case(f"mesh-inline-{name}", model('<geom type="mesh" mesh="m"/>', assets=inline.format(faces)))
    for name, vertices in {
        "few": "0 0 0",
        "none": "",
        "flat": "0 0 0 1 0 0 0 1 0 1 1 0",
        "far": "0 0 0 1e30 0 0 0 1 0 0 0 1",
        "odd": "0 0 0 1 0 0 0 1 0 0 0 1 5",
        "same": "1 1 1 " * 5,
    }.items():
        yield Case(
            f"mesh-inline-{name}-vertices",
            model('<geom type="mesh" mesh="m"/>', assets=f'<mesh name="m" vertex="{vertices}"/>'),
            expect="refused",
        )
    yield Case(
        "mesh-inline-normals",
        model(assets='<mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1" normal="0 0 1"/>'),
        expect="refused",
    )

    def skin(name: str, content: bytes, expect: str = "refused") -> Case:
        return Case(f"skin-{name}", model(assets='<skin name="s" file="s.skn"/>'), {"s.skn": content}, expect)

    yield skin("good", skn(), "works")
    yield skin("empty", b"")
    yield skin("face-high", skn(faces=[(0, 1, 9)] * 4))
    yield skin("face-negative", skn(faces=[(0, 1, -9)] * 4))
    yield skin("sizes-negative", skn((-4, 0, 4, 1)))
    yield skin("sizes-wrap", skn((357913941, 0, 0, 1)))
    yield skin("bones-huge", skn((4, 0, 4, 2**31 - 1)))
    yield skin("body", skn(body=b"none"))
    yield skin("vertices-huge", skn(vertices=2**31 - 1))
    yield skin("vertices-wrap", skn(vertices=2**30))
    for faces in ("0 1 9", "0 1 -9", "0 1"):
        bone = '<bone body="torso" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/>'
        xml = f'<skin vertex="0 0 0 1 0 0 0 1 0" face="{faces}">{bone}</skin>'
        yield Case(f"skin-inline-{faces}", model(assets=xml), expect="refused")

    def field(name: str, file: str, content: object, expect: str = "refused") -> Case:
        xml = model(assets=f'<hfield name="h" file="{file}" size="1 1 1 1"/>')
        return Case(
            f"hfield-{name}",
            xml.replace('type="plane" size="9 9 1"', 'type="hfield" hfield="h"'),
            {file: content},
            expect,
        )

    nan, inf = struct.pack("<f", float("nan")), struct.pack("<f", float("inf"))
    yield field("good", "h.bin", heights(4, 5), "works")
    yield field("good-png", "h.png", png(5, 4, color=0, rows=(b"\0" + bytes(range(5))) * 4), "works")
    yield field("short", "h.bin", b"\1")
    yield field("empty", "h.bin", b"")
    yield field("wraps", "h.bin", heights(65536, 65536, b""))
    yield field("wraps-2", "h.bin", heights(2**30, 4, b""))
    yield field("negative", "h.bin", heights(-4, -4, bytes(64)))
    yield field("nan", "h.bin", heights(2, 2, nan * 4))
    yield field("inf", "h.bin", heights(2, 2, inf * 4))

    def texture(
        name: str,
        content: object,
        expect: str = "refused",
        file: str = "t.png",
        attributes: str = 'type="2d"',
        words: tuple = (),
    ) -> Case:
        xml = model(assets=f'<texture name="t" file="{file}" {attributes}/>')
        return Case(f"texture-{name}", xml, {file: content}, expect, words)

    def bomb(size: int) -> bytes:
        return png(4, 4, rows=bytes(size))

    yield texture("good", png(8, 8), "works")
    yield texture("good-cube", png(8, 8), "works", attributes="")
    yield texture(
        "good-large",
        png(1000, 1000, rows=b"".join(b"\0" + random.Random(i).randbytes(3000) for i in range(1000))),
        "works",
    )
    yield texture("good-custom", struct.pack("<2i", 2, 2) + bytes(12), "works", file="t.bin")
    yield texture("not-square", png(8, 9), attributes='type="cube"')
    yield texture("empty", b"")
    yield texture("short", b"\x89PNG\r\n\x1a\n")
    yield texture("wide", png(2**31 - 1, 1, b"\0"))
    yield texture("huge", png(60_000, 60_000, b"\0"))
    yield texture("none", png(0, 0, b"\0"))
    yield texture("bomb", bomb(300_000_000))
    yield texture("text-bomb", png(4, 4, extra=chunk(b"zTXt", b"k\0\0" + zlib.compress(bytes(15_000_000))) * 9))
    yield texture(
        "profile-bomb", png(4, 4, extra=chunk(b"iCCP", b"k\0\0" + zlib.compress(bytes(60_000_000)))), "either"
    )
    yield texture("custom-wraps", struct.pack("<2i", 65536, 65536), file="t.bin")
    yield texture("custom-short", b"\1\0", file="t.bin")
    yield texture("custom-negative", struct.pack("<2i", -1, -1) + bytes(3), file="t.bin")
    chance = random.Random(7)
    for number in range(12):
        data = bytearray(png(8, 8))
        for _ in range(1 + number % 3):
            data[chance.randrange(8, len(data))] = chance.randrange(256)
        yield texture(f"bytes-{number}", bytes(data), "either")
    for number in range(6):
        yield texture(f"cut-{number}", png(8, 8)[: 10 * number + 7], "refused")
    ktx = b"\xabKTX 11\xbb\r\n\x1a\n" + bytes(99)
    yield texture("ktx", ktx, "refused", file="t.ktx", words=("KTX",))
    yield texture("ktx-named-otherwise", ktx, "refused", file="t.jpg", words=("no PNG image",))


def pictures() -> Iterator[Case]:
    """What loads and steps at once, but would take OpenGL all memory or hours."""

    def scene(
        name: str, world: str, words: str = "", *, assets: str = "", quality: str = "", own: bool = False
    ) -> Case:
        visual = f"<visual><quality {quality}/></visual>"
        body = '<body name="torso"><freejoint/><geom size="0.1" contype="0" conaffinity="0"/></body>'
        xml = f"<mujoco>{visual}<asset>{assets}</asset><worldbody>{world}{body}</worldbody></mujoco>"
        expect = "refused" if words else "works"
        return Case(f"picture-{name}", xml, {}, expect, (words,) if words else (), ("own",) if own else ())

    plane, light = '<geom type="plane" size="0 0 1"/>', '<light pos="0 0 3"/>'
    yield scene("planes-2000", plane * 2000, "vertices")
    yield scene("planes-10000", plane * 10_000, "vertices")
    yield scene("planes-10000-own", plane * 10_000, "GB, more than is free", own=True)
    yield scene("planes-infinite", '<geom type="plane" size="inf inf 1"/>' + plane * 2000, "vertices")
    yield scene("planes-small", '<geom type="plane" size="9 9 1"/>' * 2000)
    yield scene("planes-odd", "".join(f'<geom type="plane" size="{s} 1"/>' for s in ("inf 1", "1e300 1e-300", "1 0")))
    field = '<hfield name="h" nrow="{0}" ncol="{0}" size="1 1 1 1"/>'
    terrain = '<geom type="hfield" hfield="h" contype="0" conaffinity="0"/>'
    yield scene("heights-8000", terrain, "vertices", assets=field.format(8000))
    yield scene("heights-300", terrain, assets=field.format(300))
    spheres = '<geom size="0.1" contype="0" conaffinity="0"/>'
    yield scene("lights-100", light * 100 + spheres * 900, "lights", quality='numslices="128" numstacks="128"')
    yield scene("lights-100-shadows", light * 100, "lights", quality='shadowsize="16384"')
    yield scene("lights-100-bare", '<light castshadow="false"/>' * 100 + spheres * 100)
    for attribute in ("numslices", "numstacks", "numquads"):
        yield scene(f"{attribute}-129", "", attribute, quality=f'{attribute}="129"')
        yield scene(f"{attribute}-128", spheres, quality=f'{attribute}="128"')
        yield scene(f"{attribute}-129-own", spheres, quality=f'{attribute}="129"', own=True)
        yield scene(f"{attribute}-0", spheres, quality=f'{attribute}="0"')


def access() -> Iterator[Case]:
    """Files that a stranger's model has no business with."""
    inside = "<mujocoinclude><worldbody><geom size='1'/></worldbody></mujocoinclude>"

    def include(
        name: str,
        file: str,
        files: dict | None = None,
        expect: str = "refused",
        words: tuple = (),
        arguments: tuple = (),
    ) -> Case:
        return Case(
            f"include-{name}", model(sections=f'<include file="{file}"/>'), files or {}, expect, words, arguments
        )

    yield include("good", "part.xml", {"part.xml": inside}, "works")
    yield include("good-below", "parts/part.xml", {"parts/part.xml": inside}, "works")
    yield include("good-roundabout", "parts/../part.xml", {"part.xml": inside, "parts/part.xml": inside}, "works")
    actuators = "<m><motor joint='x'/></m>"
    yield Case(
        "include-good-nested",
        model(sections="<actuator><include file='a.xml'/></actuator>"),
        {"a.xml": actuators},
        "works",
    )
    outside = ("outside",)
    yield include("above", "../secret.xml", {"../secret.xml": inside}, words=outside)
    yield include("above-own", "../secret.xml", {"../secret.xml": inside}, "works", arguments=("own",))
    yield include("absolute", "/etc/passwd")
    yield include("double-slash", "//etc/passwd")
    yield include("link", "part.xml", {"part.xml": ("link", "../secret.xml"), "../secret.xml": inside}, words=outside)
    yield include("link-inside", "part.xml", {"part.xml": ("link", "real.xml"), "real.xml": inside}, "works")
    yield include("folder-link", "up/secret.xml", {"up": ("link", ".."), "../secret.xml": inside}, words=outside)
    yield include("link-cycle", "part.xml", {"part.xml": ("link", "part.xml")})
    yield include("link-device", "part.xml", {"part.xml": ("link", "/dev/zero")})
    yield include("device-own", "part.xml", {"part.xml": ("link", "/dev/zero")}, words=("regular",), arguments=("own",))
    yield include("pipe", "part.xml", {"part.xml": "pipe"}, words=("regular",))
    yield include("pipe-own", "part.xml", {"part.xml": "pipe"}, words=("regular",), arguments=("own",))
    yield include("folder", "parts", {"parts/part.xml": inside})
    yield include("missing", "none.xml", words=("none.xml",))
    yield include("empty-name", "")
    yield include("long-name", "n" * 5000)
    yield include("dots", "." * 200)
    yield include("self", "model.xml", words=("already included",))
    yield include("self-spelled", "./model.xml")
    yield include("in-text", "part.xml", {"part.xml": inside}, words=("memory",), arguments=("text",))
    yield include("in-text-absolute", "/etc/passwd", arguments=("text",))
    yield include("empty-file", "part.xml", {"part.xml": b""})
    yield include("binary", "part.xml", {"part.xml": bytes(range(256))})
    ring = {f"{i}.xml": f"<mujoco><include file='{(i + 1) % 3}.xml'/></mujoco>" for i in range(3)}
    yield include("ring", "0.xml", ring)
    chain = {f"{i}.xml": f"<mujoco><include file='{i + 1}.xml'/></mujoco>" for i in range(2000)}
    yield include("chain", "0.xml", chain, words=("files",))
    spellings = "".join(f"<include file='{'./' * i}part.xml'/>" for i in range(440))
    big = f"<mujoco><worldbody>{'<geom size=' + chr(39) + '1' + chr(39) + '/>'}</worldbody></mujoco>"
    yield Case(
        "include-spelled",
        model(sections=spellings),
        {"part.xml": big.replace("<worldbody>", "<worldbody>" + "<site/>" * 1000)},
        "refused",
    )
    stack = {
        f"{i}.xml": "<m>" + "<body><geom size='1'/>" * 30 + f"<include file='{i + 1}.xml'/>" + "</body>" * 30 + "</m>"
        for i in range(9)
    }
    stack["9.xml"] = "<m><site/></m>"
    yield Case("include-deep", model('<include file="0.xml"/>'), stack, "refused", ("levels",))
    fork = {
        f"{i}.xml": "<m>" + "".join(f"<include file='{'./' * j}{i + 1}.xml'/>" for j in range(20)) + "</m>"
        for i in range(20)
    }
    yield include("exponential", "0.xml", fork)
    yield Case("include-root", "<include file='/etc/passwd'/>", expect="refused")
    yield Case(
        "include-children",
        model(sections="<include file='part.xml'><geom/></include>"),
        {"part.xml": inside},
        "refused",
    )
    yield Case(
        "include-upper-case",
        model(sections="<INCLUDE file='../secret.xml'/>"),
        {"../secret.xml": inside},
        "refused",
        outside,
    )

    for kind, attribute, folder, content in (
        ("mesh", "file", "meshdir", stl()),
        ("texture", "file", "texturedir", png(4, 4)),
        ("texture", "fileup", "texturedir", png(4, 4)),
        ("hfield", "file", "meshdir", heights(4, 4)),
        ("skin", "file", "meshdir", skn()),
    ):
        yield from of_kind(kind, attribute, folder, content)


def of_kind(kind: str, attribute: str, folder: str, content: bytes) -> Iterator[Case]:
    """A file in every place where it might be."""
    outside = ("outside",)
    extension = {"mesh": "stl", "texture": "png", "hfield": "bin", "skin": "skn"}[kind]
    rest = 'size="1 1 1 1"' if kind == "hfield" else ""

    def asset(
        name: str,
        file: str,
        files: dict,
        expect: str = "refused",
        compiler: str = "",
        words: tuple = (),
        arguments: tuple = (),
    ) -> Case:
        xml = model(assets=f'<{kind} name="a" {attribute}="{file}" {rest}/>', sections=f"<compiler {compiler}/>")
        return Case(f"{kind}-{attribute}-{name}", xml, files, expect, words, arguments)

    file = f"a.{extension}"
    yield asset("here", file, {file: content}, "works")
    yield asset("below", file, {f"parts/{file}": content}, "works", f'{folder}="parts"')
    yield asset("below-slash", file, {f"parts/{file}": content}, "works", f'{folder}="parts/"')
    yield asset("stripped", f"/nowhere/{file}", {file: content}, "works", 'strippath="true"')
    yield asset("above", f"../{file}", {f"../{file}": content}, words=outside)
    yield asset("above-own", f"../{file}", {f"../{file}": content}, "works", arguments=("own",))
    yield asset("folder-above", file, {f"../{file}": content}, compiler=f'{folder}=".."', words=outside)
    yield asset("folder-absolute", file, {}, compiler=f'{folder}="/etc"')
    yield asset("absolute", f"/etc/{file}", {})
    yield asset("device", "/dev/zero", {})
    yield asset("link", file, {file: ("link", f"../{file}"), f"../{file}": content}, words=outside)
    yield asset("link-device", file, {file: ("link", "/dev/zero")})
    yield asset("pipe", file, {file: "pipe"}, words=("regular",))
    yield asset("folder", file, {f"{file}/x": b""})
    yield asset("missing", file, {}, words=(file,))
    yield asset("text", file, {file: content}, arguments=("text",), words=("memory",))
    yield asset("short-name", "a", {"a": content})
    yield asset("slash", "parts/", {"parts/x": b""})


def good() -> Iterator[Case]:
    yield Case("good-plain", model(), expect="works")
    yield Case("good-samples", model(sections='<visual><quality offsamples="1024"/></visual>'), expect="works")
    yield Case("good-rich", RICH, expect="works")
    yield Case("good-text", model(), expect="works", arguments=("text",))
    yield Case("good-rich-text", RICH, expect="works", arguments=("text",))
    yield Case("good-rich-own", RICH, expect="works", arguments=("own",))


TODAY = """<mujoco model="today">
  <compiler autolimits="true" assetdir="parts"/>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="10" iterations="50" ls_iterations="20">
    <flag multiccd="disable" nativeccd="enable" island="enable"/>
  </option>
  <size memory="8M" nuser_body="1"/>
  <visual><global offwidth="64" offheight="48"/><quality shadowsize="256"/></visual>
  <default>
    <joint group="1"/>
    <default class="servo"><position kp="20" dampratio="1" inheritrange="1"/></default>
  </default>
  <asset>
    <texture name="grid" type="2d" builtin="checker" width="32" height="32" nchannel="3"/>
    <material name="tile"><layer role="rgb" texture="grid"/></material>
    <mesh name="tetra" file="tetra.stl" content_type="model/stl" inertia="shell" maxhullvert="16"/>
    <mesh name="ring" builtin="supertorus" params="8 0.4 1 1"/>
    <model name="finger" file="finger.xml"/>
  </asset>
  <worldbody>
    <light pos="0 0 3" type="spot" intensity="1"/>
    <geom name="floor" type="plane" size="9 9 1" material="tile"/>
    <camera name="eye" pos="0 -2 1" resolution="4 3" fovy="45"/>
    <frame name="above" pos="0 0 0.5" euler="0 0 30">
      <body name="torso" gravcomp="0.5" user="1">
        <freejoint align="false"/>
        <geom type="mesh" mesh="tetra" mass="1"/>
        <site name="here" size="0.01"/>
        <replicate count="3" offset="0 0.1 0" sep="-">
          <body name="leg" pos="0.1 0 0">
            <joint name="hip" type="hinge" axis="0 1 0" range="-60 60" springyield="1" stiffness="1"/>
            <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2"/>
            <site name="foot" pos="0 0 -0.2"/>
          </body>
        </replicate>
        <attach model="finger" body="tip" prefix="left_"/>
        <attach model="finger" body="tip" prefix="right_"/>
      </body>
    </frame>
    <flexcomp name="rope" type="grid" dim="1" count="5 1 1" spacing="0.05 0.05 0.05" radius="0.01" pos="1 0 1">
      <edge equality="true"/><pin id="0"/>
    </flexcomp>
    <flexcomp name="pad" dim="3" count="3 3 3" spacing="0.05 0.05 0.05" dof="trilinear" pos="2 0 1" mass="1">
      <edge equality="true"/>
    </flexcomp>
  </worldbody>
  <actuator>
    <position name="servo" joint="hip" class="servo" nsample="4" delay="0.004"/>
    <dcmotor joint="hip" motorconst="0.05" resistance="1"/>
  </actuator>
  <sensor>
    <framepos objtype="site" objname="here" nsample="3" delay="0.004" interval="0.004"/>
    <contact geom1="floor" num="4" data="found force pos"/>
    <rangefinder camera="eye"/>
    <insidesite site="here" objtype="body" objname="torso"/>
  </sensor>
</mujoco>
"""
FINGER = """<mujoco model="finger"><compiler meshdir="shapes"/>
  <asset><mesh name="nail" file="nail.stl"/></asset>
  <worldbody>
    <body name="tip"><joint name="bend" range="0 90"/><geom type="mesh" mesh="nail" mass="0.1"/></body>
  </worldbody>
  <actuator><motor joint="bend"/></actuator>
</mujoco>
"""
PARTS = {"parts/tetra.stl": stl(), "finger.xml": FINGER, "shapes/nail.stl": stl()}


def today() -> Iterator[Case]:
    """Models for MuJoCo 4.0."""
    outside, own = ("outside",), ("own",)
    yield Case("today-good", TODAY, PARTS, "works")
    yield Case("today-good-own", TODAY, PARTS, "works", arguments=own)
    yield Case("today-good-text", model(), expect="works", arguments=("text",))

    def with_world(name: str, world: str, expect: str = "refused", words: tuple = (), **rest: str) -> Case:
        return Case(f"today-{name}", model(sections=f"<worldbody>{world}</worldbody>", **rest), {}, expect, words)

    # Files.
    child = '<mujoco model="c"><worldbody><body name="b"><geom size="0.1"/></body></worldbody></mujoco>'
    attached = "<worldbody><attach model='c' body='b' prefix='p'/></worldbody>"

    def parent(
        name: str, file: str, files: dict, expect: str = "refused", words: tuple = (), arguments: tuple = ()
    ) -> Case:
        xml = model(assets=f"<model name='c' file='{file}'/>", sections=attached)
        return Case(f"today-child-{name}", xml, files, expect, words, arguments)

    yield parent("here", "c.xml", {"c.xml": child}, "works")
    yield parent("below", "parts/c.xml", {"parts/c.xml": child}, "works")
    yield parent("above", "../c.xml", {"../c.xml": child}, words=outside)
    yield parent("above-own", "../c.xml", {"../c.xml": child}, "works", arguments=own)
    yield parent("absolute", "/etc/passwd", {}, words=outside)
    yield parent("link", "c.xml", {"c.xml": ("link", "../c.xml"), "../c.xml": child}, words=outside)
    yield parent("pipe", "c.xml", {"c.xml": "pipe"}, words=("regular",))
    yield parent("missing", "none.xml", {}, words=("none.xml",))
    yield parent("text", "c.xml", {"c.xml": child}, words=("memory",), arguments=("text",))
    yield parent("urdf", "c.xml", {"c.xml": "<robot name='r'><link name='l'/></robot>"}, words=("MJCF",))
    yield parent("archive", "c.xml", {"c.xml": b"PK\3\4" + bytes(99)})
    beside = {
        "robots/arm.xml": "<m><include file='tool.xml'/></m>",
        "robots/tool.xml": "<m><asset><mesh name='m' file='tool.stl'/></asset></m>",
        "robots/tool.stl": stl(),
    }
    yield Case("today-include-beside", model(sections="<include file='robots/arm.xml'/>"), beside, "works")
    far_tool = "<m><asset><mesh name='m' file='../../tool.stl'/></asset></m>"
    outer = {**beside, "robots/tool.xml": far_tool, "../tool.stl": stl()}
    yield Case(
        "today-include-beside-above", model(sections="<include file='robots/arm.xml'/>"), outer, "refused", outside
    )

    # Convex hulls. MuJoCo would take minutes for those that are refused.
    def hull(name: str, points: list, expect: str, words: tuple = (), copies: int = 1) -> Case:
        assets = "".join(f"<mesh name='m{i}' file='m{i}.msh' inertia='shell'/>" for i in range(copies))
        body = "".join(f"<geom type='mesh' mesh='m{i}' mass='1'/>" for i in range(copies))
        content = msh(points, [(0, 1, len(points) - 1)])
        return Case(
            f"today-hull-{name}", model(body, "", assets), {f"m{i}.msh": content for i in range(copies)}, expect, words
        )

    chance = random.Random(5)
    inside = [tuple(chance.uniform(-1, 1) for _ in range(3)) for _ in range(60_000)]
    yield hull("few-of-60000", inside, "works")
    too_much = ("convex hulls", "trust_xml")

    def ring(count: int, z: float) -> list:
        angles = (2 * math.pi * i / count for i in range(count))
        return [(math.cos(angle), math.sin(angle), z) for angle in angles]

    yield hull("cone", [*ring(20_000, 0), (0, 0, 1)], "refused", too_much)
    yield hull("cylinder", ring(20_000, 0) + ring(20_000, 1), "refused", too_much)
    yield hull("cones", [*ring(3_000, 0), (0, 0, 1)], "refused", too_much, copies=30)
    yield hull("vertices", inside * 9, "refused", ("vertices in all meshes",), copies=4)
    # MuJoCo 4.0 would simulate for ever to find the range of this muscle's length.
    unstable = '<compiler><lengthrange accel="1e30" maxforce="0"/></compiler>'
    muscle = '<actuator><muscle joint="x"/></actuator>'
    yield Case("today-muscles", model(sections=muscle + unstable), expect="refused", words=("lengthrange",))
    joint = '<worldbody><body name="b"><joint name="x" type="slide"/><geom size="0.1"/></body></worldbody>'
    muscled = f'<mujoco model="c">{unstable}{joint}{muscle}</mujoco>'
    yield parent("muscles", "c.xml", {"c.xml": muscled}, words=("lengthrange",))
    yield parent("self", "model.xml", {})
    reads = '<mujoco model="c"><asset><mesh name="m" file="{}"/></asset><worldbody><body name="b">'
    reads += '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
    far = {"parts/c.xml": reads.format("../../m.stl"), "../m.stl": stl()}
    yield parent("mesh-above", "parts/c.xml", far, words=outside)
    near = {"parts/c.xml": reads.format("m.stl"), "parts/m.stl": stl()}
    yield parent("mesh-beside", "parts/c.xml", near, "works")
    damaged_mesh = {"parts/c.xml": reads.format("m.stl"), "parts/m.stl": stl()[:-3]}
    yield parent("mesh-damaged", "parts/c.xml", damaged_mesh)
    includes = '<mujoco model="c"><worldbody><include file="{}"/></worldbody></mujoco>'
    body = '<m><body name="b"><geom size="0.1"/></body></m>'
    yield parent("include", "parts/c.xml", {"parts/c.xml": includes.format("b.xml"), "parts/b.xml": body}, "works")
    yield parent("include-above", "c.xml", {"c.xml": includes.format("../b.xml"), "../b.xml": body}, words=outside)
    chain = {f"{i}.xml": f"<mujoco><asset><model file='{i + 1}.xml'/></asset></mujoco>" for i in range(200)}
    yield parent("chain", "0.xml", chain, words=("levels",))
    twice = "<mujoco model='c'><asset><model name='c' file='{0}.xml'/></asset><worldbody><body name='b'>"
    twice += (
        "<attach model='c' body='b' prefix='p'/><attach model='c' body='b' prefix='q'/></body></worldbody></mujoco>"
    )
    yield parent("exponential", "0.xml", {f"{i}.xml": twice.format(i + 1) for i in range(40)} | {"40.xml": child})
    many = "".join(f"<attach model='c' body='b' prefix='p{i}'/>" for i in range(3000))
    xml = model(assets="<model name='c' file='c.xml'/>", sections=f"<worldbody>{many}</worldbody>")
    yield Case("today-child-3000", xml, {"c.xml": child}, "refused", ("attachments",))
    for kind in ("mesh", "gmsh"):
        flex = f"<flexcomp name='f' type='{kind}' file='{{}}' dim='2' radius='0.01' mass='1'/>"
        yield Case(
            f"today-flex-{kind}-above",
            model(sections=f"<worldbody>{flex.format('../m.stl')}</worldbody>"),
            {"../m.stl": stl()},
            "refused",
        )
        yield Case(
            f"today-flex-{kind}",
            model(sections=f"<worldbody>{flex.format('m.stl')}</worldbody>"),
            {"m.stl": stl()},
            "works" if kind == "mesh" else "refused",
        )
    for kind in ("obj", "png", "vnd.mujoco.msh"):
        xml = model(assets=f"<mesh name='m' file='m.stl' content_type='model/{kind}'/>")
        yield Case(f"today-content-{kind}", xml, {"m.stl": stl()}, "refused", ("content type",))
    late = "<texture name='t' type='2d' file='t.png' {}/>"
    files: dict = {"t.png": png(4, 4)}
    yield Case("today-late-texture", model(assets=late.format("embed='false'")), files, "refused", ("trust",))
    xml = model(assets=late.format(""), sections="<compiler passthrough='textures'/>")
    yield Case("today-late-textures", xml, files, "refused", ("trust",))

    # The first model of a process opens MuJoCo, and its trial step fails.
    yield Case("today-unstable", model(sections="<option gravity='1e300 1e300 1e300'/>"))

    # Copies.
    bead = "<body><freejoint/><geom size='0.01' contype='0' conaffinity='0'/></body>"
    geom = "<geom size='0.01' contype='0' conaffinity='0'/>"

    def nested(inside: str, *counts: int) -> str:
        for number, count in enumerate(counts):
            inside = f"<replicate count='{count}' sep='-{number}-' offset='1 0 0'>{inside}</replicate>"
        return inside

    yield with_world("replicate-100", nested(bead, 100), "works")
    yield with_world("replicate-2000", nested(geom, 2000), "works")
    yield with_world("replicate-20000", nested(geom, 20_000), words=("replicas",))
    yield with_world("replicate-nested", nested(geom, 200, 200), words=("replicas",))
    yield with_world("replicate-deep", nested(geom, *[2] * 30), words=("replicas",))
    yield with_world("replicate-dofs", nested(bead, 600), words=("degrees of freedom",))
    for count in ("0", "-1", "99999999999999999999", "x", ""):
        yield with_world(f"replicate-{count}", f"<replicate count='{count}'>{geom}</replicate>")
    sensors = "<sensor>" + "<framepos objtype='site' objname='s'/>" * 1000 + "</sensor>"
    xml = model(
        sections=f"<worldbody>{nested('<site name=' + chr(39) + 's' + chr(39) + '/>', 1000)}</worldbody>{sensors}"
    )
    yield Case("today-replicate-references", xml, {}, "refused", ("elements",))
    yield with_world("attach-self", "<body name='b'><geom size='0.1'/></body><attach body='b' prefix='p'/>", "works")
    yield with_world("attach-cycle", "<body name='b'><geom size='0.1'/><attach body='b' prefix='p'/></body>")
    yield with_world(
        "attach-frame", "<frame name='f'><geom size='0.1'/></frame><attach frame='f' prefix='p'/>", "works"
    )
    doubled = "<body name='b0'><geom size='0.1' contype='0'/></body>" + "".join(
        f"<body name='b{i + 1}'><attach body='b{i}' prefix='p{i}'/><attach body='b{i}' prefix='q{i}'/></body>"
        for i in range(30)
    )
    yield with_world("attach-doubled", doubled)
    yield with_world("attach-unknown", "<attach body='none' prefix='p'/>", words=("before this element",))

    # Sizes.
    for count in ("100 100 100", "2147483647 1 1", "0 1 1", "-1 -1 -1", "1000000 1 1"):
        for dim in (1, 2, 3):
            flex = f"<flexcomp name='f' type='grid' dim='{dim}' count='{count}' radius='0.001' mass='1'/>"
            first = int(count.split()[0])  # a flex of one dimension has this many points
            expect = "either" if dim == 1 and 0 < first < 1000 else "refused"
            yield with_world(f"flexcomp-{dim}-{count}", flex, expect)
    for kind in ("grid", "box", "cylinder", "ellipsoid", "disc", "circle", "mesh", "direct", "square", "none"):
        for dof in ("full", "radial", "trilinear", "quadratic"):
            flex = (
                f"<flexcomp name='f' type='{kind}' dof='{dof}' count='4 4 4' spacing='.1 .1 .1' radius='.01' mass='1'>"
            )
            yield with_world(f"flexcomp-{kind}-{dof}", flex + "<edge equality='true'/></flexcomp>", "either")
    for cells in ("1000 1000 1000", "2147483647 1 1", "0 1 1", "9 9 9"):
        flex = f"<flexcomp name='f' dim='3' count='3 3 3' dof='quadratic' cellcount='{cells}' radius='.01' mass='1'/>"
        yield with_world(f"flexcomp-cells-{cells}", flex)
    for element in ("0 1 2", "0 1 9", "0 1 -1", "0 1", "0 0 0"):
        point = "point='0 0 0 1 0 0 0 1 0'"
        flex = f"<flexcomp name='f' type='direct' dim='2' {point} element='{element}' radius='.01' mass='1'/>"
        yield with_world(f"flexcomp-direct-{element}", flex, "either")
        flex = f"<flex name='f' dim='2' body='torso' vertex='0 0 0 1 0 0 0 1 0' element='{element}'/>"
        yield Case(f"today-flex-{element}", model(sections=f"<deformable>{flex}</deformable>"))
    for pin in ("id='99'", "id='-1'", "range='0 99'", "range='5 1'", "grid='9 9 9'", "gridrange='0 0 9 9'"):
        flex = f"<flexcomp name='f' dim='2' count='3 3 1' radius='.01' mass='1'><pin {pin}/></flexcomp>"
        yield with_world(f"flexcomp-pin-{pin}", flex, "either")
    for memory in ("2G", "1P", "99999999999999999999", "9E", "-5", "1", "1K", "x", "16M"):
        expect = "refused" if memory in ("2G", "1P", "99999999999999999999", "9E") else "either"
        yield Case(f"today-memory-{memory}", model(sections=f"<size memory='{memory}'/>"), expect=expect)
    for kind, params in {
        "supersphere": ("3 1 1", "100000 1 1", "1e30 1 1", "-5 1 1", "2 0 0"),
        "supertorus": ("5 0.5 1 1", "100000 0.5 1 1", "2147483648 0.5 1 1"),
        "cone": ("4 0", "1e9 0.5", "0 0", "-3 0"),
        "sphere": ("4", "5", "-1", "1e9"),
        "hemisphere": ("10", "11", "1e9"),
        "wedge": ("5 5 90 45 0", "100000 100000 90 45 0", "0 0 0 0 0"),
        "plate": ("5 5", "100000 100000", "0 0"),
        "box": ("4 4 4 .1 .1 .1", "10000 10000 10000 1 1 1", "1 1 1 1 1 1"),
        "disc": ("4 4 1 .1 .1 .1", "100000 100000 1 1 1 1"),
    }.items():
        for values in params:
            mesh = f"<mesh name='m' builtin='{kind}' params='{values}'/>"
            huge = any(abs(float(value)) > 9999 for value in values.split())
            body = "<geom type='mesh' mesh='m' mass='1'/>"
            yield Case(
                f"today-builtin-{kind}-{values}", model(body, assets=mesh), expect="refused" if huge else "either"
            )
    for attribute in ("ls_iterations", "ccd_iterations", "sdf_iterations", "sdf_initpoints"):
        xml = model(sections=f"<option {attribute}='2000000000'/>")
        yield Case(f"today-{attribute}", xml, expect="refused", words=(attribute,))
    for text, words in {
        "<framepos objtype='site' objname='here' nsample='2000000000'/>": ("nsample",),
        "<framepos objtype='site' objname='here' nsample='9223372036854775807'/>": ("nsample",),
        "<contact geom1='floor' num='2000000000'/>": ("num",),
        "<contact geom1='floor' num='9223372036854775807'/>": ("num",),
        # 2^32 numbers and some, which 32 bits would make 6,704
        "<contact geom1='floor' num='1000' nsample='186737'/>": ("4294974000 numbers",),
        "<contact geom1='floor' num='-1'/>": (),
        "<rangefinder camera='eye'/>": ("pixels",),
    }.items():
        camera = "<camera name='eye' resolution='4000 3000'/>"
        yield Case(f"today-sensor-{text}", model(camera, f"<sensor>{text}</sensor>"), expect="refused", words=words)
    yield Case("today-camera-hd", model("<camera name='eye' resolution='1920 1080'/>"), expect="works")
    motor = "<actuator><motor joint='z' nsample='{}' delay='0.01'/></actuator>"
    for number in (2_000_000_000, 2**63 - 1):
        xml = model(sections=2 * motor.format(number))
        yield Case(f"today-actuator-history-{number}", xml, expect="refused", words=("nsample",))
    yield Case("today-actuator-delay", model(sections=motor.format(5)), expect="works")
    channels = "<texture name='t' type='2d' builtin='flat' width='9' height='9' nchannel='99999'/>"
    yield Case("today-nchannel", model(assets=channels), expect="refused")
    plugin = "<extension><plugin plugin='mujoco.sdf.torus'><instance name='i'/></plugin></extension>"
    yield Case("today-plugin", model(sections=plugin), expect="refused", words=("plugins",))
    yield Case(
        "today-sleep", model(sections="<option><flag sleep='enable'/></option>"), expect="refused", words=("sleep",)
    )
    ipc = "<option integrator='discrete'><flag ipc='enable'/></option><worldbody><flexcomp name='f' dim='2' "
    ipc += "count='3 3 1' radius='.01' mass='1'/></worldbody>"
    yield Case("today-ipc", model(sections=ipc), expect="refused", words=("ipc",))


def swept_today() -> Iterator[Case]:
    """Every attribute of the model of today, each with one of the nasty values."""
    values = random.Random(9)
    for number, found in enumerate(re.finditer(r'(\w+)="([^"]*)"', TODAY)):
        changed = " ".join([values.choice(NASTY), *found[2].split()[1:]])
        xml = TODAY[: found.start(2)] + changed + TODAY[found.end(2) :]
        yield Case(f"today-swept-{number:03}-{found[1]}={changed}", xml, PARTS)


# What MuJoCo 4.0 does not know, or reads in another way. The last one takes it half a minute, as it takes any engine
# that is not compiled in.
ONLY_IN_MUJOCO_2 = (
    "good-rich",
    "texture-good-custom",
    "mesh-inline-normals",
    "composite",
    "muscles-unstable",
    "overlaps-RK4",
    "overlaps-fans",
    "overlaps-margin",
    "overlaps-multiccd",
    "tendon-joint-twice",
)


def cases(mujoco: str = "2") -> Iterator[Case]:
    """The cases for MuJoCo 2, or for MuJoCo 4: the first few kinds of "4-few", all kinds of "4"."""
    kinds = {
        "2": (good, texts, sizes, counts, meshes, pictures, access, damaged, swept),
        "4": (good, today, swept_today, texts, sizes, counts, meshes, pictures, access, damaged),
        "4-few": (today,),
    }
    for kind in kinds[mujoco]:
        for case in kind():
            if mujoco == "2" or not case.name.startswith(ONLY_IN_MUJOCO_2):
                yield case
