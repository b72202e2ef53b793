"""The error of the clients."""

from __future__ import annotations

import pytest

from realizer.client.errors import ClientError


@pytest.mark.parametrize(
    ("place", "text"), [({"where": "set.aus"}, "set.aus: wanted another"), ({}, "wanted another")]
)
def test_client_error_has_the_code_and_the_place_of_the_message(place: dict[str, str], text: str) -> None:
    error = ClientError.of({"type": "error", "code": "invalid", "message": "wanted another", **place})
    assert (str(error), error.code) == (text, "invalid")
