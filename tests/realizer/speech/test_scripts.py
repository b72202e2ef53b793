"""Tests of the scripts of languages."""

import pytest

from realizer.speech.scripts import foreign_script


@pytest.mark.parametrize(
    ("text", "language", "script"),
    [
        ("Hello there.", "en-US", None),
        ("你好,很高兴见到你。", "en-US", "CJK"),
        ("你好,很高兴见到你。", "cmn", None),
        ("Привет, как дела?", "en-GB", "CYRILLIC"),
        ("Привет, как дела?", "ru-RU", None),
        ("これはペンです", "cmn", "HIRAGANA"),
        ("The area is π times the square.", "en", None),
        ("Hello there.", "ru", None),
        ("12 + 3", "en", None),
        ("", "en", None),
    ],
)
def test_foreign_script_is_that_of_most_letters(text: str, language: str, script: str | None) -> None:
    assert foreign_script(text, language) == script
