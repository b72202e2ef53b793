"""`realizer enrich` as its user sees it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bml_schema import read
from realizer.cli import cli

DOCUMENT = (
    '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="{}"><speech id="s"><text>Really?</text>{}'
    "</speech></bml>"
)


def enrich(*arguments: str, stdin: str = "") -> Result:
    return CliRunner().invoke(cli, ["enrich", *arguments], input=stdin, standalone_mode=False)


def starts(text: str) -> dict[str, str]:
    """Block:behaviour -> start of what was placed."""
    return {
        f"{block.id}:{node.id}": str(node.syncs["start"])
        for block in read(text)
        for node in block.behaviours
        if getattr(node, "because", "")
    }


def test_a_text_goes_in_and_a_document_comes_out() -> None:
    done = enrich("Are you sure?")
    assert done.return_value == 0
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}


def test_documents_of_a_file_keep_their_names(tmp_path: Path) -> None:
    path = tmp_path / "two.bml"
    path.write_text(DOCUMENT.format("a", "") + DOCUMENT.format("b", ""), "utf-8")
    assert starts(enrich(str(path)).stdout) == {"a:surprise1": "s:w1", "b:surprise1": "s:w1"}


def test_text_comes_from_standard_input_and_goes_to_a_file(tmp_path: Path) -> None:
    done = enrich("-", "-o", str(tmp_path / "o.bml"), stdin="Nonsense. Go away!")
    assert (done.stdout, done.return_value) == ("", 0)
    assert "2 expressions placed" in done.stderr
    assert set(starts((tmp_path / "o.bml").read_text())) == {"bml1:anger1", "bml1:anger2"}


def test_a_listener_of_a_document_gets_a_block_of_his_own() -> None:
    done = enrich("-", "--role", "listener", stdin=DOCUMENT.format("a", ""))
    assert starts(done.stdout) == {"a-listener:sadness1": "0"}


def test_a_broken_document_is_told_and_the_others_are_done() -> None:
    done = enrich("-", stdin="<bml id='x'><spech></bml>" + DOCUMENT.format("b", ""))
    assert done.return_value == 1
    assert set(starts(done.stdout)) == {"b:surprise1"}
    assert "realizer:" in done.stderr


def test_words_of_another_language_come_from_a_file(tmp_path: Path) -> None:
    words = tmp_path / "de.csv"
    words.write_text(
        "# source: own\n# units: none\n# licence: MIT\nword,category,origin\nunsinn,disapproval,own\n"
    )
    assert "no emotional words for language 'de'" in enrich("Unsinn.", "--language", "de").stderr
    done = enrich("Unsinn.", "--language", "de", "--words", str(words))
    assert starts(done.stdout) == {"bml1:anger1": "speech1:w1"}


def test_a_text_in_other_letters_than_english_ones_is_asked_for_its_language() -> None:
    told = "this text has no letters of 'en-US'"
    done = enrich("Ты уверен?")
    assert told in done.stderr
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}
    for text, more in (("Really?", []), ("!!! 😀", []), ("Ты уверен?", ["--language", "ru"])):
        assert told not in enrich(text, *more).stderr


def test_one_expression_is_one(tmp_path: Path) -> None:
    assert "1 expression placed" in enrich("Really?", "-o", str(tmp_path / "o.bml")).stderr


@pytest.mark.parametrize("text", ["", "  \n "])
def test_an_empty_text_is_refused_in_words(text: str) -> None:
    done = enrich("-", stdin=text)
    assert "wanted a text or a BML document" in str(done.exception)


def test_an_unknown_mood_names_those_that_are_near() -> None:
    assert "wanted a word such as happy, happiness; got 'happi'" in str(
        enrich("Hi.", "--mood", "happi").exception
    )


def test_a_name_of_a_file_that_is_not_there_is_not_spoken(tmp_path: Path) -> None:
    for name in ("nofile.bml", "talk.TXT", str(tmp_path)):
        assert "wanted a text or an existing file" in str(enrich(name).exception)
    assert starts(enrich("Did you read talk.txt?").stdout)


def test_a_text_that_is_not_utf8_says_at_which_byte(tmp_path: Path) -> None:
    path = tmp_path / "latin.txt"
    path.write_bytes(b"Das gef\xe4llt mir!")
    assert "latin.txt: wanted a text in UTF-8, got byte 0xE4 at 7" in str(enrich(str(path)).exception)
    path.write_bytes(b"\xef\xbb\xbfReally?")
    assert starts(enrich(str(path)).stdout) == {"bml1:surprise1": "speech1:w1"}


def test_a_document_is_read_in_the_encoding_that_it_names(tmp_path: Path) -> None:
    path = tmp_path / "wide.bml"
    path.write_bytes(('<?xml version="1.0" encoding="UTF-16"?>' + DOCUMENT.format("a", "")).encode("utf-16"))
    assert starts(enrich(str(path)).stdout) == {"a:surprise1": "s:w1"}


def test_characters_that_xml_cannot_hold_become_blanks_and_are_told() -> None:
    done = enrich("-", stdin="Are\x00you\x0csure?")
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}
    assert "2 characters that XML cannot hold" in done.stderr


def test_a_speech_that_an_engine_reads_from_a_description_is_told_and_left() -> None:
    spoken = '<description priority="1" type="application/ssml+xml"><speak>Really?</speak></description>'
    done = enrich("-", stdin=DOCUMENT.format("a", spoken))
    assert starts(done.stdout) == {}
    assert "a:s: a description may be spoken instead of its text" in done.stderr


def test_a_listener_hears_a_speech_when_it_is_spoken() -> None:
    late = DOCUMENT.format("a", "").replace('id="s"', 'id="s" start="5"')
    assert starts(enrich("-", "--role", "listener", stdin=late).stdout) == {"a-listener:sadness1": "5"}


def test_what_was_placed_before_is_not_counted_again(tmp_path: Path) -> None:
    first, second = tmp_path / "1.bml", tmp_path / "2.bml"
    enrich("Really? Nonsense!", "-o", str(first))
    assert "0 expressions placed" in enrich(str(first), "-o", str(second)).stderr
    assert first.read_text() == second.read_text()


def test_a_wrong_list_of_words_is_wrong_usage(tmp_path: Path) -> None:
    words = tmp_path / "w.csv"
    words.write_text("word,category,origin\n")
    assert "wanted a leading line" in str(enrich("Hi.", "--words", str(words)).exception)
    assert getattr(enrich("Hi.", "--words", str(words)).exception, "exit_code", None) == 2


def test_a_documents_language_says_which_words_count() -> None:
    dutch = (
        DOCUMENT.format("a", "").replace("Really?", "Nonsense.").replace("<speech", '<speech xml:lang="nl"')
    )
    assert starts(enrich("-", stdin=dutch).stdout) == {}
    done = enrich("-", "--role", "listener", stdin=dutch + dutch.replace('id="a"', 'id="b"'))
    assert starts(done.stdout) == {}
    assert done.stderr.count("no emotional words for language 'nl'") == 1
    assert starts(enrich("-", "--language", "nl", stdin=dutch.replace("nl", "en")).stdout)


def test_a_text_keeps_the_language_that_was_asked_for() -> None:
    assert '<text xml:lang="de">' in enrich("Gut.", "--language", "de").stdout
    assert "xml:lang" not in enrich("Good.").stdout


def test_a_text_may_begin_with_a_heart() -> None:
    done = enrich("-", stdin="<3 you! Really?")
    assert done.return_value == 0
    assert "surprise1" in done.stdout
    assert "surprise1" in enrich("<3 Really?").stdout


def test_a_text_of_nothing_that_can_be_written_is_refused() -> None:
    assert "got characters XML cannot hold" in str(enrich("-", stdin="\0\x01 ").exception)
