"""Tests of the vocabulary."""

from bml_schema import BMLA, BMLT, CORE, EXTENSIONS, OWN, VOCABULARY

ELEMENTS = {
    CORE: "gaze gazeShift head headDirectionShift faceLexeme face faceShift speech wait gesture pointing"
    " posture postureShift locomotion",
    EXTENSIONS: "faceFacs",
    BMLA: "interrupt activate parametervaluechange",
    BMLT: "audiofile blinkemitter facekeyframe",
    OWN: "emotion mood expression faps fapFile timeline blink idle listen",
}


def test_vocabulary_is_the_core_and_the_extensions() -> None:
    assert set(VOCABULARY) == {
        f"{{{space}}}{name}" for space, names in ELEMENTS.items() for name in names.split()
    }


def test_vocabulary_has_the_class_of_each_element() -> None:
    assert all(cls.tag == tag for tag, cls in VOCABULARY.items())
