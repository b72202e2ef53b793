"""Clients of the service: asynchronous and synchronous."""

from realizer.client.async_client import Client
from realizer.client.connection import connect
from realizer.client.message_router import ClientError, Frame
from realizer.client.speech import Speech, SyncSpeech
from realizer.client.sync_client import SyncClient

__all__ = ["Client", "ClientError", "Frame", "Speech", "SyncClient", "SyncSpeech", "connect"]
