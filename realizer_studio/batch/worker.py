"""The worker of tasks, which makes the outputs and the manifest row of each, on any machine the same."""

import hashlib
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from realizer.core.errors import RealizerError, VoiceError
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.pipeline import play
from realizer.realization import Realization
from realizer.render.renderer import Renderer
from realizer.speech.utterance import SpeechRequest, Utterance, Voice
from realizer_studio.batch.task import Options, Task, fingerprint


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a task.

    Attributes:
        row: of the manifest.
        files: path below the folder of outputs -> content.
    """

    row: Mapping[str, Any]
    files: Mapping[str, bytes] = field(default_factory=dict)


def failure(task: Task, error: str) -> Outcome:
    """Return the outcome of a task that failed."""
    return Outcome(
        {"document": task.name, "key": task.key, "status": "failed", "error": error, "outputs": {}}
    )


class SpeechFailedError(RealizerError):
    """The voice failed twice. It is no VoiceError, after which a document would be played in silence."""


class _Speaker:
    """A voice that starts on first use, and repeats a request when its engine has died."""

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

    def close(self) -> None:
        if self._voice is not None:
            self._voice.close()


class _PersistentRenderer(Renderer):
    """A renderer that stays open between films: starting its process takes longer than many films."""

    def __exit__(self, *_: object) -> None:
        return


class Worker:
    """A worker that plays tasks one by one, with one voice and a renderer for each size of picture."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self._speaker = _Speaker(options.voice)
        self._renderers: dict[tuple[tuple[int, int], bool], Renderer] = {}
        self._render_settings: dict[str, RenderSettings] = {}

    def perform(self, task: Task) -> Outcome:
        """Play a task. Errors of the document, or while it is played, are in the row."""
        try:
            realization = play([task.text], self.options, self._speaker)
            suffixes = self.options.formats if realization.has_content else ()
            files = {
                f"{task.name}{suffix}": OUTPUTS[suffix].encode(realization, self._settings_for(suffix))
                for suffix in suffixes
            }
        except Exception as error:
            words = str(error) if isinstance(error, RealizerError) else f"{type(error).__name__}: {error}"
            return failure(task, words)
        row = {
            "document": task.name,
            "key": task.key,
            "status": "done" if _is_done(realization) else "refused",
            "duration": round(realization.duration, 6),
            "frames": realization.frames,
            "characters": [name or "" for name in realization.characters],
            "dropped": [id for schedule in realization.schedules for id in schedule.dropped],
            "warnings": [warning.to_json() for warning in realization.warnings],
            "outputs": {
                suffix: {"file": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
                for suffix, (name, content) in zip(suffixes, files.items(), strict=True)
            },
        }
        return Outcome(row, files)

    def close(self) -> None:
        """Close the voice and the renderers."""
        self._speaker.close()
        for renderer in self._renderers.values():
            renderer.close()

    def _settings_for(self, suffix: str) -> RenderSettings:
        """Return the settings of an output, with a renderer that stays open."""
        if suffix not in self._render_settings:
            o = self.options
            settings = RenderSettings(o.size, o.camera, light=o.light, background=o.background)
            picture_size = OUTPUTS[suffix].picture_size
            if picture_size is not None:
                size, alpha = picture_size(settings)
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
                settings = replace(settings, renderer=self._renderers[size, alpha])
            self._render_settings[suffix] = settings
        return self._render_settings[suffix]


def _is_done(realization: Realization) -> bool:
    played = realization.has_content and not realization.plays_nothing
    return played and not realization.refusals


# The worker of this process with its fingerprint. It does one task at a time, for several threads as well.
_worker: list[tuple[Worker, str]] = []
_LOCK = threading.Lock()


def perform(options: Options, task: Task) -> Outcome:
    """Do a task in this process, which may be on another machine than the one that made the task."""
    with _LOCK:
        if not _worker or _worker[0][0].options != options:
            for worker, _ in _worker:
                worker.close()
            _worker[:] = [(Worker(options), fingerprint(options))]
        worker, mark = _worker[0]
        if mark != task.fingerprint:
            return failure(
                task,
                f"the machine that played it has another realizer, face, voice or file: fingerprint "
                f"{mark[:12]}, wanted {task.fingerprint[:12]}; install the same there",
            )
        return worker.perform(task)
