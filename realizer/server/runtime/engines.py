"""Voices and renderers in threads; they answer the effects Speak and Draw."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from realizer.core.errors import RealizerError, RenderError, VoiceError
from realizer.server.session.effects import Draw, RenderOptions, Speak
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.utterance import Utterance, Voice

if TYPE_CHECKING:
    from realizer.render import Renderer

# Pictures of different faces, sizes, cameras, lights and backgrounds each have a process: so many at a time.
RENDERERS = 6
# One that nobody has looked at for so long makes room for another one.
IDLE = 5.0  # s


@dataclass(slots=True)
class _RendererSlot:
    """A renderer, how many draw with it just now, and when one last did."""

    renderer: Renderer
    used: float
    busy: int = 0
    begun: bool = False


class Engines:
    """The engines. `speech_pool` and `render_pool` are the threads that may call `speak` and `draw`.

    Args:
        deformer: what moves faces, in spite of what they say themselves.
        clock: seconds that only rise.
    """

    def __init__(self, deformer: str | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._deformer = deformer
        self._clock = clock
        # Two texts can be spoken at a time: one long text must not hold up the short ones of all others.
        self.speech_pool = ThreadPoolExecutor(2, "voice")
        # And a process that starts must not hold up the pictures of all others.
        self.render_pool = ThreadPoolExecutor(2, "renderer")
        self._voices: dict[str | None, Voice] = {}
        self._slots: dict[tuple[str, RenderOptions], _RendererSlot] = {}
        self._begun = clock()  # when one last had started: all the others waited for their turn until then
        self._lock = threading.Lock()
        self._reported: set[str] = set()

    def speak(self, order: Speak) -> Utterance | RealizerError:
        """What a voice made of it; or why it could not, which is also said once on stderr."""
        try:
            # The name is the whole of what chooses the voice; an engine would take it for one of its own.
            return speak_to_length(self._voice(order.request.voice), replace(order.request, voice=None))
        except VoiceError as error:
            self._report(str(error))
            return error
        except Exception as error:
            self._report(f"{type(error).__name__}: {error}")
            return VoiceError(f"the voice failed: {error}")

    def draw(self, order: Draw) -> bytes | RealizerError:
        """Bytes of the picture; or why there are none."""
        try:
            place, look = self._acquire(order), order.options
            try:
                try:
                    return place.renderer.encoded(order.pose, look.form, look.quality)
                except RenderError:
                    # A process that died is started anew by the next call; one that cannot fails again.
                    return place.renderer.encoded(order.pose, look.form, look.quality)
            finally:
                self._release(place)
        except RealizerError as error:
            return error
        except Exception as error:
            return RenderError(f"the picture could not be drawn: {error}")

    def close(self) -> None:
        """End all engines; what waits for them is dropped."""
        self.speech_pool.shutdown(wait=False, cancel_futures=True)
        self.render_pool.shutdown(wait=False, cancel_futures=True)
        for voice in self._voices.values():
            voice.close()
        for place in self._slots.values():
            place.renderer.close()

    def _voice(self, name: str | None) -> Voice:
        from realizer.speech.registry import find_voice

        with self._lock:
            if name not in self._voices:
                self._voices[name] = find_voice(name)
            return self._voices[name]

    def _acquire(self, order: Draw) -> _RendererSlot:
        """The renderer of a face and a look, until `_release`.

        Raises:
            RenderError: there are too many that somebody looks at.
        """
        from realizer.render import Renderer

        look = replace(order.options, quality=0, form="jpeg")  # which need no other process
        key, left = (order.face, look), None
        with self._lock:
            now = self._clock()
            place = self._slots.get(key)
            if place is None:
                if len(self._slots) >= RENDERERS:
                    left = self._slots.pop(self._least_recent(now))
                place = self._slots[key] = _RendererSlot(
                    Renderer(
                        order.face,
                        look.size,
                        look.camera,
                        light=look.light,
                        background=look.background,
                        deformer=self._deformer,
                    ),
                    now,
                )
            place.busy += 1
            place.used = now
        if left is not None:
            left.renderer.close()
        return place

    def _least_recent(self, now: float) -> tuple[str, RenderOptions]:
        """Of what nobody has looked at for a while, that of the longest ago.

        Raises:
            RenderError: somebody looks at all of them.
        """
        unseen = [
            (place.used, key)
            for key, place in self._slots.items()
            if not place.busy and now - max(place.used, self._begun) >= IDLE
        ]
        if not unseen:
            raise RenderError(
                f"{RENDERERS} different pictures (face, size, camera, light, background) are "
                "drawn already: wanted one of them, or fewer"
            )
        return min(unseen, key=lambda one: one[0])[1]

    def _release(self, place: _RendererSlot) -> None:
        with self._lock:
            place.busy -= 1
            place.used = self._clock()
            if not place.begun:
                place.begun, self._begun = True, place.used

    def _report(self, fault: str) -> None:
        if fault not in self._reported:
            self._reported.add(fault)
            print(f"realizer: {fault}; going on without sound", file=sys.stderr)
