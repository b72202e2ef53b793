"""Tests of the markup of Markdown."""

from hypothesis import example, given
from hypothesis import strategies as st

from realizer.text.markdown import (
    cells,
    fence_end,
    has_words,
    line_start,
    parse_inline,
    read_inline,
    read_plain,
)
from tests.rows import each_row


@each_row(
    "signs, kind, length, says",
    [
        ("", "paragraph", 0, ""),
        ("# ", "heading", 2, ""),
        ("#", "paragraph", 0, ""),
        ("- ", "item", 2, ""),
        ("• ", "item", 2, ""),
        ("12. ", "item", 4, "12: "),
        ("> ", "quote", 2, ""),
        ("> - ", "item", 4, ""),
        ("| ", "row", 0, ""),
        ("**", "paragraph", 0, ""),
        ("    ", "paragraph", 4, ""),
        ("3.5 ", "paragraph", 0, ""),
    ],
)
def test_line_start_of_signs(signs: str, kind: str, length: int, says: str) -> None:
    assert tuple(getattr(line_start(signs), name) for name in ("kind", "length", "says")) == (
        kind,
        length,
        says,
    )


@each_row("line, end", [("```python", "```"), ("~~~~", "~~~~~"), ("> ```", "> ```")])
def test_fence_ends_at_one_of_its_kind(line: str, end: str) -> None:
    fence = fence_end(line)
    assert fence is not None
    assert fence.fullmatch(end)
    assert not fence.fullmatch("``")


def test_code_in_a_line_is_no_fence() -> None:
    assert fence_end("```code``` is here") is None


@each_row("line, has", [("2024", True), ("---", False), ("1.", False), ("===", False), ("- 5", True)])
def test_lines_of_signs_have_words_or_none(line: str, has: bool) -> None:
    assert has_words(line) is has


@each_row(
    "row, texts", [("| a | b |", ["a", "b"]), (r"| a \| b | c |", ["a | b", "c"]), ("a | b", ["a", "b"])]
)
def test_cells_of_a_row(row: str, texts: list[str]) -> None:
    assert cells(row) == texts


@each_row(
    "text, is_open",
    [
        ("*a", True),
        ("*a*", False),
        ("2 * 3", False),
        ("a_b", False),
        ("`a", True),
        ("[a", True),
        ("[a] b", False),
        ("<break time", True),
        ("a < b", False),
        ("(soft", True),
        ("<!-- a", True),
        ("~~a", True),
        ("[a](b) c", False),
    ],
)
def test_markup_is_open_until_it_ends(text: str, is_open: bool) -> None:
    assert read_inline(text)[1] is is_open


FORMS = ("{}", "`{}`, ", "**{}** ", "*{}*. ", "*{}", "**{}", "[{}", "[{}](https://x.org/a?b=c_d). ")


@given(st.sampled_from(FORMS), st.text("ab *_[]()!.,?;:'’-~`<>\\& \té1²V😀", max_size=9))
@example("**{}** ", "Sure!")
@example("[{}](https://x.org/a?b=c_d). ", "our page")
def test_simple_markup_is_read_as_by_the_parser(form: str, words: str) -> None:
    text = form.format(words)
    if (plain := read_plain(text)) is not None:
        pieces, is_open = parse_inline(text)
        assert plain == ([piece for piece in pieces if piece.text] if text else plain[0], is_open)
