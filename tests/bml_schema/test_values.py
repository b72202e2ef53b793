"""Tests of attribute values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import flag, integer, number, one_of, seconds, string, word
from bml_schema.values import block_name, block_names, decimal, describe_mismatch, name, names
from tests.strategies import attribute_values

AMOUNT = number(0, 1)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_decimal_has_no_exponent_and_reads_back(value: float) -> None:
    text = decimal(value)
    assert "e" not in text.lower()
    assert float(text) == value


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_decimal_refuses_nan_and_infinity(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        decimal(value)


@pytest.mark.parametrize(("text", "value"), [("0", 0), (" 1 ", 1), ("+.5", 0.5), ("0.", 0), ("00.25", 0.25)])
def test_number_reads_ordinary_decimals(text: str, value: float) -> None:
    assert AMOUNT.read(text) == value


BAD_NUMBERS = [
    "",
    " ",
    "x",
    "7",
    "-0.1",
    "nan",
    "NaN",
    "inf",
    "1e0",
    "1E-1",
    "1e308",
    "0x1",
    "1,5",
    "1_0",
    "١",
    "1 0",
]


@pytest.mark.parametrize("text", [*BAD_NUMBERS, "0." + "0" * 500, "1" * 5000])
def test_number_refuses_other_spellings_and_values_out_of_range(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - the sentence is made by who knows the attribute
        AMOUNT.read(text)


@pytest.mark.parametrize("text", ["nan", "-inf", "1e308", "1.5E+3"])
def test_number_message_for_an_exponent_has_a_hint(text: str) -> None:
    assert (
        describe_mismatch("0..1", text, text)
        == f"wanted 0..1 (a plain decimal number, no exponent, NaN or infinity), got {text}"
    )


@pytest.mark.parametrize("text", ["1.0", "", "1e2", "101", "²", "9" * 5000])
def test_integer_is_digits_in_range(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011
        integer(1, 100).read(text)


def test_one_of_is_case_sensitive_and_folds_on_request() -> None:
    with pytest.raises(ValueError, match="left"):
        one_of("LEFT", "RIGHT").read("left")
    assert one_of("LEFT", "RIGHT").fold("left") == "LEFT"
    assert one_of("linear", "instant").fold("Linear") == "linear"
    assert flag.fold("TRUE") is True
    assert one_of("LEFT", "RIGHT").fold("up") is None
    assert string.fold("x") is None
    assert one_of("LEFT", "RIGHT", "BOTH").wanted == "LEFT, RIGHT or BOTH"
    assert one_of("ONLY").wanted == "ONLY"


@pytest.mark.parametrize("text", ["", " ", "bml", "a:b", "a b", "a\tb", "x" * 257])
def test_name_has_no_blank_and_no_colon(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011
        name.read(text)


@pytest.mark.parametrize("text", ["nod-1", "a.b", "1", "-", "Ünïcode", "x" * 256])
def test_name_may_have_any_other_character(text: str) -> None:
    assert name.read(f" {text} ") == text


def test_block_name_may_have_a_blank() -> None:
    assert block_name.read("my block") == "my block"


@pytest.mark.parametrize(("text", "value"), [("true", True), ("1", True), ("false", False), (" 0 ", False)])
def test_flag_is_true_or_false(text: str, value: bool) -> None:
    assert flag.read(text) is value
    with pytest.raises(ValueError):  # noqa: PT011
        flag.read("yes")


def test_names_have_commas_or_blanks_between_them_block_names_commas() -> None:
    assert names.read(" a,b  c ,") == ("a", "b", "c")
    assert block_names.read(" a b,c ,") == ("a b", "c")
    assert names.read(" ") == block_names.read("") == ()


@given(st.data())
def test_value_reads_back_what_it_writes(data: st.DataObject) -> None:
    kinds = [AMOUNT, integer(-3, 3), one_of("A", "B"), flag, word, seconds, string, names, block_names]
    kind = data.draw(st.sampled_from(kinds))
    value = data.draw(attribute_values(kind))
    assert kind.read(kind.write(value)) == value
