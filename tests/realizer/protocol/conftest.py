"""A session to drive, as the tests of the server have it."""

from tests.realizer.server.conftest import driver

__all__ = ["driver"]
