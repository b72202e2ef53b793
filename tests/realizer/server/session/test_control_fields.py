"""Lookup of the names in control messages."""

from __future__ import annotations

import pytest

from realizer.protocol.messages.requests import EmotionFields, SetMessage
from realizer.server.documents.limits import MAX_CHARACTERS
from realizer.server.session.control_fields import FieldError, character_index, direct_values, emotion_values


def make(**fields: object) -> SetMessage:
    return SetMessage.model_validate({"type": "set", **fields})


@pytest.mark.parametrize(
    ("message", "values"),
    [
        (make(aus={"12L": 0.5}), {"12L": 0.5}),
        (make(aus={"12": 0.5}), {"12L": 0.5, "12R": 0.5}),
        (make(aus={"25": None}), {"25": None}),
        (
            make(faps={"3": 100, "raise_l_i_eyebrow": None}),
            {"open_jaw": 100, "raise_l_i_eyebrow": None},
        ),
        (make(aus=None), {"12L": None}),
        (make(faps=None, aus={"4": 1}), {"open_jaw": None, "4L": 1.0, "4R": 1.0}),
        (make(), {}),
    ],
)
def test_direct_values_resolves_names(message: SetMessage, values: dict[str, float | None]) -> None:
    assert direct_values(message, ["12L", "open_jaw"]) == values


@pytest.mark.parametrize(
    ("message", "where", "says"),
    [
        (make(aus={"99": 0.5}), "aus", "wanted an AU number, with L or R for one side, got '99'"),
        (make(aus={"25L": 0.5}), "aus", "'25L'"),
        (make(faps={"2": 1}), "faps", "wanted the name or the number (3..68) of a FAP, got '2'"),
        (make(faps={"69": 1}), "faps", "'69'"),
        (make(faps={"\u00b3": 1}), "faps", "a FAP"),
    ],
)
def test_direct_values_names_the_field_of_an_unknown_name(message: SetMessage, where: str, says: str) -> None:
    with pytest.raises(FieldError) as wrong:
        direct_values(message, [])
    assert wrong.value.where == where
    assert says in str(wrong.value)


def test_direct_values_refuses_a_number_of_thousands_of_digits() -> None:
    for fields in ({"faps": {"9" * 5000: 1}}, {"aus": {"9" * 5000: 1}}):
        with pytest.raises(FieldError, match="wanted"):
            direct_values(make(**fields), [])


def test_emotion_values_are_the_aus_of_an_emotion() -> None:
    assert emotion_values(None) == {}
    assert emotion_values(EmotionFields(name="joy"))["12L"] > 0
    with pytest.raises(FieldError) as wrong:
        emotion_values(EmotionFields(name="nothing at all"))
    assert wrong.value.where == "emotion.name"


def test_character_index_adds_characters_up_to_the_limit(drive) -> None:
    session = drive().session
    assert [character_index(session.player.cast, name) for name in (None, "Ada", "Ben", "Ada")] == [
        0,
        0,
        1,
        0,
    ]
    for number in range(2, MAX_CHARACTERS):
        assert character_index(session.player.cast, f"c{number}") == number
    with pytest.raises(FieldError, match="wanted at most 16 characters"):
        character_index(session.player.cast, "one more")
    assert character_index(session.player.cast, "Ben") == 1
