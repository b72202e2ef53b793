"""Tests of values of dialects."""

from typing import Any

import pytest
from lxml import etree

from bml_schema.dialects.values import FUNCTIONS, language_tag
from tests.rows import each_row


@each_row(
    "function, element, value, wanted",
    [
        ("amount", "<head/>", "0.5", None),
        ("amount", "<head/>", "-0.02", {"amount": "0.02"}),
        ("amount", "<head/>", "5.0", {"amount": "1"}),
        ("repeats", "<head/>", "0.5", {"repetition": "1"}),
        ("repeats", "<head/>", "2.0", {"repetition": "2"}),
        ("repeats", "<head/>", "many", {"repetition": "1"}),
        ("repeats", "<head/>", "9" * 30, {"repetition": "100"}),
        ("toss", "<head amount='0.2'/>", "TOSS", {"lexeme": "TILT_LEFT"}),
        ("toss", "<head amount='-0.2'/>", "TOSS", {"lexeme": "TILT_RIGHT"}),
        ("parameterized", "<head/>", "PARAMETERIZED", {"lexeme": "TILT_LEFT"}),
        ("parameterized", "<head x='-30'/>", "PARAMETERIZED", {"lexeme": "TILT_LEFT"}),
        ("parameterized", "<head x='20'/>", "PARAMETERIZED", {"lexeme": "TILT_RIGHT"}),
        ("orient", "<head direction='upleft'/>", "ORIENT", {"lexeme": "UP_LEFT"}),
        ("orient", "<head direction='ROLLRIGHT'/>", "ORIENT", {"lexeme": "TILT_RIGHT"}),
        ("orient", "<head/>", "ORIENT", {"lexeme": "UP"}),
        ("direction", "<gaze direction='LEFT'/>", "LEFT", {"offsetDirection": "LEFT"}),
        ("direction", "<gaze offsetDirection='UP_LEFT'/>", "UP_LEFT", {"offsetDirection": "UPLEFT"}),
        ("direction", "<gaze offsetDirection='UPLEFT'/>", "UPLEFT", None),
        ("direction", "<gaze offsetDirection='SIDEWAYS'/>", "SIDEWAYS", None),
        ("joints", "<gaze/>", "EYES", {"influence": "EYES"}),
        ("joints", "<gaze/>", "EYES CHEST", {"influence": "SHOULDER"}),
        ("joints", "<gaze/>", "back eyes", {"influence": "WAIST"}),
        ("joints", "<gaze/>", "OPTICAL CERVICAL", {"influence": "NECK"}),
        ("joints", "<gaze/>", "l_shoulder", {}),
        (
            "saccade",
            "<saccade magnitude='10'/>",
            "-45",
            {"offsetDirection": "DOWNRIGHT", "offsetAngle": "10"},
        ),
        ("saccade", "<saccade/>", "91", {"offsetDirection": "UP", "offsetAngle": "15"}),
        ("au", "<lexeme/>", "AU26", {"au": "26"}),
        ("au", "<lexeme/>", "au_4", {"au": "4"}),
    ],
)
def test_function_gives_attributes_of_bml(
    function: str, element: str, value: str, wanted: dict[str, str] | None
) -> None:
    parsed: Any = etree.fromstring(element)
    assert FUNCTIONS[function](parsed, value) == wanted


@pytest.mark.parametrize(
    ("name", "tag"),
    [
        ("english", "en"),
        ("French", "fr"),
        ("en-GB", "en-GB"),
        ("ja-JP", "ja-JP"),
        ("klingonese", ""),
        ("", ""),
    ],
)
def test_language_tag_is_bcp_47(name: str, tag: str) -> None:
    assert language_tag(name) == tag
