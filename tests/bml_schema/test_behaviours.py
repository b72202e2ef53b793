"""Tests of the behaviours of BML 1.0."""

import pytest

from bml_schema import (
    BMLA,
    CORE,
    EXTENSIONS,
    OWN,
    VOCABULARY,
    Behaviour,
    Block,
    Face,
    FaceFacs,
    FaceLexeme,
    Posture,
    Speech,
    SpeechText,
    Sync,
    SyncRef,
    Wait,
    parse,
    read,
    write,
)
from bml_schema.node_schema import schema_of
from tests.rows import each_row

# What an element needs beyond its required attributes; children without namespace.
LEAST = {
    "face": "<faceLexeme lexeme='SMILE'/>",
    "faceShift": "<faceLexeme lexeme='SMILE'/>",
    "parametervaluechange": "<trajectory type='instant' targetValue='0'/>",
    "faps": "<fap number='3' value='1'/>",
}
MORE = {"emotion": "name='joy'", "mood": "name='joy'"}
SAMPLES = {"integer": "1", "decimal": "0.25", "behaviourName": "other:one"}


def sample(cls: type[Behaviour], *, leave_out: str = "", extra: str = "") -> str:
    """Return a document with one behaviour that has exactly its required attributes."""
    space, name = cls.tag[1:].split("}")
    values = {
        a.name: a.value.words[0] if a.value.words else SAMPLES.get(a.value.type, "X")
        for a in schema_of(cls).required
    }
    attributes = "".join(f" {k}='{v}'" for k, v in values.items() if k not in (leave_out, "id"))
    inside = LEAST.get(name, "")
    more = MORE.get(name, "")
    if extra.startswith(("name=", "angle=")):
        more = ""
    start = f"<n:{name} xmlns:n='{space}' id='x'{attributes} {more} {extra}>"
    return f"<bml id='b' xmlns='{CORE}'>{start}{inside}</n:{name}></bml>"


EACH = each_row("cls", VOCABULARY.values())


@EACH
def test_behaviour_with_its_required_attributes_is_enough(cls: type[Behaviour]) -> None:
    block = parse(sample(cls))
    assert not block.problems
    assert type(block["x"]) is cls
    assert parse(write(block)) == block


@EACH
def test_behaviour_misses_each_required_attribute(cls: type[Behaviour]) -> None:
    for spec in schema_of(cls).required:
        if spec.name == "id":
            continue
        problems = parse(sample(cls, leave_out=spec.name)).problems
        assert [(p.id, p.type) for p in problems] == [("b:x", "PARSING_FAILURE")]
        assert problems[0].text == f"{spec.name}: wanted {spec.value.wanted}, got none"


@EACH
def test_behaviour_sync_points_can_be_given_and_referred_to(cls: type[Behaviour]) -> None:
    for n, point in enumerate(cls.sync_points):
        block = parse(sample(cls, extra=f"{point}='{n}'"))
        assert block["x"].syncs[point].offset == n
        text = sample(cls).replace("</bml>", f"<wait id='w' start='x:{point}'/></bml>")
        assert not parse(text).problems


@EACH
def test_behaviour_refuses_a_word_outside_a_closed_set(cls: type[Behaviour]) -> None:
    for spec in schema_of(cls).attributes.values():
        if spec.value.words and not spec.required:
            problems = parse(sample(cls, extra=f"{spec.name}='SIDEWAYS'")).problems
            assert [p.text for p in problems] == [f'{spec.name}: wanted {spec.value.wanted}, got "SIDEWAYS"']


@EACH
def test_behaviour_refuses_invalid_numbers(cls: type[Behaviour]) -> None:
    for spec in schema_of(cls).attributes.values():
        if spec.value.low is not None and not spec.required:
            for bad in ("nan", "inf", "1e308", "x", "", "99999999999"):
                name = spec.name.replace(f"{{{BMLA}}}", "a:").replace(f"{{{OWN}}}", "o:")
                extra = f"{name}='{bad}' xmlns:a='{BMLA}' xmlns:o='{OWN}'"
                assert len(parse(sample(cls, extra=extra)).problems) == 1, (spec.name, bad)


@EACH
def test_behaviour_keeps_unknown_attributes(cls: type[Behaviour]) -> None:
    block = parse(sample(cls, extra="xmlns:q='urn:q' q:a='1' unheardOf='2'"))
    assert block["x"].unknown_attributes == {"{urn:q}a": "1", "unheardOf": "2"}
    assert parse(write(block)) == block


def only(inside: str) -> Block:
    return parse(f"<bml id='b'>{inside}</bml>")


def test_face_parts_share_its_timing_and_need_no_id() -> None:
    block = only(
        "<face id='f' start='1'><faceLexeme lexeme='SMILE' end='9'/><faceFacs au='4' side='LEFT'/></face>"
    )
    face = block["f"]
    assert isinstance(face, Face)
    assert face.parts == (
        FaceLexeme(id="", lexeme="SMILE", unknown_attributes={"end": "9"}),
        FaceFacs(id="", au=4, side="LEFT"),
    )
    assert not face.parts[0].syncs


def test_face_without_parts_is_refused() -> None:
    assert only("<face id='f'/>").problems[0].text == "wanted <faceLexeme> or <faceFacs>, got none"


def test_face_with_a_bad_part_is_dropped() -> None:
    block = only("<face id='f'><faceFacs au='4'/>\n<faceFacs au='x'/></face>")
    assert [str(p) for p in block.problems] == [
        'line 2, /bml/face[1]/faceFacs[2]: au: wanted a whole number 1..999, got "x"'
    ]


def test_face_facs_is_found_in_the_core_namespace_and_in_none() -> None:
    for space in ("", f"xmlns='{CORE}'", "xmlns='http://www.mindmakers.org/projects/BML'"):
        block = parse(f"<bml id='b' {space}><faceFacs id='f' au='1'/></bml>")
        assert type(block["f"]) is FaceFacs
        assert f'xmlns:ext="{EXTENSIONS}"' in write(block)


def test_speech_keeps_every_blank_and_every_sync() -> None:
    block = only(
        "<speech id='s'>"
        "<text>\n  Hi <sync id='a'/>\n<sync id='b' ref='2'/> <![CDATA[<you> &]]> </text>"
        "</speech>"
    )
    speech = block["s"]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert speech.text.parts[0] == "\n  Hi "
    assert speech.text.parts[1] == Sync(id="a")
    assert speech.text.parts[2] == "\n"
    assert speech.text.parts[4] == " <you> & "
    assert str(speech.text) == "\n  Hi \n <you> & "
    assert speech.marked == ("a", "b")
    assert parse(write(block)) == block


def test_speech_distinguishes_an_empty_text_from_none() -> None:
    block = only("<speech id='s'><text/></speech>")
    assert block["s"] == Speech(id="s", text=SpeechText())
    assert parse(write(block)) == block


def test_speech_text_keeps_its_language() -> None:
    block = only("<speech id='s'><text xml:lang='nl'>Dag</text></speech>")
    assert block["s"] == Speech(id="s", text=SpeechText(parts=("Dag",), language="nl"))
    assert parse(write(block)) == block


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("<text>a</text><text>b</text>", "wanted one <text>, got 2"),
        ("<texte>a</texte>", 'wanted <text>, got <texte>, did you mean "text"?'),
        ("Hello", 'wanted elements, got the text "Hello", put it into <text>'),
        ("<text/>Hello", 'wanted elements, got the text "Hello", put it into <text>'),
        ("<txt>Hello</txt>", "wanted <text>, got <txt>"),
    ],
)
def test_speech_with_wrong_content_is_spoken_with_a_warning(inside: str, said: str) -> None:
    block = only(f"<speech id='s'>{inside}</speech>")
    assert [b.id for b in block.behaviours] == ["s"]
    assert block.problems[0].text.startswith(said)
    assert not block.problems[0].dropped
    (strict,) = read(f"<bml xmlns='{CORE}' id='b'><speech id='s'>{inside}</speech></bml>", strict_bml=True)
    assert isinstance(strict, Block)
    assert not strict.behaviours


def test_posture_has_one_stance_and_any_poses() -> None:
    block = only("<posture id='p'><pose part='HEAD' lexeme='X'/><stance type='LYING'/></posture>")
    posture = block["p"]
    assert isinstance(posture, Posture)
    assert posture.stance is not None
    assert (posture.stance.type, len(posture.poses)) == ("LYING", 1)
    assert (
        "wanted one <stance>"
        in only("<posture id='p'><stance type='LYING'/><stance type='LYING'/></posture>").problems[0].text
    )


def test_wait_reads_the_name_of_its_duration_in_drafts() -> None:
    assert only("<wait id='w' max-wait='2'/>").children == (Wait(id="w", duration=2.0),)
    both = only("<wait id='w' max-wait='2' duration='1'/>").children
    assert both == (Wait(id="w", duration=1.0, unknown_attributes={"max-wait": "2"}),)
    assert only("<wait id='w' max-wait='x'/>").problems[0].text.startswith("max-wait: wanted seconds")


def test_speech_without_text_is_empty() -> None:
    block = only("<speech id='s'/>")
    assert block.children == (Speech(id="s"),)
    assert not block.problems


def test_speech_references_are_of_its_sync_points_and_its_text() -> None:
    speech = only("<speech id='s' start='1'><text>a<sync id='m' ref='2'/><sync id='n'/></text></speech>")["s"]
    assert speech.references == (("start", SyncRef(offset=1.0)), ("m", SyncRef(offset=2.0)))
    assert isinstance(speech, Speech)
    moved = speech.with_references(lambda sync: SyncRef(offset=9.0) if sync.id == "n" else None)
    assert moved.references == (("start", SyncRef(offset=1.0)), ("n", SyncRef(offset=9.0)))
