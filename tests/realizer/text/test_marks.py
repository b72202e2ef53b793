"""Tests of stage directions, emoji and emoticons."""

from realizer.emotions.words import known_words
from realizer.tables import toml_table
from realizer.tables.lexemes import face_lexemes, head_lexemes
from realizer.text.marks import FILE, LANGUAGES, behaviour, direction, in_brackets, inflections, of_picture
from tests.rows import each_row


@each_row(
    "verb, forms",
    [
        ("nod", ("nod", "nods", "nodding", "nodded")),
        ("smile", ("smile", "smiles", "smiling", "smiled")),
        ("cry", ("cry", "cries", "crying", "cried")),
        ("blush", ("blush", "blushes", "blushing", "blushed")),
        ("look", ("look", "looks", "looking", "looked")),
        ("frown", ("frown", "frowns", "frowning", "frowned")),
    ],
)
def test_inflections_of_regular_verbs(verb: str, forms: tuple[str, ...]) -> None:
    assert inflections(verb) == forms


def test_each_name_of_the_table_is_a_lexeme_an_emotion_or_a_pause() -> None:
    table = toml_table(FILE)
    names = {name for part in (*LANGUAGES, "emoji", "emoticons") for name in table[part]} | {
        *table["emotions"]["alike"]
    }
    assert names <= {*face_lexemes(), *head_lexemes(), *known_words(), "pause"}


def test_emotions_in_brackets_are_those_of_the_service() -> None:
    assert set(toml_table(FILE)["emotions"]["names"].split()) == set(known_words())


@each_row("text", ["important", "the head", "a smile would help us all to go on with it today", ""])
def test_other_words_are_no_direction(text: str) -> None:
    assert direction(text) is None


@each_row(
    "text, shows", [("nod", "NOD"), ("Raise brows", "RAISE_BROWS"), ("nods slowly", "NOD"), ("sad", "sad")]
)
def test_words_in_brackets_are_lexemes_emotions_and_directions(text: str, shows: str) -> None:
    found = in_brackets(text)
    assert found is not None
    assert f'"{shows}"' in found.source


def test_first_known_emoji_of_a_run_is_shown() -> None:
    assert of_picture("🚀😢😀") == behaviour("sadness")
    assert of_picture("🚀") is None
