"""Tests of sync references."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import CORE, SyncRef, parse
from bml_schema.sync_refs import Names, Points, read_sync_ref, respelled
from tests.rows import each_row
from tests.strategies import numbers

STROKES = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")


def names() -> Names:
    return Names(
        "b1",
        {
            "nod-1": Points(STROKES, 3),
            "nod": Points(STROKES),
            "s": Points(("start", "end", "tm1", "tm-1", "tm", "a+1", "1")),
            "odd": None,
        },
    )


@each_row(
    "text, ref",
    [
        ("1.5", SyncRef(offset=1.5)),
        (" -2 ", SyncRef(offset=-2.0)),
        ("+.5", SyncRef(offset=0.5)),
        ("nod:start", SyncRef(behaviour="nod", sync="start")),
        ("nod:start + 1.5", SyncRef(behaviour="nod", sync="start", offset=1.5)),
        ("nod:start+1.5", SyncRef(behaviour="nod", sync="start", offset=1.5)),
        (" nod : end - .5", SyncRef(behaviour="nod", sync="end", offset=-0.5)),
        ("bml:start+2", SyncRef(behaviour="bml", sync="start", offset=2.0)),
        ("b1:bml:start", SyncRef(behaviour="bml", sync="start")),
        ("b1:nod:end-0.25", SyncRef(behaviour="nod", sync="end", offset=-0.25)),
        ("other:any:end-0.25", SyncRef(block="other", behaviour="any", sync="end", offset=-0.25)),
        ("other:bml:start+2", SyncRef(block="other", behaviour="bml", sync="start", offset=2.0)),
        ("anticipators:a:tap", SyncRef(block="anticipators", behaviour="a", sync="tap")),
        ("nod-1:stroke:2+0.5", SyncRef(behaviour="nod-1", sync="stroke", index=2, offset=0.5)),
        ("b1:nod-1:stroke:3", SyncRef(behaviour="nod-1", sync="stroke", index=3)),
        ("other:g:stroke:2", SyncRef(block="other", behaviour="g", sync="stroke", index=2)),
        ("nod:stroke:1", SyncRef(behaviour="nod", sync="stroke")),
        ("nod-1:stroke-0.5", SyncRef(behaviour="nod-1", sync="stroke", offset=-0.5)),
        ("s:tm-1", SyncRef(behaviour="s", sync="tm-1")),
        ("s:tm - 1", SyncRef(behaviour="s", sync="tm", offset=-1.0)),
        ("s:tm-2", SyncRef(behaviour="s", sync="tm", offset=-2.0)),
        ("s:tm-1-1", SyncRef(behaviour="s", sync="tm-1", offset=-1.0)),
        ("s:tm1+1", SyncRef(behaviour="s", sync="tm1", offset=1.0)),
        ("s:a+1", SyncRef(behaviour="s", sync="a+1")),
        ("s:1", SyncRef(behaviour="s", sync="1")),
        ("odd:whatever", SyncRef(behaviour="odd", sync="whatever")),
        ("my-block:my-nod:end", SyncRef(block="my-block", behaviour="my-nod", sync="end")),
    ],
)
def test_read_sync_ref_reads_every_form(text: str, ref: SyncRef) -> None:
    assert read_sync_ref(text, names()) == ref
    assert read_sync_ref(str(ref), names()) == ref


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "nod",
        "nod:",
        ":start",
        "::",
        "a:b:c:d",
        "nod:relax:2",
        "nod:stroke:0",
        "nod:stroke:x",
        "nod:stroke:-1",
        "nan",
        "inf",
        "1e3",
        "1e308",
        "-1E5",
        "1 2",
        "--1",
        "nod:stroke:²",
        "nod:stroke:1:2",
        "a:b:c:d:e",
        "+",
        "1:",
    ],
)
def test_read_sync_ref_refuses_other_forms(text: str) -> None:
    with pytest.raises(ValueError, match=r"wanted|no sync point|no behaviour"):
        read_sync_ref(text, names())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nod2:start", 'no behaviour "nod2" in this block, did you mean "nod"?'),
        ("zzzzzzz:start+1", 'no behaviour "zzzzzzz" in this block'),
        ("nod:strok", 'no sync point "strok" on "nod", did you mean "stroke"?'),
        ("nod:attackPeak", 'no sync point "attackPeak" on "nod"'),
        ("nod:start+x", 'no sync point "start+x" on "nod", did you mean "start"?'),
        ("nod:start+1+2", 'no sync point "start+1" on "nod", did you mean "start"?'),
        ("nod-1:stroke:4", 'wanted stroke:1..3 of "nod-1", got stroke:4'),
        ("bml:end", 'wanted "bml:start", got "bml:end"'),
        ("b1:start", 'no behaviour "b1" in this block, did you mean "bml:start"?'),
        ("99999", "wanted at most 86400 seconds, got 99999"),
        ("nod:start+" + "9" * 300, "wanted at most 86400 seconds"),
        ("a:" * 600, "wanted at most 1000 characters, got 1200"),
        ("1e308", "no exponent, NaN or infinity"),
    ],
)
def test_read_sync_ref_explains_what_is_wrong(text: str, said: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        read_sync_ref(text, names())
    assert said in str(caught.value)


def test_suggest_gives_up_after_some_suggestions() -> None:
    known = names()
    for _ in range(50):
        with pytest.raises(ValueError, match="no behaviour"):
            read_sync_ref("nod2:start", known)
    assert known.suggestions == 0


words = st.text("ab-+.01", min_size=1, max_size=5)


@given(words, words, st.none() | st.integers(1, 9), st.just(0.0) | numbers)
def test_sync_ref_reads_back_as_written(behaviour: str, sync: str, index: int | None, offset: float) -> None:
    known = Names("b", {behaviour: Points((sync, "stroke"), 9)})
    ref = SyncRef(behaviour=behaviour, sync="stroke" if index else sync, index=index, offset=offset)
    assert read_sync_ref(str(ref), known) == ref


@given(words, words, words, st.just(0.0) | numbers)
def test_sync_ref_into_another_block_reads_back_as_written(
    block: str, behaviour: str, sync: str, offset: float
) -> None:
    ref = SyncRef(block=block, behaviour=behaviour, sync=sync, offset=offset)
    assert read_sync_ref(str(ref), Names("own block")) == ref


@given(st.text(":+- 0.1astrokebml", max_size=20))
def test_read_sync_ref_of_any_text_is_a_reference_or_a_value_error(text: str) -> None:
    try:
        ref = read_sync_ref(text)
    except ValueError:
        return
    assert read_sync_ref(str(ref)) == ref


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("start+1", "f:start + 1"),
        ("start + 1.5", "f:start + 1.5"),
        ("end-.5", "f:end - 0.5"),
        ("attack_peak", "f:attackPeak"),
        ("500ms", "0.5"),
        ("1.5 s", "1.5"),
        ("1e-05", "0.00001"),
        ("s:end+1E-3", "s:end + 0.001"),
        ("my-block:s:end + 20 ms", "my-block:s:end + 0.02"),
        ("stroke+1", ""),  # no point of a face
        ("1e3", ""),
        ("1,5", ""),
        ("soon", ""),
        ("start+x", ""),
        ("99999999s", ""),
        ("", ""),
        ("1.5", ""),  # as it is
        ("a:start + 1", ""),
    ],
)
def test_respelled_has_the_reference_that_a_program_means(written: str, meant: str) -> None:
    assert respelled(written, "f", ("start", "attackPeak", "relax", "end")) == meant


def test_respelled_knows_no_own_points_without_a_behaviour() -> None:
    assert respelled("start+1", "", ("start", "end")) == ""


def test_times_of_programs_cause_one_warning_a_document() -> None:
    faces = "".join(
        f'<faceLexeme id="f{k}" lexeme="SMILE" start="{k}" end="start+1"/>'
        f'<head id="h{k}" lexeme="NOD" end="2s"/>'
        for k in range(5)
    )
    block = parse(f'<bml xmlns="{CORE}" id="b">{faces}</bml>')
    assert len(block.behaviours) == 10
    assert block["f3"].syncs["end"] == SyncRef(behaviour="f3", sync="start", offset=1.0)
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.dropped) == ("b", "NOT_BML_1_0", False)
    assert problem.text.startswith('times are read as BML 1.0 writes them: "start+1" as "f0:start + 1", ')
    assert problem.text.endswith("and 3 more")


def test_times_of_programs_are_faults_in_strict_bml() -> None:
    text = f'<bml xmlns="{CORE}" id="b"><head id="h" lexeme="NOD" end="start+1"/></bml>'
    assert not parse(text, strict_bml=True).behaviours
