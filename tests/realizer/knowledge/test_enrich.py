"""Tests of `realizer.knowledge.enrich`."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import realizer
from bml_schema import Block, Expression, Speech, parse, write
from realizer.knowledge.enrich import Enricher, template_of
from realizer.speech.utterance import MAX_TEXT
from realizer.tables.knowledge import knowledge

TEXT = "Are you really sure? This is nonsense! There was a terrible accident. Yes. Go away!"
HEAD = '<bml id="b" xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:r="urn:bml-realizer:1">'


def document(*behaviours: str) -> Block:
    return parse(HEAD + "".join(behaviours) + "</bml>")


def placed(block: Block) -> dict[str, str]:
    """Template and start of what was placed."""
    return {
        node.id: f"{template_of(node)} {node.syncs['start']}"
        for node in block.behaviours
        if getattr(node, "because", "")
    }


def test_text_becomes_a_block_with_expressions_at_words() -> None:
    block = Enricher().text(TEXT)
    speech = block["speech1"]
    assert isinstance(speech, Speech)
    assert str(speech.text) == TEXT
    assert placed(block) == {
        "surprise1": "surprise speech1:w1",
        "anger1": "anger speech1:w2",
        "surprise2": "surprise speech1:w3",
        "grief1": "grief speech1:w3",
        "surprise3": "surprise speech1:w4",
        "anger2": "anger speech1:w5",
    }


def test_block_names_the_rule_of_every_placed_expression() -> None:
    nodes = [node for node in Enricher().text(TEXT).behaviours if isinstance(node, Expression)]
    assert nodes
    assert all("Wojdel" in (node.because or "") for node in nodes)


def test_text_gives_a_block_that_plays_without_warnings() -> None:
    text = write(Enricher().text(TEXT))
    assert parse(text) == Enricher().text(TEXT)
    schedule = realizer.schedule(text)
    assert not schedule.warnings
    assert set(placed(parse(text))) < set(schedule.times)


@pytest.mark.parametrize(
    ("behaviour", "starts"),
    [
        ('<r:expression id="a" name="template:astonishment" start="3"/>', "surprise a:start - 0.12"),
        ('<r:expression id="a" name="template:disgust" start="3"/>', "anger a:start - 0.12"),
        ('<r:expression id="a" name="template:disbelief"/>', "anger a:relax"),
        ('<r:expression id="a" name="Template:Happiness" start="3"/>', "surprise a:start - 0.6"),
    ],
)
def test_block_adds_companions_of_an_expression(behaviour: str, starts: str) -> None:
    assert list(placed(Enricher().block(document(behaviour))).values()) == [starts]


def test_block_places_nothing_before_its_start() -> None:
    block = Enricher().block(document('<r:expression id="a" name="template:happiness" start="0"/>'))
    assert placed(block) == {}
    block = Enricher().block(document('<r:expression id="a" name="template:astonishment" start="0.05"/>'))
    assert placed(block) == {"surprise1": "surprise a:start - 0.05"}
    assert not realizer.schedule(write(block)).warnings


def test_block_keeps_its_text_and_marks() -> None:
    block = document(
        '<required><speech id="w1" start="1"><text>Hm, <sync id="k"/>really? No?</text></speech></required>',
        '<head id="surprise1" lexeme="NOD" stroke="w1:k"/>',
    )
    rich = Enricher().block(block)
    assert rich.required == {"w1"}
    speech = rich["w1"]
    assert isinstance(speech, Speech)
    assert speech.marked == ("k", "w2")
    assert rich["surprise1"] == block["surprise1"]
    assert placed(rich) == {"surprise2": "surprise w1:k", "surprise3": "surprise w1:w2"}


def test_block_leaves_speech_with_descriptions_unchanged() -> None:
    speech = (
        '<speech id="s"><text>Really?</text><description priority="1" type="application/ssml+xml">'
        '<speak xmlns="http://www.w3.org/2001/10/synthesis">Really?</speak></description></speech>'
    )
    assert Enricher().block(document(speech)) == document(speech)


def test_block_scales_durations_by_mood() -> None:
    def held(mood: str) -> float:
        block = Enricher(mood=knowledge().mood(mood)).text("Are you sure about it?")
        return float(block["surprise1"].syncs["relax"].offset)

    assert held("confused") < held("depressed")


@pytest.mark.parametrize(
    ("text", "count"),
    [("Really?", 1), ("Do you know this man?", 1), ("Do you know who this strange man was?", 0)],
)
def test_text_ends_only_short_questions_with_surprise(text: str, count: int) -> None:
    names = [template_of(node) for node in Enricher().text(text).behaviours]
    assert names.count("surprise") == count


def test_text_shows_regret_that_outlasts_a_turn_on_something_sad() -> None:
    block = Enricher().text("He was here. Yes, I admit it was a pity.")
    assert str(block["regret1"].syncs["end"]) == "speech1:end + 0.6"
    times = realizer.schedule(write(block)).times
    assert times["regret1"][-1] == pytest.approx(times["speech1"][-1] + 0.6)
    assert "regret1" not in {node.id for node in Enricher().text("Yes, a pity. But go on.").behaviours}


def test_listener_shows_expressions_at_the_times_of_words() -> None:
    block = Enricher(role="listener").text("Do you know it?")
    assert [type(node) for node in block.behaviours] == [Expression]
    assert placed(block) == {"sadness1": "sadness 0.6"}


WORDS = [
    "really",
    "nonsense",
    "yes",
    "horrible",
    "not",
    "furious",
    "I",
    "understand",
    "day",
    "?",
    "!",
    ".",
    "<&>",
]


@given(st.lists(st.sampled_from(WORDS), max_size=12).map(" ".join))
def test_block_enriched_twice_is_the_same(text: str) -> None:
    block = parse(write(Enricher().text(text)))
    assert Enricher().block(block) == block


@pytest.mark.parametrize(
    "text",
    ['Are you sure? What a horror, he said; "nonsense!" ' * 500, "No! & yes. " * 2000, "x" * 30_000],
    ids=["sentences", "short sentences", "one word"],
)
@pytest.mark.slow
def test_texts_splits_a_long_text_into_playable_blocks(text: str) -> None:
    blocks = list(Enricher().texts(text, MAX_TEXT))
    assert "".join(str(block["speech1"].text) for block in blocks) == text
    assert len({block.id for block in blocks}) == len(blocks) > 2
    assert [block.composition for block in blocks] == ["MERGE"] + ["APPEND"] * (len(blocks) - 1)
    assert not any(realizer.schedule(write(block)).warnings for block in (blocks[0], blocks[-1]))


def test_texts_splits_between_sentences() -> None:
    blocks = list(Enricher().texts('Are you sure? What a horror, he said; "nonsense!" ' * 1000, MAX_TEXT))
    assert all(str(block["speech1"].text).startswith(("Are", "What", '"')) for block in blocks)
    assert [len(list(Enricher().texts(short, MAX_TEXT))) for short in ("Hi.", "no, " * 2500)] == [1, 1]
