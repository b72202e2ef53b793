"""Tests of what a voice is given of a text."""

import pytest

import realizer
from realizer.text.spoken import spoken_text
from tests.rows import each_row

MARKDOWN = [
    ("**Important:** do it", "Important: do it"),
    ("# Title\nHello *you*.", "Title.\n\nHello you."),
    ("Title\n=====\nText", "Title.\n\nText"),
    ("- milk\n- **two** eggs", "milk.\n\ntwo eggs."),
    ("1. Boil\n2. Serve", "1: Boil.\n\n2: Serve."),
    ("- [x] done\n- [ ] not yet", "done.\n\nnot yet."),
    ("• milk\n• eggs", "milk.\n\neggs."),
    ("| A | B |\n|---|---|\n| 1 | 2 |", "A, B.\n\n1, 2."),
    ("> quoted\n> words", "quoted words"),
    ("See [our page](https://x.org/a?b).", "See our page."),
    ("See <https://x.org>.", "See x.org."),
    ("See [our page][page].", "See our page."),
    ("See https://www.example.org/a/b?c=d#e, now", "See example.org, now"),
    ("![a cat](cat.png) sits", "a cat sits"),
    ("Call `main` now", "Call main now"),
    ("Before.\n\n```python\nx = 1\n```\n\nAfter.", "Before.\n\nAfter."),
    ("One\n\n---\n\nTwo", "One.\n\nTwo"),
    ("True[^1].\n\n[^1]: As we know.", "True.\n\nAs we know."),
    ("[a]: https://x.org\nText", "Text"),
    ("As shown [1, 2].", "As shown."),
    ("~~old~~ new", "old new"),
    ("snake_case_name", "snake case name"),
    ("#topic and a*b", "topic and ab"),
    ("a <!-- hidden --> b", "a b"),
    ("The year was\n1984. It was", "The year was 1984. It was"),
    ("Tom & Jerry", "Tom & Jerry"),
    ("Tom &amp; Jerry&nbsp;here", "Tom & Jerry here"),
    ("It costs < 5 dollars & more.", "It costs less than 5 dollars & more."),
    ("5 < 6", "5 is less than 6"),
    ("a < b", "a < b"),
    (r"2 \* 3 \_x\_", "2 times 3 x"),
    ("I <b>am</b> here<br>now", "I am here\nnow"),
    ("Hello 😀", "Hello"),
    ("I love it ❤️.", "I love it."),
    ("I <3 you :)", "I you"),
    ("a → b", "a, b"),
]  # fmt: skip
MARKS = [
    ("*smiles* Hello", "Hello", [(0, '<faceLexeme lexeme="SMILE"/>')]),
    ("Hello [nod] there", "Hello there", [(6, '<head lexeme="NOD"/>')]),
    ("Well (laughs) no", "Well no", [(5, '<realizer:emotion name="joy"/>')]),
    ("[happy] Yes", "Yes", [(0, '<realizer:emotion name="happy"/>')]),
    ("[RAISE_BROWS] Oh", "Oh", [(0, '<faceLexeme lexeme="RAISE_BROWS"/>')]),
    ("*She slowly shakes her head* No", "No", [(0, '<head lexeme="SHAKE"/>')]),
    ("*smiling warmly* Hi", "Hi", [(0, '<faceLexeme lexeme="SMILE"/>')]),
    ("_nods_ Hi", "Hi", [(0, '<head lexeme="NOD"/>')]),
    ("Ja *nickt* gut", "Ja gut", [(3, '<head lexeme="NOD"/>')]),
    ("I [pause] wait", "I wait", []),
    ("It is *important* to me", "It is important to me", []),
    ("When she *smiles* I melt", "When she smiles I melt", []),
    ("*Always* check *this*", "Always check this", []),
    ("*always* check", "always check", []),
    ("(see below) and [note]", "(see below) and [note]", []),
    ("I was (happy) then", "I was (happy) then", []),
    (
        "So 😂 funny :D",
        "So funny",
        [(3, '<realizer:emotion name="joy"/>'), (8, '<realizer:emotion name="joy"/>')],
    ),
    ('A <head lexeme="NOD"/> b', "A b", [(2, '<head lexeme="NOD"/>')]),
]


@each_row("text, words", MARKDOWN)
def test_markdown_and_signs_are_read_as_people_mean_them(text: str, words: str) -> None:
    assert spoken_text(text) == words


@each_row("text, words, behaviours", MARKS)
def test_known_marks_are_behaviours_at_their_place(
    text: str, words: str, behaviours: list[tuple[int, str]]
) -> None:
    spoken = spoken_text(text)
    assert spoken.text == words
    assert list(spoken.behaviours) == behaviours


@each_row("text", ["*whistles a tune* Nice.", "Good. *juggles*", "*looking for keys* Where are they?"])
def test_unknown_directions_in_asterisks_are_left_out_with_a_warning(text: str) -> None:
    spoken = spoken_text(text)
    assert "*" not in spoken
    assert spoken.text in ("Nice.", "Good.", "Where are they?")
    assert any("stage direction" in warning for warning in spoken.warnings)


def test_known_part_of_a_direction_is_shown_and_the_rest_named() -> None:
    spoken = spoken_text("*smiles and juggles* Hi")
    assert [b.bml for b in spoken.behaviours] == ['<faceLexeme lexeme="SMILE"/>']
    assert spoken.warnings == ("the stage direction 'juggles' is not known: it is left out",)


def test_markup_keeps_ssml_behaviours_and_escapes_signs() -> None:
    spoken = spoken_text('A & <emphasis>b</emphasis> [nod]<sync id="m"/>c < d')
    assert spoken.markup == 'A &amp; <emphasis>b</emphasis> <head lexeme="NOD"/><sync id="m"/>c &lt; d'
    assert spoken.text == "A & b c < d"


def test_emoji_and_code_have_options() -> None:
    assert spoken_text("Hi 😀", emoji=False).behaviours == ()
    assert spoken_text("```\nx\n```", code="say") == "code."
    assert spoken_text("```\nx\n```").warnings == ("a block of code is not spoken",)


def test_spoken_text_is_public_and_wants_a_text() -> None:
    assert realizer.spoken_text is spoken_text
    with pytest.raises(TypeError, match="wanted a text, got bytes"):
        spoken_text(b"hi")  # type: ignore[arg-type]


def test_numbers_of_a_long_text_are_whole() -> None:
    text = "It is very late today, on May 5, 2024, and it costs $1,250.50 now. " * 200
    said = spoken_text(text)
    assert said.count("May fifth, twenty twenty-four") == said.count("two hundred and fifty dollars") == 200
