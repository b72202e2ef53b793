"""Tests of `realizer.tables.emotional_words`."""

from pathlib import Path

import pytest

from realizer.core.errors import TableError
from realizer.tables.emotional_words import CATEGORIES, read_words, word_list, words_of

HEAD = "# source: test\n# units: none\n# licence: MIT\nword,category,origin\n"


def categories(text: str) -> list[str]:
    words = word_list("en-GB")
    assert words is not None
    return words.categories(text.split())


def test_word_list_of_english_has_words_of_every_category() -> None:
    words = word_list("en")
    assert words is not None
    found = {category for some in words.phrases.values() for _, category in some}
    assert found | set(words.beginnings.values()) == set(CATEGORIES)


def test_categories_prefer_a_phrase_to_its_words() -> None:
    assert categories("I understand but you understand") == ["approval", "approval", "", "", "assent"]


def test_categories_prefer_a_longer_beginning() -> None:
    assert categories("Sadists sadly") == ["fright", "sorrow"]


def test_categories_take_typographic_apostrophes() -> None:
    assert categories("you’re right") == ["assent", "assent"]


def test_word_list_of_an_unknown_language_is_none() -> None:
    assert word_list("xx") is None


def test_word_list_of_polish_knows_the_words_of_appendix_d() -> None:
    words = word_list("pl")
    assert words is not None
    wanted = {
        "praise": "geniuszem mądra pyszny szałowy świetnie utalentowana wspaniale inteligentnie",
        "pleasure": "cichego kochanie miłego nadzieje spokojnie śmieją weselsze żartujesz",
        "curiosity": "ciekawe dziwaczna zafascynowani tajemnicze interesują",
        "assent": "dobrze jasne słusznie zgoda rozumiesz rozumiałam",
        "sorrow": "bidulka bolało depresji płaczesz smutna słabo stresów umieram źle",
        "fright": "niepokoić panicznie potworny sadyści straszne strach",
        "irritation": "gniewa denerwować zdenerwowałam",
        "disapproval": "bzdury kanalia obrzydły podłe podlece ułomna złośliwe",
    }
    for category, said in wanted.items():
        for word in said.split():
            assert words.categories([word]) == [category], word
    assert words.categories(["na", "pewno", "bał", "się"]) == ["assent"] * 2 + ["fright"] * 2


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("gut,lob,own", "wanted one of praise, pleasure"),
        ("g*,praise,own", "wanted three letters or more"),
        ("gut,praise,own\ngut,sorrow,own", "wanted each word once"),
    ],
)
def test_read_words_refuses_an_invalid_row(tmp_path: Path, row: str, says: str) -> None:
    with pytest.raises(TableError, match=says):
        read_words(HEAD + row + "\n", "mine.csv")


def test_words_of_names_a_file_that_is_not_text(tmp_path: Path) -> None:
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\xff")
    with pytest.raises(TableError, match=r"bytes\.csv: wanted a list of words"):
        words_of(tmp_path / "bytes.csv")


def test_words_of_takes_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "marked.csv").write_text("\ufeff" + HEAD + "gut,praise,own\n", "utf-8")
    assert words_of(tmp_path / "marked.csv").categories(["gut"]) == ["praise"]


def test_words_of_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        words_of(tmp_path / "no.csv")
