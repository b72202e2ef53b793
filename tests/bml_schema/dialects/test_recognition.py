"""Tests of the recognition of words of dialects."""

import pytest

from bml_schema import Block, BMLError, parse, read
from bml_schema.dialects.recognition import has_words_of_dialects
from tests.cases import CASES


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ('<head id="h" lexeme="Down_Aside_Left"/>', True),
        ('<head id="h" lexeme="down_aside_left"/>', True),
        ('<faceLexeme id="f" lexeme="Eyebrows_Raise"/>', True),
        ('<face id="f"><faceLexeme lexeme="joyStrong"/></face>', True),
        ('<gaze id="g" target="x" q:joint-range="EYES" xmlns:q="http://ict.usc.edu"/>', True),
        ('<head id="h" lexeme="NOD"/><gaze id="g" target="user"/>', False),
        ('<face id="f"><faceLexeme lexeme="SADNESS"/></face><faceLexeme id="g" lexeme="joy"/>', False),
        ('<head id="h" lexeme="DOWN_LEFT"/><head id="t" lexeme="TILT_LEFT"/>', False),
        ('<speech id="s"><text>What type of event is it?</text></speech>', False),
    ],
)
def test_has_words_of_dialects_knows_lexemes_of_others(body: str, wanted: bool) -> None:
    block = parse(f'<bml id="b">{body}</bml>', strict_bml=True)
    assert has_words_of_dialects(block) is wanted
    assert bool(parse(f'<bml id="b">{body}</bml>').problems) is wanted


def test_has_words_of_dialects_finds_none_in_the_corpus() -> None:
    for case in CASES:
        for block in read(case.document, strict_bml=True):
            if not isinstance(block, BMLError) and not case.name.startswith("dialects/"):
                assert isinstance(block, Block)
                assert not has_words_of_dialects(block), case.name
