"""The asynchronous client."""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Unpack

from bml_schema.feedback import BlockProgress, Feedback
from realizer.client.block_waiters import BlockEnd, BlockWaiter, BlockWaiters, is_control
from realizer.client.connection import Connection, address_of
from realizer.client.errors import ClientError, ClosedError
from realizer.client.message_router import Frame
from realizer.client.speech import Speech
from realizer.client.stream_options import (
    FrameOptions,
    PictureOptions,
    SoundOptions,
    SpeechOptions,
    TextOptions,
)
from realizer.client.subscriptions import play_out, take, take_subscribed
from realizer.client.voice import OnWord, Pcm, Timed, Voice, content_of, timed
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import ArkitFrame, AUFrame, FapFrame, MeshFrame, PictureFrame, SoundFrame


class Client:
    """An open connection, which `connect` returns. Several tasks may use it at once."""

    def __init__(
        self, connection: Connection, connect: Callable[[str], contextlib.AbstractAsyncContextManager[Client]]
    ) -> None:
        self._connection = connection
        self._connect = connect  # opens another connection to an address of the same service
        self._router = connection.router
        self._speeches: dict[str, Speech] = {}  # the latest of each id

    @property
    def url(self) -> str:
        """The address of the connection."""
        return self._connection.url

    @property
    def welcome(self) -> Mapping[str, Any]:
        """The first message of the service: session, version, capabilities, limits."""
        return self._router.welcome

    @property
    def session(self) -> str:
        """The name of the session, which other clients may join."""
        return str(self.welcome["session"])

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Errors that no method raises, such as those of a stream of pictures that ended."""
        return list(self._router.errors)

    @property
    def left_out(self) -> Mapping[str, int]:
        """Stream -> number of frames that `faps`, `aus` and `arkit` left out, as they were long past."""
        return self._router.left_out

    async def send(self, bml: str) -> None:
        """Send one or more BML documents.

        Raises:
            ClientError: the connection has ended.
        """
        self._router.on_sent(bml)
        await self._connection.post(bml)

    async def control(self, /, type: str, **fields: Any) -> None:
        """Send a control message, such as `stop` or `scene`, and wait until the service has taken it.

        Raises:
            ClientError: the service refused it, or the connection has ended.
        """
        await self._connection.ask(type, **fields)

    async def ask(self, /, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and return its answer: to hello, subscribe, state, ping, save.

        Others have none: an empty dictionary is returned once the service has taken them.

        Raises:
            ClientError: the service answered with an error, or the connection has ended.
        """
        return await self._connection.ask(type, **fields)

    async def subscribe(self, /, stream: str, **fields: Any) -> dict[str, Any]:
        """Subscribe to a stream, a key of `welcome["capabilities"]["streams"]`, and return its description.

        Raises:
            ClientError: there is no such stream, or it is not available.
        """
        return await self.ask("subscribe", stream=stream, **fields)

    async def state(self) -> dict[str, Any]:
        """Return the state of the session: its blocks, and the action units with their sources."""
        return await self.ask("state")

    async def play(self, bml: str) -> BlockEnd:
        """Send BML, wait for the end of its last block, and return that.

        Its `warnings` say what was dropped or changed, and `shown` is False if nothing was heard or moved
        though something was asked for. Both are logged, too.

        Raises:
            ClientError: the block was refused, or the connection ended.
            TypeError: `bml` is no string.
        """
        block = await self.send_and_follow(bml)
        await self.wait_for(lambda: block.is_finished)
        return block.end()

    async def send_and_follow(self, bml: str) -> BlockWaiter:
        """Send BML and return a waiter, which follows the start and the end of its last block.

        Raises:
            ClientError: the text is blank or a control message, or the connection has ended.
        """
        block = self._router.on_sent(bml)
        if block is None:
            got = "a control message, which `control` and `ask` send" if is_control(bml) else "nothing"
            raise ClientError(f"wanted <bml>, got {got}", "refused")
        await self._connection.post(bml)
        return block

    async def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds. It is checked after each message of the service.

        Raises:
            ClientError: the connection ended first, also because a message could not be read.
        """
        await self._connection.wait_for(condition)

    def speech(self, id: str, **opening: Any) -> Speech:
        """Return a speech whose text is streamed: `async with client.speech("s") as speech`.

        Leaving the block closes the speech without waiting for its end; an exception stops it.

        Args:
            id: id of the speech and of its block; other blocks refer to a sync of its text as `ID:ID:sync`.
            opening: composition, character, language and plain, as in the message `speech`.
        """
        speech = Speech(id, opening, self._connection.control, self.wait_for, self._connection.check)
        speech.earlier, self._speeches[id] = self._speeches.get(id), speech
        self._router.waiters.add(speech.progress)
        return speech

    def voice(
        self,
        *,
        rate: int,
        language: str | None = None,
        on_word: OnWord | None = None,
        **opening: Unpack[SpeechOptions],
    ) -> Voice:
        """Return a speech whose sound is sent as it comes: write(pcm), words([...]), close(), ended().

        Without words, lips follow the sound.

        Args:
            rate: samples a second.
            language: BCP-47 tag of the words; None: the service's.
            on_word: called with each word when it is spoken: start, end, text as given, and `time` on the
                session clock.
        """
        fields = opening if language is None else {**opening, "language": language}
        voice = Voice(rate, fields, self._connection.post, self._connection.control, self.wait_for, on_word)
        self._router.waiters.add(voice.progress)
        return voice

    async def speak(self, text: str, **opening: Unpack[TextOptions]) -> BlockEnd:
        """Speak a text and return its end; `said` are the words that were spoken, if it was cut off.

        Markdown, stage directions, emoji and numbers are read as people mean them; SSML and behaviours stay
        what they are.

        Args:
            opening: id of the block, composition, character, language, and `plain` for a text without all
                that, as in the message `speech`.

        Raises:
            ClientError: the service refuses it, or the connection has ended.
        """
        fields: dict[str, Any] = {"id": f"speak-{secrets.token_hex(6)}", **opening}
        speech = self.speech(**fields)
        await speech.append(text)
        await speech.close()
        return await speech.ended()

    async def say(
        self,
        sound: Pcm,
        rate: int | None = None,
        text: str | None = None,
        words: Iterable[Timed] | None = None,
        phonemes: Iterable[Timed] | None = None,
        visemes: Iterable[Timed] | None = None,
        language: str | None = None,
        viseme_set: str = "oculus",
        on_word: OnWord | None = None,
        **opening: Unpack[SpeechOptions],
    ) -> BlockEnd:
        """Play the sound of any other voice, and return its end; `said` are the words, if it was cut off.

        Without words, phonemes and visemes, lips follow the text, or the sound alone.

        Args:
            sound: a WAV, FLAC, MP3, Ogg or WebM file; with `rate` mono PCM: int16, or floats from -1 to 1.
            rate: samples a second of PCM.
            text: what is said.
            words, phonemes, visemes: (seconds, text), (start, end, text) or a dictionary with start, end and
                text of each; phonemes in IPA.
            language: BCP-47 tag of the text and the words; None: the service's.
            viseme_set: oculus, mpeg4, sapi or polly.
            on_word: as of `voice`.

        Raises:
            TypeError, ValueError: an argument has another form.
            ClientError: the service refuses it, or the connection has ended.
        """
        content = content_of(sound, rate)
        voice = self.voice(rate=1 if rate is None else rate, language=language, on_word=on_word, **opening)
        lists = {"words": words, "phonemes": phonemes, "visemes": visemes}
        described: dict[str, Any] = {name: timed(name, v) for name, v in lists.items() if v is not None}
        described |= {"text": text} if text is not None else {}
        described |= {"viseme_set": viseme_set} if visemes is not None else {}
        voice.expect_words(described.get("words", []))
        await voice.clip(content, rate or 0, close=True, **described)
        return await voice.ended()

    async def feedback(self) -> AsyncIterator[Feedback]:
        """Yield feedback as it arrives, until `close`; each message to one iterator only.

        Raises:
            ClientError: the connection was lost.
        """
        with contextlib.suppress(ClosedError):
            while True:
                await self.wait_for(lambda: bool(self._router.feedback))
                yield self._router.take_feedback()

    async def until_end(self, block: str | None = None) -> AsyncIterator[Feedback]:
        """Yield feedback up to the end, or the refusal, of a block: by default of the last one sent.

        Args:
            block: an id. Another client may send this block, also later: this waits until one ends.

        Raises:
            ClientError: the connection was lost before that.
            ValueError: nothing was sent, so that there is no last block.
        """
        waiter = self._router.last_sent if block is None else BlockWaiter(block, is_acknowledged=True)
        if waiter is None:
            raise ValueError("block: wanted an id, because no BML was sent last")
        # What was sent is followed already.
        waiters, queue = BlockWaiters() if block is None else BlockWaiters(waiter), self._router.feedback
        with contextlib.suppress(ClosedError):
            while True:
                await self.wait_for(lambda: bool(queue) or waiter.is_finished)
                if not queue:
                    waiter.check()
                    return  # its end was taken from the queue before
                feedback = self._router.take_feedback()
                yield feedback
                waiters.on_feedback(feedback)
                if feedback is waiter.last:
                    return

    def frames(self, stream: str) -> AsyncIterator[Frame]:
        """Yield frames of a stream as they arrive, until `close`: WireFrame, or a dictionary for JSON.

        The attribute `stream_info` of a WireFrame describes its stream at that time. It changes when the
        character of a mesh gets another face, and `vertices` depends on it.

        Raises:
            ClientError: the connection was lost.
            ValueError: there is no such stream.
        """
        names = [name for name in STREAMS if name != "feedback"]
        if stream not in names:
            raise ValueError(f"stream: wanted one of {', '.join(names)}; got {stream!r}")
        return take(self._connection, self._router.queue_of(stream))

    def faps(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[FapFrame]:
        """Subscribe to FAPs, and yield each frame at its time.

        Args:
            ahead: how long before their time the service sends frames, 0 to 2 s: longer delays are noticed.

        Raises:
            ClientError: the service refuses the subscription, or the connection was lost.
        """
        return play_out(self._connection, "fap", ahead, options)

    def aus(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[AUFrame]:
        """Subscribe to action units, and yield each frame at its time, as `faps`."""
        return play_out(self._connection, "au", ahead, options)

    def arkit(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[ArkitFrame]:
        """Subscribe to ARKit's weights and rotations, and yield each frame at its time, as `faps`."""
        return play_out(self._connection, "arkit", ahead, options)

    def mesh(self, **options: Unpack[FrameOptions]) -> AsyncIterator[MeshFrame]:
        """Subscribe to the vertices of the face, and yield frames as they arrive. Errors as `faps`."""
        return take_subscribed(self._connection, "mesh", options)

    def pictures(self, **options: Unpack[PictureOptions]) -> AsyncIterator[PictureFrame]:
        """Subscribe to pictures, and yield them as they arrive. Errors as `faps`."""
        return take_subscribed(self._connection, "video", options)

    def sound(self, **options: Unpack[SoundOptions]) -> AsyncIterator[SoundFrame]:
        """Subscribe to sound, and yield packets as they arrive, at most 0.1 s ahead. Errors as `faps`."""
        return take_subscribed(self._connection, "audio", options)

    async def film(self, /, path: str | Path, bml: str, *, fps: float = 25, **look: Any) -> BlockProgress:
        """Play BML and save its last block as a film with sound (.mp4, .webm).

        The service draws live, so the film repeats a picture if the next one was not drawn in time. `realizer
        realize` draws all pictures.

        Args:
            look: size, camera, light, background, character, as in `subscribe` for video.

        Raises:
            ClientError: the block was refused, there are no pictures, or the suffix is not that of a film.
            FileNotFoundError: the folder does not exist; nothing is played.
            RealizerError: PyAV is not installed.
        """
        from realizer.client.record import record

        # Another connection, so that the subscriptions of this one stay as they are.
        url = address_of(self.url, session=self.session)
        return await record(self._connect(url), Path(path), bml, fps, look)

    async def close(self) -> None:
        """Close the connection, which ends the iterations over feedback and frames."""
        await self._connection.close()
