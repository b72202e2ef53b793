"""IPA and ARPABET."""

from __future__ import annotations

import pytest

from realizer.speech.align.arpabet import to_arpabet, to_ipa


@pytest.mark.parametrize(
    ("ipa", "phones"),
    [
        (("h", "ə", "l", "oʊ"), ("HH", "AH", "L", "OW")),
        (("tʃ", "ɜː", "tʃ"), ("CH", "ER", "CH")),
        (("n", "iː", "ɹ"), ("N", "IY", "R")),
        (("ɛɹ", "aɪə"), ("EH", "R", "AY", "AH")),
        (("l̩", "ʲ", "☃"), ("L",)),
        ((), ()),
    ],
)
def test_to_arpabet_converts_the_longest_symbol_first(ipa, phones) -> None:
    assert to_arpabet(ipa) == phones


def test_to_ipa_uses_the_first_row_of_a_phone() -> None:
    assert [to_ipa(phone) for phone in ("HH", "AA", "ER", "JH", "SIL")] == ["h", "ɑ", "ɝ", "dʒ", ""]
    assert to_arpabet([to_ipa("NG"), to_ipa("OY")]) == ("NG", "OY")
