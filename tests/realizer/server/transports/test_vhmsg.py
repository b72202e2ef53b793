"""VHMSG without a broker: vrSpeak gives documents, feedback gives vrAgentBML."""

from __future__ import annotations

import json
import math
from urllib.parse import quote, quote_plus, unquote

import pytest

from bml_schema import BMLError, parse, read
from bml_schema.feedback import BlockPrediction, BlockProgress, PredictionFeedback, WarningFeedback
from realizer.core.options import PlayOptions
from realizer.pipeline import plan
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.server.transports.message_formats import Disconnect, Inbound
from realizer.server.transports.vhmsg import Vhmsg
from realizer.speech.silent import SilentVoice

pytestmark = pytest.mark.xdist_group("brokers")

TRICKY = '<bml id="b"><speech id="s"><text>50 % + é &amp; more</text></speech></bml>'


def progress(block: str, point: str, status: str | None = None) -> str:
    return BlockProgress(id=f"{block}:{point}", global_time=1.0, status=status).to_xml()


def planned(block: str) -> str:
    return PredictionFeedback(blocks=(BlockPrediction(id=block, global_start=0, global_end=1),)).to_xml()


def vhmsg() -> Vhmsg:
    return Vhmsg("/topic/DEFAULT_SCOPE", 2**20)


def spoken(dialect: Vhmsg, text: str) -> list[str]:
    """The documents a message gives."""
    actions = dialect.incoming(quote(text).encode())
    assert all(isinstance(action, Inbound) for action in actions)
    return [action.text for action in actions if isinstance(action, Inbound)]


def said(messages) -> list[str]:
    """Return the decoded texts of messages, whose headers must match them."""
    for message in messages:
        assert message.topic == "/topic/DEFAULT_SCOPE"
        assert message.headers["ELVISH_SCOPE"] == "DEFAULT_SCOPE"
        assert message.headers["MESSAGE_PREFIX"] == unquote(message.body).split()[0]
        assert " " not in message.body
    return [unquote(message.body) for message in messages]


ACT = '<?xml version="1.0"?><act><participant id="Brad" role="actor"/>{}</act>'


@pytest.mark.parametrize("encode", [quote, quote_plus, lambda text: text])
@pytest.mark.parametrize("around", [ACT, "{}"])
def test_vhmsg_gives_the_agent_to_the_bml_of_a_vrspeak(encode, around: str) -> None:
    text = f"vrSpeak Brad ALL m1 {around.format(TRICKY)}"
    ((document),) = vhmsg().incoming(encode(text).encode())
    assert isinstance(document, Inbound)
    block = parse(document.text)
    assert (block.id, block.character_id) == ("b", "Brad")
    assert "50 % + é &amp; more" in document.text


@pytest.mark.parametrize(
    ("start", "id", "character"),
    [
        ("<bml>", "m-1", "Brad"),
        ('<bml id="x">', "x", "Brad"),
        ('<bml id="">', "m-1", "Brad"),
        ("<bml id=' '>", "m-1", "Brad"),
        ('<bml id="x" characterId="Rachel">', "x", "Rachel"),
        ('<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0"\n>', "m-1", "Brad"),
    ],
)
def test_vhmsg_gives_its_id_to_a_block_without_one(start: str, id: str, character: str) -> None:
    (text,) = spoken(vhmsg(), f'vrSpeak Brad ALL m-1 {start}<wait id="w"/></bml>')
    block = parse(text)
    assert (block.id, block.character_id, len(block.behaviours)) == (id, character, 1)


def test_vhmsg_lets_documents_be_read_as_those_of_smartbody() -> None:
    (text,) = spoken(vhmsg(), 'vrSpeak Brad ALL m1 <act><bml><gaze target="table"/></bml></act>')
    block = parse(text)
    assert [node.id for node in block.behaviours] == ["gaze1"]
    assert [p.type for p in block.problems] == ["NOT_BML_1_0"]


def test_vhmsg_writes_an_empty_element_and_awkward_names() -> None:
    (text,) = spoken(vhmsg(), 'vrSpeak A"&B ALL m:1/2 <bml/>')
    block = parse(text)
    assert (block.id, block.character_id) == ("m_1_2", 'A"&B')


def test_vhmsg_renames_blocks_whose_id_is_used() -> None:
    dialect = vhmsg()
    ids = [parse(spoken(dialect, f'vrSpeak A ALL {m} <bml id="same"/>')[0]).id for m in ("m1", "m2", "m2")]
    assert ids == ["same", "m2", "m2-2"]


def test_vhmsg_reports_a_vrspeak_from_start_to_end() -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    assert said(dialect.outgoing(planned("m1"))) == []
    assert said(dialect.outgoing(progress("m1", "start", "IN_EXEC"))) == ["vrAgentBML Brad ALL m1 start"]
    assert said(dialect.outgoing(progress("m1", "end", "DONE"))) == [
        "vrAgentBML Brad ALL m1 end complete",
        "vrSpoke Brad ALL m1",
    ]
    assert said(dialect.outgoing(progress("m1", "end", "DONE"))) == []


def test_vhmsg_starts_several_blocks_once_and_ends_with_the_last() -> None:
    dialect = vhmsg()
    assert len(spoken(dialect, 'vrSpeak Brad ALL m1 <act><bml id="x"/><bml id="y"/></act>')) == 2
    messages = [progress("x", "start"), progress("y", "start"), progress("x", "end"), progress("y", "end")]
    counts = [len(dialect.outgoing(feedback)) for feedback in messages]
    assert counts == [1, 0, 0, 2]


@pytest.mark.parametrize("status", ["INTERRUPTED", "REVOKED"])
def test_vhmsg_reports_an_interrupted_block(status: str) -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    assert said(dialect.outgoing(progress("m1", "end", status))) == ["vrAgentBML Brad ALL m1 end interrupted"]


def test_vhmsg_ends_a_refused_block_with_its_error() -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    warning = WarningFeedback(id="m1", type="PARSING_FAILURE", text="not\n well-formed")
    assert said(dialect.outgoing(warning.to_xml())) == [
        "vrAgentBML Brad ALL m1 end error not well-formed",
        "vrSpeakFailed Brad ALL m1 not well-formed",
    ]


def test_vhmsg_ends_a_block_whose_id_cannot_be_used_with_its_error() -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    dialect.outgoing(planned("m1"))
    (document,) = spoken(dialect, 'vrSpeak Brad ALL m2 <bml id="a:b"/>')
    spoken(dialect, "vrSpeak Brad ALL m3 <bml/>")
    (error,) = read(document)
    assert isinstance(error, BMLError)
    messages = said(dialect.outgoing(WarningFeedback(**parse_warning(error).to_json()).to_xml()))
    assert messages[0].startswith("vrAgentBML Brad ALL m2 end error line 1, /bml: id: wanted a name")
    assert messages[1].startswith("vrSpeakFailed Brad ALL m2 ")
    assert said(dialect.outgoing(progress("m3", "start"))) == ["vrAgentBML Brad ALL m3 start"]


def test_vhmsg_ignores_a_dropped_behaviour_or_a_late_warning() -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    assert dialect.outgoing(WarningFeedback(id="m1:n", type="X", text="").to_xml()) == []
    dialect.outgoing(planned("m1"))
    assert dialect.outgoing(WarningFeedback(id="m1", type="X", text="").to_xml()) == []
    assert said(dialect.outgoing(progress("m1", "end", "DONE")))[0].endswith("end complete")


def test_vhmsg_ends_with_the_reason_if_nothing_plays() -> None:
    dialect = vhmsg()
    spoken(dialect, "vrSpeak Brad ALL m1 <bml/>")
    dialect.outgoing(WarningFeedback(id="m1:x", type="X", text="id: wanted one, got none").to_xml())
    dialect.outgoing(planned("m1"))
    assert said(dialect.outgoing(progress("m1", "end", "DONE")))[0].endswith(
        "end error id: wanted one, got none"
    )


def test_vhmsg_names_the_dialect_that_strict_bml_refuses() -> None:
    dialect, player = vhmsg(), Player(PlayOptions(idle=False, strict_bml=True))
    (document,) = spoken(dialect, 'vrSpeak Brad ALL m1 <act><bml><head type="NOD"/></bml></act>')
    plan([document], player, SilentVoice())
    messages = [m for f in player.due(math.inf) for m in said(dialect.outgoing(f.to_xml()))]
    assert messages[1].startswith("vrAgentBML Brad ALL m1 end error line 1, /bml/head[1]: id: wanted")
    assert messages[1].endswith("this is SmartBody's BML, which is not read in strict BML")


@pytest.mark.parametrize("xml", ["", "hello", "speech_01.xml", "<act/>", "<bml><head", "<?xml?>"])
def test_vhmsg_ends_a_vrspeak_without_a_document_with_an_error(xml: str) -> None:
    first, second = said(vhmsg().incoming(f"vrSpeak Brad ALL m1 {xml}".encode()))
    assert first.startswith("vrAgentBML Brad ALL m1 end error wanted")
    assert second.startswith("vrSpeakFailed Brad ALL m1 wanted")


def test_vhmsg_stops_what_plays_at_the_vrspoke_of_another_component() -> None:
    dialect = vhmsg()
    spoken(dialect, 'vrSpeak Brad ALL m1 <bml id="x"/>')
    assert dialect.incoming(b"vrSpoke Brad ALL m2") == []
    assert dialect.incoming(b"vrSpoke Rachel ALL m1") == []
    (stop,) = dialect.incoming(b"vrSpoke%20Brad%20ALL%20m1%20words")
    assert isinstance(stop, Inbound)
    assert json.loads(stop.text) == {"type": "stop", "blocks": ["x"]}
    dialect.outgoing(progress("x", "end", "INTERRUPTED"))
    assert dialect.incoming(b"vrSpoke Brad ALL m1") == []


def test_vhmsg_answers_components_and_leaves_when_killed() -> None:
    dialect = vhmsg()
    here = ["vrComponent renderer bml-realizer"]
    assert said(dialect.hello()) == said(dialect.incoming(b"vrAllCall")) == here
    for who in ("renderer", "all", "bml-realizer"):
        assert dialect.incoming(f"vrKillComponent%20{who}".encode()) == [Disconnect()]
    for text in (
        "vrKillComponent tts",
        "vrComponent renderer x",
        "vrExpress a b c d",
        "",
        "%FF",
        "vrSpeak a",
    ):
        assert dialect.incoming(text.encode()) == []


def test_vhmsg_reports_open_speeches_as_interrupted_at_the_end() -> None:
    dialect = vhmsg()
    spoken(dialect, 'vrSpeak Brad ALL m1 <bml id="x"/><bml id="y"/>')
    assert said(dialect.farewell()) == ["vrAgentBML Brad ALL m1 end interrupted"]
    assert dialect.farewell() == []
