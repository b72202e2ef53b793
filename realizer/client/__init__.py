"""Clients of the service: asynchronous and synchronous."""

from realizer.client.async_client import Client
from realizer.client.errors import ClientError
from realizer.client.message_router import Frame
from realizer.client.opening import connect
from realizer.client.speech import Speech
from realizer.client.sync_client import SyncClient, SyncSpeech, SyncVoice
from realizer.client.voice import Voice
from realizer.protocol.wire import ArkitFrame, AUFrame, FapFrame, MeshFrame, PictureFrame, SoundFrame

__all__ = [
    "AUFrame", "ArkitFrame", "Client", "ClientError", "FapFrame", "Frame", "MeshFrame", "PictureFrame",
    "SoundFrame", "Speech", "SyncClient", "SyncSpeech", "SyncVoice", "Voice", "connect",
]  # fmt: skip
