"""A service as an ASGI application."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture(scope="module")
def place() -> Iterator[str]:
    """The address of a service, without the scheme."""
    from realizer.asgi import create_app
    from realizer.core.settings import Settings
    from tests.realizer.asgi.served import serving

    with serving(create_app(Settings(voice="silent", max_document=20_000, max_duration=20))) as place:
        yield place


@pytest.fixture
def http(place: str) -> Iterator[Any]:
    from tests.realizer.asgi.served import LIMIT, httpx

    with httpx.Client(base_url=f"http://{place}", timeout=LIMIT) as http:
        yield http
