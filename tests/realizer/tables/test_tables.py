"""Tests of the tables and of their readers."""

import math
from collections import defaultdict
from importlib.resources import files
from itertools import product

import pytest

from realizer import tables
from realizer.core.errors import TableError
from realizer.tables import lexemes, timing
from tests.rows import each_row

FAPS = {row.fap: row for row in tables.faps()}
AUS = tables.by_number()
ROWS = tables.au_to_fap()

# Wojdel 2005, appendix A: the action units of Ekman and Friesen.
FACS = {1, 2, *range(4, 40), *range(41, 47), *range(51, 59), *range(61, 67)} - {3, 40}


def polylines() -> dict[tuple[int, str, int], list[tuple[float, float]]]:
    points: dict[tuple[int, str, int], list[tuple[float, float]]] = defaultdict(list)
    for row in sorted(ROWS, key=lambda row: (*row.key, row.au_from)):
        points[row.key] += [(row.au_from, row.fap_from), (row.au_to, row.fap_to)]
    return points


def at_one(au: int, side: str, fap: int) -> float:
    return sum(points[-1][1] for key, points in polylines().items() if key == (au, side, fap))


@each_row("name", [f.name for f in files(tables).iterdir() if f.name.endswith((".csv", ".toml"))])
def test_tables_name_source_units_and_licence(name: str) -> None:
    tables._check_head(tables.text_of(name), name)


def test_faps_are_the_68_of_the_standard_in_order() -> None:
    assert [row.fap for row in tables.faps()] == list(range(1, 69))
    sizes: dict[int, int] = defaultdict(int)
    for row in tables.faps():
        sizes[row.group] += 1
    assert list(sizes.values()) == [2, 16, 12, 8, 4, 5, 3, 10, 4, 4]


def test_faps_that_stop_at_zero_are_the_five_unidirectional_ones() -> None:
    assert {row.fap for row in tables.faps() if row.least == 0 and row.most > 0} == {3, 14, 41, 42, 47}


def test_faps_are_the_mirror_of_their_mirror() -> None:
    for row in tables.faps():
        other = FAPS[row.mirror]
        assert other.mirror == row.fap
        assert other.sign == row.sign
        assert (other.unit, other.group, other.speech_owns) == (row.unit, row.group, row.speech_owns)
        assert abs(row.sign) == 1


def test_action_units_are_numbered_once_and_upwards() -> None:
    numbers = [row.au for row in tables.action_units()]
    assert numbers == sorted(set(numbers))


def test_au_to_fap_has_continuous_polylines_within_ranges() -> None:
    for key in sorted(polylines()):
        au, side, fap = key
        assert side in (("L", "R") if AUS[au].sides else ("",))
        points = polylines()[key]
        assert points[0][1] == 0
        for left, right in zip(points[1:-1:2], points[2::2], strict=True):
            assert left == right
        assert [a for a, _ in points] == sorted(a for a, _ in points)
        assert all(0 <= a <= 1 and math.isfinite(f) for a, f in points)
        assert all(a < b for (a, _), (b, _) in zip(points[::2], points[1::2], strict=True))
        assert all(FAPS[fap].least <= f <= FAPS[fap].most for _, f in points)
        assert any(f for _, f in points)


def test_action_units_have_every_one_of_facs() -> None:
    assert set(AUS) == FACS


def test_action_units_move_a_fap_on_each_side_or_say_why_not() -> None:
    for unit in tables.action_units():
        sides = {row.side for row in ROWS if row.au == unit.au}
        if unit.no_fap:
            assert not sides
        else:
            assert sides == ({"L", "R"} if unit.sides else {""})


def test_au_to_fap_of_one_side_does_not_move_the_other_side() -> None:
    for row in ROWS:
        if row.side and FAPS[row.fap].mirror != row.fap:
            assert f"_{row.side.lower()}" in FAPS[row.fap].name


def test_au_to_fap_is_symmetric() -> None:
    lines = polylines()
    for (au, side, fap), points in lines.items():
        mirror = FAPS[fap]
        if side:
            other = lines[au, "R" if side == "L" else "L", mirror.mirror]
        elif AUS[au].degrees:  # head and eyes: the mirror of "left" is "right"
            opposite = {51: 52, 52: 51, 55: 56, 56: 55, 61: 62, 62: 61}.get(au, au)
            other = lines[opposite, "", mirror.mirror]
        else:
            other = lines[au, "", mirror.mirror]
        assert other == [(a, f * mirror.sign) for a, f in points]


@pytest.mark.parametrize("au", [row.au for row in tables.action_units() if row.degrees])
def test_au_to_fap_of_a_rotation_has_the_degrees_of_its_action_unit(au: int) -> None:
    turned = {abs(row.fap_to) for row in ROWS if row.au == au and FAPS[row.fap].unit == "angle_unit"}
    assert list(turned) == [pytest.approx(math.radians(AUS[au].degrees) * 1e5, abs=1)]


@pytest.mark.parametrize("au", [43, 45, 46])
@pytest.mark.parametrize(("side", "upper", "lower"), [("L", 19, 21), ("R", 20, 22)])
def test_au_to_fap_closes_the_lids_exactly(au: int, side: str, upper: int, lower: int) -> None:
    assert at_one(au, side, upper) + at_one(au, side, lower) == 1024


@each_row(
    "au, side, fap, sign",
    [
        (1, "L", 31, 1),
        (2, "L", 35, 1),
        (4, "L", 31, -1),
        (4, "L", 37, 1),
        (5, "L", 19, -1),
        (7, "L", 21, 1),
        (6, "R", 42, 1),
        (9, "L", 63, 1),
        (10, "R", 9, -1),
        (10, "L", 4, -1),
        (12, "L", 12, 1),
        (12, "L", 6, 1),
        (15, "R", 13, -1),
        (16, "L", 5, -1),
        (17, "", 18, 1),
        (18, "", 6, -1),
        (20, "L", 53, 1),
        (22, "", 16, 1),
        (26, "", 3, 1),
        (26, "", 5, -1),
        (28, "", 17, -1),
        (30, "L", 15, -1),
        (35, "L", 39, -1),
        (38, "L", 61, 1),
        (51, "", 49, 1),
        (54, "", 48, 1),
        (56, "", 50, 1),
        (61, "", 23, 1),
        (64, "", 26, 1),
        (64, "", 19, 1),
    ],
)
def test_au_to_fap_has_the_signs_of_mpeg_4(au: int, side: str, fap: int, sign: int) -> None:
    assert at_one(au, side, fap) * sign > 0


# Upper and lower lip at the same place: the gap between them is -(upper + lower).
LIPS = [(4, 5), (8, 10), (9, 11), (51, 52), (55, 57), (56, 58)]


def test_au_to_fap_does_not_push_a_lip_through_the_other() -> None:
    for au, (upper, lower) in product(sorted({row.au for row in ROWS}), LIPS[:3]):
        for side in ("L", "R", ""):
            assert at_one(au, side, upper) + at_one(au, side, lower) <= 0


@pytest.mark.parametrize(("upper", "lower"), LIPS)
def test_au_to_fap_of_the_jaw_includes_the_parting_of_the_lips(upper: int, lower: int) -> None:
    gaps = [-(at_one(au, "", upper) + at_one(au, "", lower)) for au in (25, 26, 27)]
    assert gaps == sorted(gaps)
    assert gaps[0] > 0


HEAD = "# source: x\n# units: x\n# licence: x\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("au,side\n", "# source: ..."),
        (HEAD, "wanted a header row"),
        (HEAD + "au,side\n", "wanted columns au,side,fap,au_from"),
        (HEAD + "au,side,fap,au_from,au_to,fap_from,fap_to\n1,L,31\n", "line 5: wanted 7 cells, got 3"),
        (
            HEAD + "au,side,fap,au_from,au_to,fap_from,fap_to\n1,B,31,0,1,0,1\n",
            "line 5, side: wanted one of L, R",
        ),
        (HEAD + "au,side,fap,au_from,au_to,fap_from,fap_to\n1,L,x,0,1,0,1\n", "line 5, fap: wanted int"),
    ],
)
def test_read_csv_refuses_an_invalid_table_with_its_place(text: str, says: str) -> None:
    with pytest.raises(TableError, match=says):
        tables.read_csv(text, tables.AuToFap, "bad.csv")


# --- lexemes


# --- timing

FACE = ("faceLexeme", "faceFacs", "face", "faceShift", "gaze", "gazeShift", "head", "headDirectionShift")
BODY = ("gesture", "pointing", "posture", "postureShift", "locomotion", "wait")


def test_gaps_of_every_element_have_a_source() -> None:
    for element in (*FACE, *BODY):
        row = timing.gaps(element)
        assert row.points[0] == "start"
        assert row.points[-1] == "end"
        assert all(gap.source and gap.stiffness > 0 and gap.preferred >= gap.least >= 0 for gap in row.gaps)


def test_gaps_of_a_variant_have_the_points_of_its_element() -> None:
    for name in sorted(timing.all_gaps()):
        element, _, variant = name.partition(".")
        assert timing.gaps(element, variant.lower()).points == timing.gaps(element).points


def test_gaps_of_an_unknown_variant_are_those_of_its_element() -> None:
    assert timing.gaps("faceLexeme", "WIDEN_EYES") == timing.gaps("faceLexeme")
    assert timing.gaps("faceLexeme", "BLINK") != timing.gaps("faceLexeme")


def test_gaps_have_only_variants_that_exist() -> None:
    variants = {name.split(".")[1] for name in timing.all_gaps() if "." in name}
    assert variants <= {*lexemes.face_lexemes(), *lexemes.head_lexemes(), "EYES"}


def test_gaps_of_a_nod_and_a_blink_have_natural_lengths() -> None:
    nod = sum(gap.preferred for gap in timing.gaps("head", "NOD").gaps)
    assert 0.6 <= nod <= 0.9
    assert sum(gap.preferred for gap in timing.gaps("faceLexeme", "BLINK").gaps) == pytest.approx(0.3)


def test_regions_have_every_action_unit_and_low_level_fap_once() -> None:
    aus = [au for region in tables.regions("au") for au in region.members]
    faps = [fap for region in tables.regions("fap") for fap in region.members]
    assert sorted(aus) == [row.au for row in tables.action_units()]
    assert faps == list(range(3, 69))


def test_regions_of_faps_are_the_groups_of_the_standard() -> None:
    for region in tables.regions("fap"):
        assert len({FAPS[fap].group for fap in region.members}) == 1


def test_row_classes_are_frozen() -> None:
    row = tables.faps()[0]
    with pytest.raises(AttributeError):
        row.fap = 2  # type: ignore[misc]
