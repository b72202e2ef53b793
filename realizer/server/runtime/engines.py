"""The voices, the renderers and the other workers of the service, in threads."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from realizer.core.errors import RealizerError, RenderError, VoiceError
from realizer.core.work import FairPool
from realizer.server.session.effects import Draw, Look, RenderOptions, Sight, Speak
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.utterance import Utterance, Voice

if TYPE_CHECKING:
    from realizer.render.renderer import Renderer

# Each combination of face, size, camera, light and background has a renderer, which is a process.
RENDERERS = 6
IDLE = 5.0  # s; a renderer unused for so long makes room for another one


@dataclass(slots=True)
class _RendererSlot:
    """A renderer, and whether it is in use."""

    renderer: Renderer
    used: float  # when it drew last, seconds on the clock of `Engines`
    busy: int = 0  # number of threads that draw with it now
    begun: bool = False  # whether its process has started


class Engines:
    """The voices, the renderers and their pools of threads, which call `speak`, `draw` and `look`."""

    def __init__(self, deformer: str | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._deformer = deformer
        self._clock = clock
        # Two threads each: a long text or a starting process must not delay all other sessions.
        self.speech_pool = FairPool(2, "voice")
        self.render_pool = FairPool(2, "renderer")
        self.tracking_pool = FairPool(1, "tracking")  # its networks are for one thread
        self.file_pool = FairPool(1, "files")  # one file at a time: each is compared before it is replaced
        self._voices: dict[str | None, Voice] = {}
        self._slots: dict[tuple[str, RenderOptions], _RendererSlot] = {}
        self._begun = clock()  # when a renderer last finished starting; until then the others may have waited
        self._lock = threading.Lock()
        self._reported: set[str] = set()

    def speak(self, order: Speak) -> Utterance | RealizerError:
        """Synthesize an utterance. Return the error if the voice fails, and print it once on stderr."""
        try:
            # The name has chosen the voice here; the engine would take it for one of its own voices.
            return speak_to_length(self._voice(order.request.voice), replace(order.request, voice=None))
        except VoiceError as error:
            self._report(str(error))
            return error
        except Exception as error:
            self._report(f"{type(error).__name__}: {error}")
            return VoiceError(f"the voice failed: {error}")

    def draw(self, order: Draw) -> bytes | RealizerError:
        """Draw and encode a picture. Return the error if that fails."""
        try:
            options = order.options
            with self._renderer(order) as renderer:
                try:
                    return renderer.encoded(order.pose, options.form, options.quality)
                except RenderError:  # the next call starts the process again if it has died
                    return renderer.encoded(order.pose, options.form, options.quality)
        except RealizerError as error:
            return error
        except Exception as error:
            return RenderError(f"the picture could not be drawn: {error}")

    def look(self, order: Look) -> Sight | RealizerError | None:
        """Return what a picture shows, or the error."""
        try:
            return order.tracker(order.picture, order.time)
        except RealizerError as error:
            return error
        except Exception as error:
            return RealizerError(f"the picture could not be tracked: {error}")

    def drop(self, owner: Hashable) -> None:
        """Drop the requests of an owner that wait in the pools, except files to save."""
        for pool in (self.tracking_pool, self.speech_pool, self.render_pool):
            pool.drop(owner)

    def close(self) -> None:
        """Close all engines, and drop the requests that wait for them."""
        for pool in (self.file_pool, self.tracking_pool, self.speech_pool, self.render_pool):
            pool.close()
        for voice in self._voices.values():
            voice.close()
        for slot in self._slots.values():
            slot.renderer.close()

    def _voice(self, name: str | None) -> Voice:
        from realizer.speech.registry import find_voice

        with self._lock:
            if name not in self._voices:
                self._voices[name] = find_voice(name)
            return self._voices[name]

    @contextmanager
    def _renderer(self, order: Draw) -> Iterator[Renderer]:
        """Open the renderer of a picture, for one thread.

        Raises:
            RenderError: too many others are in use.
        """
        from realizer.render.renderer import Renderer

        options = replace(order.options, quality=0, form="jpeg")  # these need no process of their own
        key, removed = (order.face, options), None
        with self._lock:
            now = self._clock()
            slot = self._slots.get(key)
            if slot is None:
                if len(self._slots) >= RENDERERS:
                    removed = self._slots.pop(self._least_recent(now))
                look: dict[str, Any] = {"light": options.light, "background": options.background}
                renderer = Renderer(order.face, options.size, options.camera, deformer=self._deformer, **look)
                slot = self._slots[key] = _RendererSlot(renderer, now)
            slot.busy += 1
            slot.used = now
        if removed is not None:
            removed.renderer.close()
        try:
            yield slot.renderer
        finally:
            with self._lock:
                slot.busy -= 1
                slot.used = self._clock()
                if not slot.begun:
                    slot.begun, self._begun = True, slot.used

    def _least_recent(self, now: float) -> tuple[str, RenderOptions]:
        idle = {
            key: slot.used
            for key, slot in self._slots.items()
            if not slot.busy and now - max(slot.used, self._begun) >= IDLE
        }
        if not idle:
            raise RenderError(
                f"{RENDERERS} different pictures (face, size, camera, light, background) are "
                "drawn already: wanted one of them, or fewer"
            )
        return min(idle, key=lambda key: idle[key])

    def _report(self, error: str) -> None:
        if error not in self._reported:
            self._reported.add(error)
            print(f"realizer: {error}; going on without sound", file=sys.stderr)
