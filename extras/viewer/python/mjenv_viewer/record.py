"""Records a trajectory of the row that is followed, as numbers (.npz) or as a video."""

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
    from mjenv_viewer.session import Session

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
        """Drops the moments of steps that the user has taken back."""
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
        """The extension and the content of a video file: .mp4 if imageio-ffmpeg is installed, else .gif.

        mjenv itself draws it, with OpenGL, from the states.
        """
        session = self._session
        options = {
            name: value for name, value in session.options.items() if name not in ("num_threads", "autoreset_mode")
        }
        import imageio.v2  # type: ignore[import-not-found, unused-ignore]

        is_mp4 = importlib.util.find_spec("imageio_ffmpeg") is not None
        with (
            tempfile.TemporaryDirectory() as folder,
            mjenv.make(session.id, render_mode="rgb_array", **options) as env,
        ):
            path, rate = Path(folder) / ("video.mp4" if is_mp4 else "video.gif"), env.metadata["render_fps"]
            every = 1 if is_mp4 else math.ceil(rate / _GIF_RATE)
            mp4 = {"format": "FFMPEG", "fps": rate, "macro_block_size": 2}  # because colours need even sizes
            gif = {"mode": "I", "duration": 1000 * every / rate, "loop": 0}
            env.reset(seed=0)
            writer: Any = imageio.v2.get_writer(path, **(mp4 if is_mp4 else gif))
            for frame in self.frames[::every]:
                for name in ("mocap_pos", "mocap_quat"):
                    if frame[name].size:
                        getattr(env.data, name)[...] = frame[name]
                env.set_state(frame["qpos"], frame["qvel"])
                writer.append_data(env.render())
            writer.close()
            content = path.read_bytes()
        return path.suffix, content
