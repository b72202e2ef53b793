"""Tests of errors, problems and suggestions."""

import pickle

import pytest

from bml_schema import BMLError, BMLSyntaxError, Problem
from bml_schema.errors import at, did_you_mean, listed, quoted


def test_bml_error_has_line_path_wanted_and_got() -> None:
    error = BMLError("amount: wanted 0..1, got 7", line=3, path="/bml/head[1]")
    assert str(error) == "line 3, /bml/head[1]: amount: wanted 0..1, got 7"


def test_bml_error_without_place_is_its_text() -> None:
    assert str(BMLError("nothing")) == "nothing"
    assert at(2, "", "odd") == "line 2: odd"


def test_bml_error_can_be_pickled() -> None:
    error = BMLSyntaxError("odd", line=3, path="/bml", block="b")
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is BMLSyntaxError
    assert (back.text, back.line, back.path, back.block) == ("odd", 3, "/bml", "b")


def test_problem_reads_like_an_error() -> None:
    problem = Problem(id="b:h", type="PARSING_FAILURE", text="odd", line=3, path="/bml/head[1]")
    assert str(problem) == "line 3, /bml/head[1]: odd"


@pytest.mark.parametrize(("value", "said"), [("7", "7"), ("-0.5", "-0.5"), ("left", '"left"'), ("", '""')])
def test_quoted_shows_numbers_bare_and_words_quoted(value: str, said: str) -> None:
    assert quoted(value) == said


def test_quoted_cuts_a_value_of_more_than_60_characters() -> None:
    assert quoted("x" * 60) == f'"{"x" * 60}"'
    assert quoted("x" * 61) == quoted("x" * 1000) == f'"{"x" * 60}..."'


def test_did_you_mean_suggests_a_near_name() -> None:
    assert did_you_mean("nod2", ["speech1", "nod1"]) == ', did you mean "nod1"?'
    assert did_you_mean("nod2", ["speech1"]) == ""
    assert did_you_mean("n" * 1000, ["n" * 999]) == ""


@pytest.mark.parametrize(("before", "found"), [(499, True), (500, False)])
def test_did_you_mean_looks_at_the_first_500_choices(before: int, found: bool) -> None:
    assert (did_you_mean("nod2", [*["speech1"] * before, "nod1"]) != "") is found


def test_listed_tells_how_many_words_it_leaves_out() -> None:
    assert listed(["a", "b"], 2) == "a, b"
    assert listed(["a", "b", "c"], 2) == "a, b and 1 more"
