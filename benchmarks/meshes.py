"""What MuJoCo's compiler takes for a mesh: seconds of CPU and peak memory, for shapes that are easy and hard for it.

Usage: python meshes.py [SHAPE...] [--vertices N...]: lines of a CSV table, with the MuJoCo that is installed
       python meshes.py --models FILE...: the same for models' files

core/engine/untrusted/limits.hpp says which limits follow. Each mesh is compiled in a process of its own, with a convex
hull ("hull") and without ("drawn").
"""

from __future__ import annotations

import argparse
import os
import resource
import struct
import time
from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np

SECONDS = 120


def ball(n: int) -> np.ndarray:
    """Points in a ball, of which few are on the hull."""
    points = np.random.default_rng(1).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] * np.random.default_rng(2).uniform(size=(n, 1)) ** (1 / 3)


def sphere(n: int) -> np.ndarray:
    """Points on a sphere, all on the hull."""
    points = np.random.default_rng(1).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def latitudes(n: int) -> np.ndarray:
    """A sphere made of circles, as drawing programs make it."""
    rings = int(np.sqrt(n / 2))
    polar, around = np.meshgrid(
        (np.arange(rings) + 0.5) / rings * np.pi, np.arange(n // rings) / (n // rings) * 2 * np.pi, indexing="ij"
    )
    points = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
    return points.reshape(-1, 3)


def cylinder(n: int) -> np.ndarray:
    """Two circles, whose flat facets have all their points as corners."""
    around = np.arange(n // 2) / (n // 2) * 2 * np.pi
    ring = np.stack([np.cos(around), np.sin(around)], -1)
    return np.concatenate([np.insert(ring, 2, z, axis=1) for z in (-1, 1)])


def cone(n: int) -> np.ndarray:
    """A circle and a tip, which is connected to all other points."""
    around = np.arange(n - 1) / (n - 1) * 2 * np.pi
    return np.concatenate([np.stack([np.cos(around), np.sin(around), np.zeros(n - 1)], -1), [[0, 0, 1.0]]])


def curve(n: int) -> np.ndarray:
    """The moment curve: every point is connected to the first and the last one."""
    t = np.linspace(-1, 1, n)
    return np.stack([t, t**2, t**3], -1)


def bowl(n: int) -> np.ndarray:
    """A spiral on a paraboloid: points come from the inside to the outside."""
    t = np.sqrt(np.arange(1, n + 1) / n)
    angle = np.arange(n) * 2.399963
    return np.stack([t * np.cos(angle), t * np.sin(angle), t**2], -1)


def cube(n: int) -> np.ndarray:
    """A grid on the sides of a cube, whose facets hold most points inside."""
    side = int(np.sqrt(n / 6)) + 1
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1, 1, side)] * 2))
    faces = [np.insert(np.stack([u, v], -1), axis, at, axis=1) for axis in range(3) for at in (-1, 1)]
    return np.concatenate(faces)[:n]


def rough_disc(n: int) -> np.ndarray:
    """A disc that is flat but for rounding."""
    points = np.random.default_rng(1).normal(size=(n, 3))
    points[:, 2] *= 1e-6
    return points / np.linalg.norm(points[:, :2], axis=1)[:, None]


def lines(n: int) -> np.ndarray:
    """Two slightly bent lines that are skew: each point of one is connected to many of the other."""
    t = np.linspace(-1, 1, n // 2)
    bend = 1 - 1e-3 * t**2
    return np.concatenate([np.stack([t, 0 * t, bend], -1), np.stack([0 * t, t, -bend], -1)])


SHAPES = (ball, sphere, latitudes, cylinder, cone, curve, bowl, cube, rough_disc, lines)


def msh(points: np.ndarray) -> bytes:
    """The mesh in MuJoCo's format; its faces are any, one for two vertices beside each other."""
    n = len(points)
    first = np.arange(n - 2)
    faces = np.stack([first, first + 1, np.full(n - 2, n - 1)], -1)[: max(n - 3, 1)]
    return (
        struct.pack("<4i", n, 0, 0, len(faces))
        + points.astype("<f4").tobytes()
        + faces.astype("<i4", order="C").tobytes()
    )


def measured(load: Callable[[], object]) -> tuple[float, int, str]:
    """Seconds of CPU and MB more of memory that a call takes in a process of its own, and what MuJoCo said."""
    read, write = os.pipe()
    if os.fork() == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        start, said = time.process_time(), ""
        try:
            load()
        except ValueError as error:
            said = str(error).splitlines()[0].replace(",", ";")[:60]
        seconds = time.process_time() - start
        more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        os.write(write, f"{seconds},{more // 1024},{said}".encode())
        os._exit(0)
    os.close(write)
    text = os.read(read, 1000).decode()
    os.close(read)
    os.wait()
    if not text:
        return float(SECONDS), 0, "ended"
    seconds, more, said = text.split(",")
    return float(seconds), int(more), said


def main() -> None:
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("shapes", nargs="*")
    parser.add_argument("--vertices", type=int, nargs="+", default=[10_000, 40_000])
    parser.add_argument("--models", nargs="+", default=[])
    arguments = parser.parse_args()
    print(f"# MuJoCo {mujoco.__version__}\nwhat,vertices,use,seconds,MB,said")
    for path in arguments.models:
        seconds, more, said = measured(partial(mujoco.MjModel.from_xml_path, path))
        print(f"{path},,,{seconds:.2f},{more},{said}", flush=True)
    if arguments.models:
        return
    for shape in SHAPES:
        if arguments.shapes and shape.__name__ not in arguments.shapes:
            continue
        for n in arguments.vertices:
            content = msh(shape(n))
            for use, contype in (("hull", 1), ("drawn", 0)):
                geom = f"<geom type='mesh' mesh='m' contype='{contype}' conaffinity='{contype}' mass='1'/>"
                xml = (
                    "<mujoco><compiler usethread='false'/><asset><mesh name='m' file='m.msh' inertia='shell'/></asset>"
                    f"<worldbody><body>{geom}</body></worldbody></mujoco>"
                )
                seconds, more, said = measured(partial(mujoco.MjModel.from_xml_string, xml, {"m.msh": content}))
                print(f"{shape.__name__},{n},{use},{seconds:.2f},{more},{said}", flush=True)


if __name__ == "__main__":
    main()
