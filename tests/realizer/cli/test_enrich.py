"""Tests of `realizer enrich`."""

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


def test_enrich_turns_a_text_into_a_document() -> None:
    done = enrich("Are you sure?")
    assert done.return_value == 0
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}


def test_enrich_keeps_the_ids_of_documents(tmp_path: Path) -> None:
    path = tmp_path / "two.bml"
    path.write_text(DOCUMENT.format("a", "") + DOCUMENT.format("b", ""), "utf-8")
    assert starts(enrich(str(path)).stdout) == {"a:surprise1": "s:w1", "b:surprise1": "s:w1"}


def test_enrich_reads_standard_input_and_writes_a_file(tmp_path: Path) -> None:
    done = enrich("-", "-o", str(tmp_path / "o.bml"), stdin="Nonsense. Go away!")
    assert (done.stdout, done.return_value) == ("", 0)
    assert "2 expressions placed" in done.stderr
    assert set(starts((tmp_path / "o.bml").read_text())) == {"bml1:anger1", "bml1:anger2"}


def test_enrich_makes_a_block_of_its_own_for_a_listener() -> None:
    done = enrich("-", "--role", "listener", stdin=DOCUMENT.format("a", ""))
    assert starts(done.stdout) == {"a-listener:sadness1": "0"}


def test_enrich_reports_a_broken_document_and_continues() -> None:
    done = enrich("-", stdin="<bml id='x'><spech></bml>" + DOCUMENT.format("b", ""))
    assert done.return_value == 1
    assert set(starts(done.stdout)) == {"b:surprise1"}
    assert "realizer:" in done.stderr


def test_enrich_reads_words_of_another_language_from_a_file(tmp_path: Path) -> None:
    words = tmp_path / "de.csv"
    words.write_text(
        "# source: own\n# units: none\n# licence: MIT\nword,category,origin\nunsinn,disapproval,own\n"
    )
    assert "no emotional words for language 'de'" in enrich("Unsinn.", "--language", "de").stderr
    done = enrich("Unsinn.", "--language", "de", "--words", str(words))
    assert starts(done.stdout) == {"bml1:anger1": "speech1:w1"}


def test_enrich_suggests_a_language_for_a_text_in_other_letters() -> None:
    warning = "this text has no letters of 'en-US'"
    done = enrich("Ты уверен?")
    assert warning in done.stderr
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}
    for text, more in (("Really?", []), ("!!! 😀", []), ("Ты уверен?", ["--language", "ru"])):
        assert warning not in enrich(text, *more).stderr


def test_enrich_counts_one_expression_in_the_singular(tmp_path: Path) -> None:
    assert "1 expression placed" in enrich("Really?", "-o", str(tmp_path / "o.bml")).stderr


@pytest.mark.parametrize("text", ["", "  \n "])
def test_enrich_refuses_an_empty_text(text: str) -> None:
    done = enrich("-", stdin=text)
    assert "wanted a text or a BML document" in str(done.exception)


def test_enrich_suggests_moods_for_an_unknown_one() -> None:
    assert "wanted a word such as happy, happiness; got 'happi'" in str(
        enrich("Hi.", "--mood", "happi").exception
    )


def test_enrich_refuses_the_name_of_a_missing_file(tmp_path: Path) -> None:
    for name, fault in (
        ("nofile.bml", "No such file"),
        ("talk.TXT", "No such file"),
        (tmp_path, "directory"),
    ):
        assert f"{name}: {fault}" in str(enrich(str(name)).exception).replace("Is a ", "")
    assert starts(enrich("Did you read talk.txt?").stdout)


def test_enrich_names_the_byte_of_a_text_that_is_not_utf8(tmp_path: Path) -> None:
    path = tmp_path / "latin.txt"
    path.write_bytes(b"Das gef\xe4llt mir!")
    assert "latin.txt: wanted a text in UTF-8, got byte 0xE4 at 7" in str(enrich(str(path)).exception)
    path.write_bytes(b"\xef\xbb\xbfReally?")
    assert starts(enrich(str(path)).stdout) == {"bml1:surprise1": "speech1:w1"}


def test_enrich_reads_a_document_in_the_encoding_it_declares(tmp_path: Path) -> None:
    path = tmp_path / "wide.bml"
    path.write_bytes(('<?xml version="1.0" encoding="UTF-16"?>' + DOCUMENT.format("a", "")).encode("utf-16"))
    assert starts(enrich(str(path)).stdout) == {"a:surprise1": "s:w1"}


def test_enrich_replaces_characters_that_xml_cannot_hold() -> None:
    done = enrich("-", stdin="Are\x00you\x0csure?")
    assert starts(done.stdout) == {"bml1:surprise1": "speech1:w1"}
    assert "2 characters that XML cannot hold" in done.stderr


def test_enrich_skips_a_speech_with_a_description() -> None:
    spoken = '<description priority="1" type="application/ssml+xml"><speak>Really?</speak></description>'
    done = enrich("-", stdin=DOCUMENT.format("a", spoken))
    assert starts(done.stdout) == {}
    assert "a:s: a description may be spoken instead of its text" in done.stderr


def test_enrich_places_a_listener_s_expressions_when_the_text_is_spoken() -> None:
    late = DOCUMENT.format("a", "").replace('id="s"', 'id="s" start="5"')
    assert starts(enrich("-", "--role", "listener", stdin=late).stdout) == {"a-listener:sadness1": "5"}


def test_enrich_counts_only_new_expressions(tmp_path: Path) -> None:
    first, second = tmp_path / "1.bml", tmp_path / "2.bml"
    enrich("Really? Nonsense!", "-o", str(first))
    assert "0 expressions placed" in enrich(str(first), "-o", str(second)).stderr
    assert first.read_text() == second.read_text()


def test_enrich_refuses_an_invalid_list_of_words(tmp_path: Path) -> None:
    words = tmp_path / "w.csv"
    words.write_text("word,category,origin\n")
    assert "wanted a leading line" in str(enrich("Hi.", "--words", str(words)).exception)
    assert getattr(enrich("Hi.", "--words", str(words)).exception, "exit_code", None) == 2


def test_enrich_uses_the_words_of_the_language_of_a_document() -> None:
    dutch = (
        DOCUMENT.format("a", "").replace("Really?", "Nonsense.").replace("<speech", '<speech xml:lang="nl"')
    )
    assert starts(enrich("-", stdin=dutch).stdout) == {}
    done = enrich("-", "--role", "listener", stdin=dutch + dutch.replace('id="a"', 'id="b"'))
    assert starts(done.stdout) == {}
    assert done.stderr.count("no emotional words for language 'nl'") == 1
    assert starts(enrich("-", "--language", "nl", stdin=dutch.replace("nl", "en")).stdout)


def test_enrich_writes_the_requested_language() -> None:
    assert '<text xml:lang="de">' in enrich("Gut.", "--language", "de").stdout
    assert "xml:lang" not in enrich("Good.").stdout


def test_enrich_takes_a_heart_for_text() -> None:
    done = enrich("-", stdin="<3 you! Really?")
    assert done.return_value == 0
    assert "surprise1" in done.stdout
    assert "surprise1" in enrich("<3 Really?").stdout


def test_enrich_refuses_a_text_of_unwritable_characters() -> None:
    assert "got characters XML cannot hold" in str(enrich("-", stdin="\0\x01 ").exception)
