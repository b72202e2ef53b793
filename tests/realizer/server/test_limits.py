"""What is beyond a limit, and the words that say which one and where it is set."""

from __future__ import annotations

from dataclasses import fields

import pytest

from bml_schema import Block, parse
from realizer.behaviours import VOCABULARY
from realizer.server.limits import MAX_CHARACTERS, beyond, too_many_pixels
from realizer.settings import Settings

SPEECH = '<bml id="b"><speech id="s"><text>{}</text></speech></bml>'
SSML = (
    '<bml id="b"><speech id="s"><text>Oh</text>'
    '<description priority="1" type="application/ssml+xml"><speak>{}</speak></description></speech></bml>'
)


def block(text: str) -> Block:
    return parse(text, VOCABULARY)


@pytest.mark.parametrize(
    ("limits", "text", "busy", "says"),
    [
        ({"max_behaviours": 2}, '<bml id="b"><wait id="a"/><wait id="c"/><wait id="d"/></bml>', 0, "got 3"),
        ({"max_speech": 20}, SPEECH.format("Hello " * 4), 0, "at most 20 characters in one speech, got 24"),
        ({"max_speech": 60}, SSML.format("Hello " * 20), 0, "at most 60 characters in one speech"),
        ({"max_blocks": 2}, '<bml id="b"/>', 2, "2 blocks play or wait: wanted fewer at a time"),
    ],
)
def test_a_refusal_says_which_limit_what_came_and_where_it_is_set(
    limits: dict[str, int], text: str, busy: int, says: str
) -> None:
    words = beyond(block(text), Settings(**limits), busy, ())
    assert words is not None
    assert says in words
    (name,) = limits
    assert words.endswith(f"(REALIZER_{name.upper()} sets it)")
    assert beyond(block(text), Settings(), busy, ()) is None


def test_the_last_character_that_has_room_comes_in_and_no_other() -> None:
    crowd = [f"c{k}" for k in range(MAX_CHARACTERS)]
    known, new = (block(f'<bml id="b" characterId="{name}"/>') for name in ("c3", "another"))
    assert beyond(new, Settings(), 0, crowd[:-1]) is None
    assert beyond(known, Settings(), 0, crowd) is None
    assert beyond(new, Settings(), 0, crowd) == f"wanted at most {MAX_CHARACTERS} characters in a session"


def test_large_pictures_are_drawn_at_a_low_rate_only() -> None:
    settings = Settings(max_pixels=1e6)
    assert too_many_pixels((200, 200), 25.0, settings) is None
    words = too_many_pixels((201, 200), 25.0, settings)
    assert words is not None
    assert "201x200 at 25 fps (REALIZER_MAX_PIXELS sets it)" in words


def test_every_limit_has_words_of_its_own_in_the_settings() -> None:
    says = {f.name: f.metadata["says"] for f in fields(Settings) if f.name.startswith("max_")}
    assert len(says) == len(set(says.values())) >= 11
