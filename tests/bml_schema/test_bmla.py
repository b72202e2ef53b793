"""Tests of the behaviours of BMLA and BMLT."""

import pytest

from bml_schema import (
    BMLA,
    BMLT,
    CORE,
    Activate,
    AudioFile,
    Behaviour,
    Block,
    FaceInterpolator,
    FaceKeyframe,
    Interrupt,
    ParameterValueChange,
    Trajectory,
    parse,
    write,
)


def only(inside: str) -> Behaviour:
    """Return the one behaviour of a document, after writing and reading it."""
    block = document(inside)
    assert not block.problems
    assert parse(write(block)) == block
    (behaviour,) = block.behaviours
    return behaviour


def document(inside: str) -> Block:
    return parse(f"<bml id='b' xmlns='{CORE}' xmlns:bmla='{BMLA}' xmlns:bmlt='{BMLT}'>{inside}</bml>")


@pytest.mark.parametrize("listed", ["n1,n-2", "n1, n-2", "n1 n-2", " n1 ,, n-2 "])
def test_interrupt_separates_behaviours_by_commas_or_blanks(listed: str) -> None:
    assert only(f"<bmla:interrupt id='i' target='b1' include='{listed}'/>") == Interrupt(
        id="i", target="b1", include=("n1", "n-2")
    )
    assert only(f"<bmla:interrupt id='i' target='b1' exclude='{listed}'/>") == Interrupt(
        id="i", target="b1", exclude=("n1", "n-2")
    )


def test_interrupt_with_an_empty_list_has_none() -> None:
    assert only("<bmla:interrupt id='i' target='b1' include='' exclude=' '/>") == Interrupt(
        id="i", target="b1"
    )


def test_interrupt_refuses_to_write_a_name_with_a_comma() -> None:
    node = Interrupt(id="i", target="b1", include=("a,b",))
    with pytest.raises(ValueError, match='wanted a name without ","'):
        write(Block(id="b", children=(node,)))


def test_activate_names_a_block() -> None:
    assert only("<bmla:activate id='a' target='my block' start='1'/>").tag == f"{{{BMLA}}}activate"
    assert isinstance(only("<bmla:activate id='a' target='b2'/>"), Activate)


@pytest.mark.parametrize(
    "tag", ["bmla:trajectory", "bmlt:trajectory", "trajectory", "x:trajectory xmlns:x=''"]
)
def test_trajectory_is_found_in_any_namespace(tag: str) -> None:
    if tag.startswith("x:"):
        tag = "trajectory xmlns=''"
    inside = f"<{tag} type='linear' initialValue='1' targetValue='-0.5'/>"
    start = "<bmla:parametervaluechange id='p' target='b1:s1' paramId='volume'>"
    node = only(f"{start}{inside}</bmla:parametervaluechange>")
    assert node == ParameterValueChange(
        id="p",
        target=("b1", "s1"),
        param_id="volume",
        trajectory=Trajectory(type="linear", initial_value=1.0, target_value=-0.5),
    )


@pytest.mark.parametrize(
    ("target", "inside", "said"),
    [
        ("b1", "<trajectory type='instant' targetValue='1'/>", 'target: wanted block:behaviour, got "b1"'),
        ("b1:", "<trajectory type='instant' targetValue='1'/>", 'target: wanted block:behaviour, got "b1:"'),
        (
            "a:b:c",
            "<trajectory type='instant' targetValue='1'/>",
            'target: wanted block:behaviour, got "a:b:c"',
        ),
        ("b1:s", "", "wanted <trajectory>, got none"),
        ("b1:s", "<trajectory type='slow' targetValue='1'/>", 'type: wanted linear or instant, got "slow"'),
        ("b1:s", "<trajectory type='linear'/>", "targetValue: wanted -1e+06..1e+06, got none"),
        ("b1:s", "<trajectory type='instant' targetValue='1'/>" * 2, "wanted one <trajectory>, got 2"),
    ],
)
def test_parameter_value_change_refuses_wrong_content(target: str, inside: str, said: str) -> None:
    start = f"<bmla:parametervaluechange id='p' target='{target}' paramId='volume'>"
    block = document(f"{start}{inside}</bmla:parametervaluechange>")
    assert [(p.id, p.text) for p in block.problems] == [("b:p", said)]


def test_audio_file_has_a_name() -> None:
    assert only("<bmlt:audiofile id='a' fileName='a b.wav' start='1'/>").id == "a"
    node = only("<bmlt:audiofile id='a' fileName='a b.wav'/>")
    assert node == AudioFile(id="a", file_name="a b.wav")


@pytest.mark.parametrize("tag", ["bmlt:FaceInterpolator", "bmla:FaceInterpolator", "FaceInterpolator"])
def test_face_keyframe_keeps_its_keys_as_written(tag: str) -> None:
    inside = f"<{tag} parts='1.BOTH 12.LEFT'>\n 0 0 0\n 0.5 1 .5\n</{tag.split()[0]}>"
    node = only(f"<bmlt:facekeyframe id='k' type='FACS' end='2'>{inside}</bmlt:facekeyframe>")
    assert isinstance(node, FaceKeyframe)
    assert node.type == "FACS"
    assert node.interpolator == FaceInterpolator(parts="1.BOTH 12.LEFT", keys="\n 0 0 0\n 0.5 1 .5\n")


def test_face_keyframe_by_name_needs_no_keys() -> None:
    assert only("<bmlt:facekeyframe id='k' name='smile.xml'/>") == FaceKeyframe(id="k", name="smile.xml")


def test_priority_of_a_behaviour_is_in_the_namespace_of_bmla() -> None:
    assert only("<head id='h' lexeme='NOD' bmla:priority='2.5'/>").priority == 2.5
    block = document("<head id='h' lexeme='NOD' bmla:priority='high'/>")
    assert block.problems[0].text.endswith('wanted -1e+06..1e+06, got "high"')
