"""The tab that saves states, trajectories and videos."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mjenv_viewer.panels.common import on_click
from mjenv_viewer.record import Recorder

if TYPE_CHECKING:
    from mjenv_viewer.session import Session

_NONE = "(none)"
_RECORD, _STOP = "Record", "Stop recording"


class FilesPanel:
    def __init__(self, gui: Any, session: Session) -> None:
        self._session = session
        self.recorder = Recorder(session)
        with gui.add_folder("Snapshots"):
            save = gui.add_button("Save the row")
            self._names = gui.add_dropdown("Snapshot", (_NONE,), initial_value=_NONE)
            restore = gui.add_button("Restore into the row")
        with gui.add_folder("Recording"):
            self._record = gui.add_button(_RECORD, hint="The row that is followed")
            self._count = gui.add_markdown("")
            numbers = gui.add_button("Save trajectory (.npz)")
            video = gui.add_button("Save video", hint='.mp4 with pip install "mjenv[video]", else .gif')
        on_click(save, lambda: session.do(self._save))
        on_click(restore, lambda: session.do(self._restore))
        on_click(self._record, lambda: session.do(self._switch))
        on_click(numbers, lambda: session.do(self._send_numbers))
        on_click(video, lambda: session.do(self._send_video))

    def _save(self) -> None:
        name = self._session.save()
        self._names.options = tuple(self._session.saved)
        self._names.value = name

    def _restore(self) -> None:
        if self._names.value in self._session.saved:
            self._session.restore(self._names.value)

    def _switch(self) -> None:
        if self.recorder.on:
            self.recorder.end()
        else:
            self.recorder.begin()
        self.refresh()

    def forget(self) -> None:
        """Called when the environment was replaced."""
        self.recorder.end()
        self._names.options = (_NONE,)
        self._names.value = _NONE
        self.refresh()

    def refresh(self) -> None:
        self._record.label = _STOP if self.recorder.on else _RECORD
        self._count.content = f"{len(self.recorder)} states" if len(self.recorder) else ""

    def _send_numbers(self) -> None:
        if self._is_empty():
            return
        self._send(".npz", self.recorder.trajectory())

    def _send_video(self) -> None:
        if not self._is_empty():
            self._send(*self.recorder.video())

    def _is_empty(self) -> bool:
        if not len(self.recorder):
            self._session.server.report("there is nothing recorded yet")
            return True
        return False

    def _send(self, suffix: str, content: bytes) -> None:
        self._session.server.viser.send_file_download(f"{self._session.id}{suffix}", content, save_immediately=True)
