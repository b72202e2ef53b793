"""The worker of tasks: outputs and a manifest row for each, the same wherever it runs."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any

from realizer.batch.task import Options, Task, fingerprint
from realizer.core.errors import RealizerError, VoiceError
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.pipeline import play
from realizer.render import Renderer
from realizer.speech.utterance import SpeechRequest, Utterance, Voice


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a task.

    Attributes:
        row: of the manifest.
        files: path below the folder of outputs -> content.
    """

    row: Mapping[str, Any]
    files: Mapping[str, bytes] = field(default_factory=dict)


def failure(task: Task, error: str) -> Outcome:
    """A task without outputs, and why."""
    return Outcome(
        {"document": task.name, "key": task.key, "status": "failed", "error": error, "outputs": {}}
    )


class SpeechFailedError(RealizerError):
    """The voice failed twice. Not a VoiceError, after which a document would be played in silence."""


class _Speaker:
    """A voice that starts when it is needed, and is asked again when its engine died."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._voice: Voice | None = None

    def say(self, request: SpeechRequest) -> Utterance:
        if self._voice is None:
            from realizer.speech.registry import find_voice

            self._voice = find_voice(self.name)
        try:
            return self._voice.say(request)
        except VoiceError:
            pass
        try:
            return self._voice.say(request)
        except VoiceError as error:
            raise SpeechFailedError(str(error)) from None

    @property
    def pid(self) -> int | None:
        return getattr(self._voice, "pid", None)

    def close(self) -> None:
        if self._voice is not None:
            self._voice.close()


class _PersistentRenderer(Renderer):
    """A renderer that outlives the films it draws: its process takes longer to start than many films."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return


class Worker:
    """Plays tasks one after the other, with one voice and one drawing process for each size of picture."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self._speaker = _Speaker(options.voice)
        self._renderers: dict[tuple[tuple[int, int], bool], Renderer] = {}
        self._drawings: dict[str, RenderSettings] = {}

    def perform(self, task: Task) -> Outcome:
        """Never raises for what is wrong with the document, or while it is played: then the row says so."""
        try:
            realization = play([task.text], self.options, self._speaker)
            suffixes = self.options.formats if realization.has_content else ()
            files = {
                f"{task.name}{suffix}": OUTPUTS[suffix].encode(realization, self._drawing(suffix))
                for suffix in suffixes
            }
        except Exception as error:
            words = str(error) if isinstance(error, RealizerError) else f"{type(error).__name__}: {error}"
            return failure(task, words)
        row = {
            "document": task.name,
            "key": task.key,
            "status": "refused" if realization.refusals or not realization.has_content else "done",
            "duration": round(realization.duration, 6),
            "frames": realization.frames,
            "dropped": [id for schedule in realization.schedules for id in schedule.dropped],
            "warnings": [warning.to_json() for warning in realization.warnings],
            "outputs": {
                suffix: {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
                for suffix, (name, content) in zip(suffixes, files.items(), strict=True)
            },
        }
        return Outcome(row, files)

    @property
    def voice_pid(self) -> int | None:
        """The voice's process, where it has one that runs."""
        return self._speaker.pid

    @property
    def drawing_pids(self) -> tuple[int, ...]:
        """What draws, and runs."""
        return tuple(renderer.pid for renderer in self._renderers.values() if renderer.pid is not None)

    def close(self) -> None:
        """End the voice and what draws."""
        self._speaker.close()
        for renderer in self._renderers.values():
            renderer.close()

    def _drawing(self, suffix: str) -> RenderSettings:
        """How that output is drawn, by a process that stays."""
        if suffix not in self._drawings:
            o = self.options
            drawing = RenderSettings(o.size, o.camera, light=o.light, background=o.background)
            draws = OUTPUTS[suffix].picture_size
            if draws is not None:
                size, alpha = draws(drawing)
                if (size, alpha) not in self._renderers:
                    self._renderers[size, alpha] = _PersistentRenderer(
                        o.face,
                        size,
                        o.camera,
                        light=o.light,
                        background=o.background,
                        alpha=alpha,
                        deformer=o.deformer,
                    )
                drawing = replace(drawing, renderer=self._renderers[size, alpha])
            self._drawings[suffix] = drawing
        return self._drawings[suffix]


# One worker a process, and one task at a time in it: where several threads ask, they wait for each other.
_HERE: list[tuple[Worker, str]] = []
_TURN = threading.Lock()


def perform(options: Options, task: Task) -> Outcome:
    """Do a task in this process, which may be on another machine than the one that made it."""
    with _TURN:
        if not _HERE or _HERE[0][0].options != options:
            for worker, _ in _HERE:
                worker.close()
            _HERE[:] = [(Worker(options), fingerprint(options))]
        worker, here = _HERE[0]
        if here != task.fingerprint:
            return failure(
                task,
                f"the machine that played it has another realizer, face, voice or file: fingerprint "
                f"{here[:12]}, wanted {task.fingerprint[:12]}; install the same there",
            )
        return worker.perform(task)
