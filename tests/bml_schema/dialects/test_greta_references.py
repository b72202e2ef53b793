"""Tests of heads and faces that a description of Greta names."""

import pytest

from bml_schema import Block, parse
from realizer import schedule
from realizer.behaviours.registry import VOCABULARY

DESCRIPTION = '<description level="1" type="gretabml"><reference>{}</reference></description>'


def read(element: str) -> Block:
    return parse(f"<fml-apml><bml id='b'>{element}</bml></fml-apml>", VOCABULARY)


@pytest.mark.parametrize(
    ("reference", "lexeme"),
    [("head=head_nod", "NOD"), ("head_shake", "SHAKE"), ("Nod_Big", "NOD"), ("head=head_tilt", "TILT")],
)
def test_translate_reference_gives_a_head_its_lexeme(reference: str, lexeme: str) -> None:
    (head,) = read(f'<head id="h">{DESCRIPTION.format(reference)}</head>').behaviours
    assert head.lexeme == lexeme


@pytest.mark.parametrize(
    ("reference", "lexeme"),
    [("faceexp=joyWeak", "JOY"), ("mouth=smile", "smile"), ("eyebrows=raise_eyebrows", "RAISE_BROWS")],
)
def test_translate_reference_gives_a_face_its_part(reference: str, lexeme: str) -> None:
    text = f'<face id="f" start="1" end="2">{DESCRIPTION.format(reference)}</face>'
    (face,) = read(text).behaviours
    assert [part.lexeme for part in face.parts] == [lexeme]
    assert schedule(f"<fml-apml><bml id='b'>{text}</bml></fml-apml>")["f"]["end"] == 2.0


def test_translate_reference_keeps_what_a_behaviour_has() -> None:
    description = DESCRIPTION.format("head=head_nod")
    head, face = read(
        f'<head id="h" lexeme="SHAKE">{description}</head>'
        f'<face id="f"><lexeme lexeme="SMILE"/>{description}</face>'
    ).behaviours
    assert head.lexeme == "SHAKE"
    assert [part.lexeme for part in face.parts] == ["SMILE"]


def test_translate_reference_leaves_descriptions_of_others() -> None:
    text = '<head id="h"><description type="x"><reference>head=head_nod</reference></description></head>'
    assert not read(text).behaviours
