"""A client of the service: BML out, feedback, frames and films in; `async with` or plain `with`."""

from realizer.client.connecting import connect
from realizer.client.live import Client
from realizer.client.mail import ClientError, Frame
from realizer.client.plain import SyncClient
from realizer.client.speech import Speech, SyncSpeech

__all__ = ["Client", "ClientError", "Frame", "Speech", "SyncClient", "SyncSpeech", "connect"]
