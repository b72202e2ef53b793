"""The pictures and the sound of a session as tracks of a WebRTC connection."""

import asyncio
import math
from collections import deque
from fractions import Fraction

import av
import numpy as np
from aiortc import AudioStreamTrack, VideoStreamTrack
from aiortc.mediastreams import MediaStreamError

from realizer.protocol.wire import PictureFrame, SoundFrame
from realizer.server.asgi.playout import Playout
from realizer.server.streams.audio_stream import PACKET

RATE = 48000  # Hz, that of Opus
SAMPLES = round(PACKET * RATE)
PICTURE_CLOCK = 90000  # Hz
ENCODING = 0.012  # s; until pictures have shown how long it takes
SLOWNESS = 10  # pictures over which this time is averaged
MOST_PICTURES = 8  # that wait; older ones are left out
MOST_BEHIND = 5  # packets
QUIET = 300  # of 32768: in a packet without louder samples the delay may change


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
            self._encoding += (loop.time() - self._taken - self._encoding) / SLOWNESS
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
