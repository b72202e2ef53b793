"""Tests of text that is read as it arrives."""

import time

from hypothesis import example, given
from hypothesis import strategies as st

from realizer.text.parts import Part, joined, markup
from realizer.text.stream import TextStream
from tests.rows import each_row

# "¬" is a blank of a piece, "¶" the end of a line.
WORDS = r"""
hello you A * ** _ ` ``` ~~~ ~~ [ ] ( ) [nod] (laughs) *smiles* *whistles¬on* *big* < > <b> & &amp;
¬ ¬ ¬  ¶ ¶¶ #¬ -¬ 1.¬ 2.¬ >¬ | |- --- === http://x.org/a <https://y.org> [a](b) [^1] [^1]:¬ [r]:¬ 😀
:) <3 5 12 . ! ? \  2024 •¬ [¬]¬ ![ <!-- --> $5 World¬War¬ II 50% km/h ¬30 ¬May¬ ,¬ No.¬ – : / °C
¬million¬ € ¬euros version¬ .5 Henry¬
VIII VI I 5 p.m. USD¬ Mio. EUR <sync¬id='m'/>
"""
PIECES = ["\r", "\t", *(word.replace("¬", " ").replace("¶", "\n") for word in WORDS.split())]
MANY = 2**17  # characters
PATIENCE = 20.0  # s of the processor; what takes quadratic time takes hours


def read(text: str, *sizes: int, language: str = "en") -> tuple[list[Part], list[str]]:
    """Return the parts and the warnings of a text that arrives in pieces of these sizes, again and again."""
    stream = TextStream(language)
    found: list[Part] = []
    at = turn = 0
    while at < len(text):
        size = sizes[turn % len(sizes)] if sizes else len(text)
        found += stream.feed(text[at : at + size])
        at, turn = at + size, turn + 1
    return joined([*found, *stream.feed("", close=True)]), stream.warnings


@given(
    st.lists(st.sampled_from(PIECES), max_size=25).map("".join),
    st.lists(st.integers(1, 9), min_size=1, max_size=8),
    st.sampled_from(["en", "de", "fr", "es", "nl", "pl"]),
)
@example("hello|No. 12", [1], "en")
@example("1. 50%", [1], "fr")
def test_pieces_give_the_same_words_as_the_whole(text: str, sizes: list[int], language: str) -> None:
    assert read(text, *sizes, language=language) == read(text, language=language)


@each_row(
    "arrived, said",
    [
        ("Hello there, how", "Hello there, "),
        ("Yes. ", "Yes. "),
        ("It is **very", "It is "),
        ("It is **very** good", "It is very "),
        ("# Welcome to", "Welcome "),
        ("- one thing", "one "),
        ("I like [our page", "I like "),
        ("It costs $12", "It costs "),
        ("It costs $12.50. Then", "It costs twelve dollars and fifty cents. "),
        ("See `x", "See "),
        ("Go <break time=", "Go "),
    ],
)
def test_only_what_may_be_markup_is_held_back(arrived: str, said: str) -> None:
    assert markup(TextStream().feed(arrived)) == said


@each_row("end", ["\n\n", "\n# "])
def test_everything_is_released_at_the_end_of_a_paragraph(end: str) -> None:
    assert (
        markup(TextStream().feed(f"It is **very good{end}")).startswith("It is very good.") or end == "\n# "
    )


def test_numbers_without_end_are_released_after_a_while() -> None:
    stream = TextStream()
    said = "".join(markup(stream.feed(f"{k} " if k else "From ")) for k in range(300))
    assert "100 " in said


def test_markup_that_is_never_closed_is_released_after_a_while() -> None:
    stream = TextStream()
    said = "".join(markup(stream.feed(f"*word{'x' * k} ")) for k in range(90))
    assert "wordxxxxxxxxxx" in said


@each_row(
    "unit",
    ["*", "[", "[a", "![", "```\n", "(", "**a ", "<a ", "| a ", "- ", "> ", "`", "1. ", "👨\u200d", "[]("],
)
def test_endless_markup_is_read_in_linear_time(unit: str) -> None:
    text = unit * (MANY // len(unit))
    begin = time.process_time()
    for at in range(0, len(text), 4096):
        TextStream().feed(text[at : at + 4096], close=True)
    assert time.process_time() - begin < PATIENCE


@each_row(
    "text, warnings",
    [
        ("Hello. 🧿 you 🦖", ["'🧿'", "'🦖'"]),
        ("Hello 🧿", ["'🧿'"]),
        ("Well 😀 yes \ufe0f", []),
    ],
)
def test_feed_names_emoji_that_are_not_known(text: str, warnings: list[str]) -> None:
    expected = [f"the emoji {sign} is not known: it is left out" for sign in warnings]
    assert read(text)[1] == expected
    stream = TextStream(emoji=False)
    stream.feed(text, close=True)
    assert stream.warnings == []
