"""Tests of BML feedback messages."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from bml_schema import (
    BMLA,
    CORE,
    OWN,
    Behaviour,
    Blink,
    BlockPrediction,
    BlockProgress,
    BMLError,
    FaceInterpolator,
    FaceKeyframe,
    Feedback,
    PredictionFeedback,
    Speech,
    Sync,
    SyncPointProgress,
    SyncRef,
    WarningFeedback,
    parse,
    parse_feedback,
    prediction_of,
)
from bml_schema.values import decimal
from tests.strategies import blocks, names, xml_text

# Times go out to the microsecond.
times = st.integers(0, 10**11).map(lambda n: n / 1e6)
inside = st.integers(0, 86400 * 10**6).map(lambda n: n / 1e6)
who = st.none() | names


@st.composite
def predictions(draw: st.DrawFn) -> PredictionFeedback:
    block = draw(blocks())
    behaviours = tuple(
        prediction_of(
            b,
            block.id,
            {p: draw(inside) for p in (*b.sync_points, *(b.marked if isinstance(b, Speech) else ()))},
        )
        for b in block.behaviours
    )
    block_prediction = st.builds(
        BlockPrediction,
        id=names,
        global_start=st.none() | times,
        global_end=st.none() | times,
        status=st.none() | st.just("IN_PREP"),
    )
    return PredictionFeedback(
        character_id=draw(who),
        blocks=tuple(draw(st.lists(block_prediction, max_size=3))),
        behaviours=behaviours,
    )


feedback = st.one_of(
    st.builds(
        BlockProgress,
        id=names.map(lambda n: f"{n}:start"),
        global_time=times,
        character_id=who,
        status=st.none() | st.just("DONE"),
    ),
    st.builds(SyncPointProgress, id=names, time=times, global_time=times, character_id=who),
    st.builds(
        WarningFeedback,
        id=xml_text(1),
        type=names,
        text=xml_text(),
        character_id=who,
        in_use_for=st.none() | st.integers(0, 10**9),
    ),
    predictions(),
)


@given(feedback)
def test_parse_feedback_reads_back_every_message(message: Feedback) -> None:
    assert parse_feedback(message.to_xml()) == message


@given(feedback, st.integers(1, 10**9))
def test_to_xml_writes_the_number_of_a_message_in_our_namespace(message: Feedback, seq: int) -> None:
    text = message.to_xml(seq)
    root = etree.fromstring(text.encode())
    assert root.get(f"{{{OWN}}}seq") == str(seq)
    back = parse_feedback(text)
    assert back == message
    assert back.seq == seq
    assert replace(message, seq=seq).to_xml() == text


@given(feedback)
def test_to_xml_uses_known_namespaces_and_plain_names(message: Feedback) -> None:
    root = etree.fromstring(message.to_xml(7, 1.7e9).encode())
    assert str(root.tag).startswith(f"{{{CORE}}}")
    for name in root.attrib:
        known = (f"{{{OWN}}}{n}" for n in ("seq", "inUseFor"))
        known = (*known, f"{{{BMLA}}}status", f"{{{BMLA}}}posixTime")
        assert not name.startswith("{") or name in known


@given(feedback, st.integers(0, 2 * 10**9))
def test_to_xml_writes_wall_clock_times_beside_those_of_the_session(message: Feedback, epoch: int) -> None:
    back = parse_feedback(message.to_xml(1, epoch))
    assert back == message
    if isinstance(back, BlockProgress | SyncPointProgress):
        assert back.posix_time == round((epoch + back.global_time) * 1000)
    if isinstance(back, PredictionFeedback):
        for block in back.blocks:
            for time, posix in ((block.global_start, block.posix_start), (block.global_end, block.posix_end)):
                assert posix == (None if time is None else round((epoch + time) * 1000))
    assert back.to_xml() == message.to_xml(1, epoch), "what was read can be passed on as it was"


def test_to_xml_shares_a_prefix_of_a_predicted_behaviour_and_a_number() -> None:
    message = PredictionFeedback(behaviours=(Blink(id="b:x"),))
    root = etree.fromstring(message.to_xml(4).encode())
    assert root.get(f"{{{OWN}}}seq") == "4"
    assert parse_feedback(message.to_xml(4)) == message


def test_to_xml_of_block_progress_is_as_in_the_standard() -> None:
    text = BlockProgress(id="b1:start", global_time=1.5, character_id="A").to_xml()
    assert text == f'<blockProgress xmlns="{CORE}" id="b1:start" globalTime="1.5" characterId="A"/>'


def test_to_xml_of_sync_point_progress_is_as_in_the_standard() -> None:
    text = SyncPointProgress(id="b1:nod1:stroke:2", time=0.1 + 0.2, global_time=100000.123).to_xml(3)
    assert text == (
        f'<syncPointProgress xmlns="{CORE}" id="b1:nod1:stroke:2" time="0.3" globalTime="100000.123"'
        f' xmlns:realizer="{OWN}" realizer:seq="3"/>'
    )


def test_to_xml_writes_the_status_of_a_block_in_bmlas_namespace() -> None:
    text = BlockProgress(id="b1:end", global_time=0.0, status="INTERRUPTED").to_xml()
    assert etree.fromstring(text.encode()).get(f"{{{BMLA}}}status") == "INTERRUPTED"


def test_to_xml_of_a_warning_has_plain_text_only() -> None:
    text = WarningFeedback(id="b1:h", type="PARSING_FAILURE", text='a < b & "c" \0').to_xml()
    assert "CDATA" not in text
    root = etree.fromstring(text.encode())
    assert len(root) == 0
    assert root.text == 'a < b & "c" \ufffd'


@pytest.mark.parametrize("time", [1e-7, 1e300, -0.0])
def test_to_xml_writes_no_exponents(time: float) -> None:
    text = BlockProgress(id="b:end", global_time=time).to_xml()
    assert "e" not in text.partition('globalTime="')[2].partition('"')[0]


def test_to_xml_rounds_to_microseconds_decades_after_the_epoch_too() -> None:
    text = BlockProgress(id="b:end", global_time=1_700_000_000.1234567).to_xml()
    assert 'globalTime="1700000000.123457"' in text


def test_to_xml_refuses_nan() -> None:
    with pytest.raises(ValueError, match="finite"):
        BlockProgress(id="b:end", global_time=float("nan")).to_xml()


SPEECH = """<bml id="b"><speech id="s" start="h:end"><text>Hi <sync id="m" ref="h:start"/> you</text>
<description priority="1" type="x"/></speech>
<head id="h" lexeme="NOD" repetition="2" amount="1" odd="1"/></bml>"""


def test_prediction_of_has_required_attributes_and_times() -> None:
    block = parse(SPEECH)
    head = prediction_of(
        block["h"], "b", {"start": 0.0, "stroke:1": 0.25, "stroke": 0.5, "end": 1.0000000004}
    )
    assert head.id == "b:h"
    assert head.syncs == {"start": SyncRef(), "stroke": SyncRef(offset=0.5), "end": SyncRef(offset=1.0)}
    text = PredictionFeedback(behaviours=(head,)).to_xml()
    assert '<head id="b:h" lexeme="NOD" repetition="2" amount="1" start="0" stroke="0.5" end="1"/>' in text


def test_prediction_of_speech_has_its_syncs_in_the_text() -> None:
    speech = prediction_of(parse(SPEECH)["s"], "b", {"start": 0.0, "m": 2.0, "end": 3.0})
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert speech.text.parts == ("Hi ", Sync(id="m", ref=SyncRef(offset=2.0)), " you")
    assert not speech.descriptions
    assert '<sync id="m" ref="2"/>' in PredictionFeedback(behaviours=(speech,)).to_xml()


def test_prediction_of_leaves_out_keys_and_unknown_parts() -> None:
    keys = FaceInterpolator(parts="31", keys="0 1\n" * 1000)
    node = FaceKeyframe(id="k", type="FAPS", interpolator=keys, unknown_children=('<a xmlns="urn:a"/>',))
    message = prediction_of(node, "b", {"start": 0.0, "end": 1.0})
    assert message == FaceKeyframe(
        id="b:k", type="FAPS", syncs={"start": SyncRef(), "end": SyncRef(offset=1.0)}
    )


def test_parse_feedback_skips_unknown_children_of_a_prediction() -> None:
    text = (
        f'<predictionFeedback xmlns="{CORE}"><blink id="b:x" start="1"/><head id="b:h"/></predictionFeedback>'
    )
    assert parse_feedback(text) == PredictionFeedback()


def test_parse_feedback_reads_times_with_exponents() -> None:
    text = f'<blockProgress xmlns="{CORE}" id="b:start" globalTime="1.0E-4"/>'
    assert parse_feedback(text) == BlockProgress(id="b:start", global_time=0.0001)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not well-formed"),
        ("<blockProgress", "not well-formed"),
        ('<blockProgress id="b:start" globalTime="1"/>', "wanted BML 1.0 feedback, got <blockProgress>"),
        (f'<blockProgress xmlns="{CORE}" globalTime="1"/>', "id: wanted one, got none"),
        (
            f'<blockProgress xmlns="{CORE}" id="b:start" globalTime="soon"/>',
            'globalTime: wanted seconds, got "soon"',
        ),
        (
            f'<syncPointProgress xmlns="{CORE}" id="b" globalTime="1" time="nan"/>',
            'time: wanted seconds, got "nan"',
        ),
        (f'<warningFeedback xmlns="{CORE}" id="b"/>', "type: wanted one, got none"),
        ('<!DOCTYPE a [<!ENTITY e "x">]><a>&e;</a>', "without DTD"),
        ("<a>\ud800</a>", "characters XML can hold"),
    ],
)
def test_parse_feedback_refuses_other_elements(text: str, said: str) -> None:
    with pytest.raises(BMLError, match=said):
        parse_feedback(text)


def test_prediction_of_speech_appends_marks_of_descriptions() -> None:
    node = parse('<bml id="b"><speech id="s"><text>a <sync id="m"/> b</text></speech></bml>')["s"]
    message = prediction_of(node, "b", {"start": 0.0, "m": 0.5, "x": 0.75, "end": 1.0})
    text = text_of(message)
    assert text == 'a <sync id="m" ref="0.5"/> b<sync id="x" ref="0.75"/>'
    bare = parse(
        '<bml id="b"><speech id="s"><description priority="1" type="application/ssml+xml">'
        '<speak xmlns="http://www.w3.org/2001/10/synthesis">a <mark name="x"/></speak>'
        "</description></speech></bml>"
    )["s"]
    assert (
        text_of(prediction_of(bare, "b", {"start": 0.0, "x": 0.75, "end": 1.0}))
        == '<sync id="x" ref="0.75"/>'
    )


def text_of(node: Behaviour) -> str:
    xml = PredictionFeedback(behaviours=(node,)).to_xml()
    return xml[xml.index("<text>") + 6 : xml.index("</text>")]


def test_block_progress_has_the_words_spoken_before_a_cut() -> None:
    message = BlockProgress(id="b:end", global_time=1.0, status="INTERRUPTED", said="I think that")
    root = etree.fromstring(message.to_xml(3).encode())
    assert root.get(f"{{{OWN}}}said") == "I think that"
    assert root.get(f"{{{OWN}}}lastWord") == "that"
    assert parse_feedback(message.to_xml(3)) == message
    silent = parse_feedback(BlockProgress(id="b:end", global_time=1.0, said="").to_xml())
    assert (silent.said, silent.last_word) == ("", None)


@given(
    st.floats(-1e12, 1e12)
    | st.integers(-(10**12), 10**12)
    | st.integers(-(10**7), 10**7).map(lambda n: n / 2e6)
)
def test_to_xml_writes_times_to_the_microsecond(time: float) -> None:
    message = BlockProgress(id="b:end", global_time=time).to_xml()
    assert f'globalTime="{decimal(round(float(time), 6))}"' in message


def test_parse_feedback_refuses_bytes() -> None:
    with pytest.raises(TypeError, match="text: wanted a string, got bytes"):
        parse_feedback(b"<blockProgress/>")  # type: ignore[arg-type]


def test_block_progress_says_that_nothing_was_shown() -> None:
    message = BlockProgress(id="b:end", global_time=1.0, status="DONE", shown=False)
    assert 'realizer:shown="false"' in message.to_xml()
    assert parse_feedback(message.to_xml()) == message
    assert "shown" not in BlockProgress(id="b:end", global_time=1.0).to_xml()
