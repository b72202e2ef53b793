"""Tests of `realizer.enrich`."""

from pathlib import Path

import pytest

import realizer
from bml_schema import BMLError, parse
from bml_schema.extensions import Expression
from realizer.behaviours.registry import VOCABULARY

SPEECH = '<bml id="a"><speech id="s"><text>Really?</text></speech></bml>'


def placed(bml: str) -> dict[str, str]:
    return {n.id: str(n.syncs["start"]) for n in parse(bml).behaviours if isinstance(n, Expression)}


def test_enrich_turns_a_text_into_bml() -> None:
    assert placed(realizer.enrich("Are you sure?")) == {"surprise1": "speech1:w1"}


@pytest.mark.parametrize("source", [SPEECH, SPEECH.encode(), SPEECH.encode("utf-16")])
def test_enrich_adds_expressions_to_a_document(source: str | bytes) -> None:
    assert placed(realizer.enrich(source)) == {"surprise1": "s:w1"}


def test_enrich_reads_a_file(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("Nonsense!")
    for text in (tmp_path / "a.txt", str(tmp_path / "a.txt")):
        assert placed(realizer.enrich(text)) == {"anger1": "speech1:w1"}
    with pytest.raises(FileNotFoundError):
        realizer.enrich("no.txt")


def test_enrich_takes_a_role_and_a_mood() -> None:
    assert "speech" not in realizer.enrich("Really?", role="listener")
    assert realizer.enrich("Really?", mood="sad") != realizer.enrich("Really?", mood="happy")


@pytest.mark.parametrize("options", [{"role": "singer"}, {"mood": "purple"}])
def test_enrich_refuses_unknown_words(options: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="wanted"):
        realizer.enrich("Hi.", **options)  # type: ignore[arg-type]


def test_enrich_refuses_what_is_no_text() -> None:
    with pytest.raises(TypeError, match="got int"):
        realizer.enrich(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="only blanks"):
        realizer.enrich("  ")
    with pytest.raises(BMLError, match="line 1"):
        realizer.enrich("<bml/>")


def test_enrich_reads_a_text_as_people_mean_it() -> None:
    text = realizer.enrich("**Great**, it costs $5!")
    assert "Great" in text
    assert "five dollars" in text
    assert "*" not in text
    assert 'lexeme="NOD"' in realizer.enrich("Great [nod] news!")
    assert "**" in realizer.enrich("**Great** news!", plain=True)


@pytest.mark.parametrize("text", ["Hi <company>.", "[nod] Really?\n```\ncode\n```", "[nod]\n```\ncode\n```"])
def test_enrich_reports_what_is_left_out_and_does_not_write_it(
    text: str, caplog: pytest.LogCaptureFixture
) -> None:
    bml = realizer.enrich(text)
    (warning,) = caplog.messages
    assert "<company>" in warning or "a block of code is not spoken" in warning
    assert "unsaid" not in bml
    assert parse(bml, VOCABULARY).problems == ()


def test_enrich_refuses_a_text_without_words() -> None:
    with pytest.raises(ValueError, match="nothing that can be spoken"):
        realizer.enrich("```\nonly code\n```")
