"""The pictures and the sound of a session as tracks of a WebRTC connection, and when they are sent."""

import asyncio
import math
from collections import deque
from fractions import Fraction

import av
import numpy as np
from aiortc import AudioStreamTrack, VideoStreamTrack
from aiortc.mediastreams import MediaStreamError

from realizer.protocol.wire import PictureFrame, SoundFrame
from realizer.server.streams.audio_stream import PACKET

RATE = 48000  # Hz, that of Opus
SAMPLES = round(PACKET * RATE)
PICTURE_CLOCK = 90000  # Hz
ENCODING = 0.012  # s; until pictures have shown how long it takes
AVERAGED = 10  # pictures over which this time is averaged
MOST_PICTURES = 8  # that wait; older ones are left out
MOST_BEHIND = 5  # packets
QUIET = 300  # of 32768: in a packet without louder samples the delay may change
FIRST = 0.1  # s; the delay until pictures have shown how long they take
MOST = 0.5  # s; later pictures are left out of account: lips are late, but the sound is not
LOST = 1.0  # s; the clock of the session has moved
WINDOW, EXCEPTIONS = 25, 2  # pictures after which the delay is reviewed, and those that may come later


class Playout:
    """The delay between the session's clock and what a peer is sent, the same for pictures and sound.

    Sound comes ahead of its time, and pictures when they have been drawn: the delay grows to the time that
    this takes. It changes by whole packets, and in silence, so that nobody hears it.

    Args:
        opened: seconds on the loop's clock at which the session's clock was 0.

    Attributes:
        began: seconds on the loop's clock at which the timestamps of both tracks are 0.
        offset: seconds on the loop's clock, minus seconds on the session's, at which something is sent.
    """

    def __init__(self, opened: float, now: float) -> None:
        self._opened = opened
        self.offset = opened + FIRST
        # A whole number of packets: those of the session are sent as they are.
        self.began = self.offset + math.ceil((now - self.offset) / PACKET) * PACKET
        self._lags: deque[float] = deque(maxlen=WINDOW)
        self._change = 0  # packets

    @property
    def delay(self) -> float:
        """Seconds by which everything is sent after its time."""
        return self.offset - self._opened

    def note_picture(self, time: float, now: float) -> None:
        """Note that the picture of a time of the session has come."""
        lag = now - time - self._opened
        if abs(lag) > LOST:
            self._lags.clear()
            if lag < 0:  # it comes before its time: this is another clock
                self._opened = now - time
                self.offset += round((self._opened + FIRST - self.offset) / PACKET) * PACKET
            return
        self._lags.append(lag)
        if len(self._lags) == WINDOW:
            wanted = min(MOST, sorted(self._lags)[-1 - EXCEPTIONS])
            self._change = math.ceil((wanted - self.delay) / PACKET + 0.5)  # half a packet to spare
            self._lags.clear()

    def adapt(self) -> None:
        """Change the delay if it is too short, or much too long. Call it in silence."""
        if self._change > 0 or self._change < -2:
            self.offset += self._change * PACKET
        self._change = 0


class SoundTrack(AudioStreamTrack):
    """The sound of a session, with silence between the packets; a frame every 20 ms."""

    def __init__(self, playout: Playout) -> None:
        super().__init__()
        self._playout = playout
        self._packets: dict[int, bytes] = {}
        self._latest = -1  # number of the last packet that was sent
        self._count = 0

    def put(self, packet: SoundFrame) -> None:
        """Take a packet of the stream `audio`."""
        if packet.flush:
            self._packets = {n: pcm for n, pcm in self._packets.items() if n < packet.frame}
        if packet.payload:
            self._packets[packet.frame] = packet.payload

    async def recv(self) -> av.AudioFrame:
        """Return the next 20 ms when they are due."""
        if self.readyState != "live":
            raise MediaStreamError
        loop = asyncio.get_running_loop()
        # At the start, and after a standstill: a burst of old packets would fill the peer's jitter buffer.
        behind = (loop.time() - self._playout.began) / PACKET - self._count
        self._count += math.ceil(behind) if behind > MOST_BEHIND else 0
        due = self._playout.began + self._count * PACKET
        await asyncio.sleep(due - loop.time())
        number = round((due - self._playout.offset) / PACKET)
        pcm = self._packets.get(number) if number > self._latest else None
        self._latest = max(number, self._latest)
        self._packets = {n: waiting for n, waiting in self._packets.items() if n > number}
        samples = np.zeros(SAMPLES, np.int16) if pcm is None else np.frombuffer(pcm, "<i2")
        if np.abs(samples.astype(np.int32)).max() < QUIET:
            self._playout.adapt()
        frame = av.AudioFrame.from_ndarray(samples[None], format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = RATE, self._count * SAMPLES, Fraction(1, RATE)
        self._count += 1
        return frame


class PictureTrack(VideoStreamTrack):
    """The pictures of a session, each sent when its sound is.

    A receiver plays together what left together, so pictures are encoded before their time.
    """

    def __init__(self, playout: Playout) -> None:
        super().__init__()
        self._playout = playout
        self._pictures: deque[tuple[float, bytes]] = deque(maxlen=MOST_PICTURES)
        self._came = asyncio.Event()
        self._pts = -1
        self._encoding = ENCODING
        self._taken = 0.0  # when the last picture was
        self._decoder = av.CodecContext.create("mjpeg", "r")

    def put(self, picture: PictureFrame) -> None:
        """Take a JPEG of the stream `video`."""
        self._playout.note_picture(picture.time, asyncio.get_running_loop().time() + self._encoding)
        self._pictures.append((picture.time, picture.payload))
        self._came.set()

    async def recv(self) -> av.VideoFrame:
        """Return the newest picture that is due; wait for it. Its caller has sent the one before."""
        loop = asyncio.get_running_loop()
        if self._pts >= 0:
            self._encoding += (loop.time() - self._taken - self._encoding) / AVERAGED
        while True:
            if self.readyState != "live":
                raise MediaStreamError
            if not self._pictures:
                self._came.clear()
                await self._came.wait()
                continue
            time, jpeg = self._pictures.popleft()
            await asyncio.sleep(self._due(time) - loop.time())
            if self._pictures and self._due(self._pictures[0][0]) <= loop.time():
                continue
            pts = round((time + self._playout.offset - self._playout.began) * PICTURE_CLOCK)
            if pts > self._pts:
                break
        self._taken = loop.time()
        (frame,) = await loop.run_in_executor(None, self._decoder.decode, av.Packet(jpeg))
        frame.pts, frame.time_base, self._pts = pts, Fraction(1, PICTURE_CLOCK), pts
        return frame

    def stop(self) -> None:
        """End the track."""
        super().stop()
        self._came.set()

    def _due(self, time: float) -> float:
        return time + self._playout.offset - self._encoding
