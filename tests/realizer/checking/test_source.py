"""Tests of `realizer.check`."""

from __future__ import annotations

from pathlib import Path

import pytest

import realizer

WRONG = '<bml id="b">\n<faceLexeme id="f" lexeme="SMIL"/>\n</bml>'


def test_check_finds_a_fault_with_its_place_and_help() -> None:
    (fault,) = realizer.check(WRONG)
    assert (fault.line, fault.column) == (2, 28)
    assert fault.id == "b:f"
    assert fault.type == "CANNOT_CREATE_BEHAVIOR"
    assert "lexeme: wanted" in fault.text
    assert "SMILE" in fault.help


def test_check_names_the_document(tmp_path: Path) -> None:
    (tmp_path / "x.bml").write_text(WRONG)
    faults = realizer.check([WRONG, tmp_path / "x.bml"])
    assert [fault.file for fault in faults] == ["document 1", str(tmp_path / "x.bml")]
    assert str(faults[1]).startswith(f"{tmp_path / 'x.bml'}:2:28: CANNOT_CREATE_BEHAVIOR b:f: line 2")


@pytest.mark.parametrize("source", ["<bml/>", "<bml id='b'><oops", "", b" ", "<!-- nothing -->"])
def test_check_finds_what_is_no_document(source: str) -> None:
    assert realizer.check(source)


def test_check_finds_nothing_in_a_text_that_is_spoken() -> None:
    assert realizer.check("Hello there") == []


def test_check_says_once_what_is_left_out_of_a_text() -> None:
    (finding,) = realizer.check("Hello <breeak/> there.")
    assert "<breeak>" in finding.text


def test_check_adds_advice_on_request() -> None:
    early = '<bml id="b"><gaze id="g" target="ball" start="0" end="2"/></bml>'
    assert realizer.check(early) == []
    assert {finding.type for finding in realizer.check(early, advice=True)} == {"ADVICE"}


def test_check_reports_a_missing_file() -> None:
    with pytest.raises(FileNotFoundError):
        realizer.check("no.bml")


def test_check_refuses_advice_that_is_no_flag() -> None:
    with pytest.raises(TypeError, match="advice: wanted True or False, got 'no'"):
        realizer.check(WRONG, advice="no")  # type: ignore[arg-type]
