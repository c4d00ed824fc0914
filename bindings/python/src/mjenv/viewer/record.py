"""What a user records: a trajectory of the row that is followed, as numbers (.npz) or as a video."""

from __future__ import annotations

import importlib.util
import io
import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import mjenv

if TYPE_CHECKING:
    from mjenv.viewer.session import Session

_LONGEST = 100_000  # steps
_GIF_RATE = 30  # pictures per second at most, because viewers play faster animations too slowly


class Recorder:
    """Keeps the states of a row, one after each step."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.on = False
        self.frames: list[dict[str, Any]] = []

    def __len__(self) -> int:
        return len(self.frames)

    def begin(self) -> None:
        self.frames = []
        self.on = True
        self.add()

    def end(self) -> None:
        self.on = False

    def add(self) -> None:
        """Keeps the present moment."""
        if not self.on or len(self.frames) >= _LONGEST:
            return
        session = self._session
        row = session.picture.follow
        data = session.picture.rows[row].data
        frame: dict[str, Any] = {
            name: np.array(getattr(data, name)) for name in ("time", "qpos", "qvel", "act", "ctrl")
        }
        frame |= {"obs": session.flat_obs[row].copy(), "reward": float(session.rewards[row])}
        frame |= {"ended": bool(session.ended[row]), "step": int(session.steps[row])}
        frame |= {f"mocap_{name}": np.array(getattr(data, f"mocap_{name}")) for name in ("pos", "quat")}
        self.frames.append(frame)

    def drop(self, steps: int) -> None:
        """After steps back: forgets the moments that these steps led to."""
        if self.on and steps:
            self.frames = self.frames[:-steps]
            if not self.frames:
                self.add()

    def trajectory(self) -> bytes:
        """The arrays as .npz: time, qpos, qvel and the like, each [moments, ...]."""
        file = io.BytesIO()
        arrays: dict[str, Any] = {name: np.stack([frame[name] for frame in self.frames]) for name in self.frames[0]}
        np.savez_compressed(file, id=np.array(self._session.id), dt=np.array(self._session.envs.dt), **arrays)
        return file.getvalue()

    def video(self) -> tuple[str, bytes]:
        """The end of the file's name, and its content: .mp4 where imageio-ffmpeg is there, else .gif.

        mjenv itself draws it, with OpenGL, from the states.
        """
        session = self._session
        options = {
            name: value for name, value in session.options.items() if name not in ("num_threads", "autoreset_mode")
        }
        with mjenv.make(session.id, render_mode="rgb_array", **options) as env:
            env.reset(seed=0)
            rate = env.metadata["render_fps"]
            is_mp4 = importlib.util.find_spec("imageio_ffmpeg") is not None
            every = 1 if is_mp4 else math.ceil(rate / _GIF_RATE)
            pictures = []
            for frame in self.frames[::every]:
                for name in ("mocap_pos", "mocap_quat"):
                    if frame[name].size:
                        getattr(env.data, name)[...] = frame[name]
                env.set_state(frame["qpos"], frame["qvel"])
                pictures.append(env.render())
        return (".mp4", _mp4(pictures, rate)) if is_mp4 else (".gif", _gif(pictures, rate / every))


def _mp4(pictures: list[Any], rate: int) -> bytes:
    import imageio.v2  # type: ignore[import-not-found, unused-ignore]

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        # The encoding of colours needs even sizes, to which imageio rescales the pictures.
        with imageio.v2.get_writer(path, format="FFMPEG", fps=rate, macro_block_size=2) as writer:  # type: ignore[arg-type, unused-ignore]
            for picture in pictures:
                writer.append_data(picture)
        return path.read_bytes()


def _gif(pictures: list[Any], rate: float) -> bytes:
    from PIL import Image  # type: ignore[import-not-found, unused-ignore]

    file = io.BytesIO()
    first, *others = [Image.fromarray(picture) for picture in pictures]
    first.save(file, "GIF", save_all=True, append_images=others, duration=1000 / rate, loop=0)
    return file.getvalue()
