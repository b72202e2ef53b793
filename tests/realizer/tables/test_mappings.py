"""Tests of `realizer.tables.mappings`."""

from pathlib import Path

import pytest

from realizer import tables
from realizer.core.errors import TableError
from realizer.tables import AuToFap, au_to_fap
from realizer.tables.mappings import FORMS, PUBLISHED, published_file, read_mapping, write_mapping
from tests.rows import each_row

# Paul 2010, figure 5.2.
FIGURE = """
23\tL
53\t0.0\t1.0\t0\t-300

23\tR
54\t0.0\t1.0\t0\t-300

24
16\t0.0\t1.0\t0\t1000
17\t0.0\t1.0\t0\t500
25
3\t0.0\t1.0\t0\t900
4\t0.5\t1.0\t0\t-100
5\t0.0\t1.0\t0\t-1000
10\t0.2\t1.0\t0\t-1000
11\t0.2\t1.0\t0\t-1000
"""
HEAD = "# source: x\n# units: x\n# licence: x\nau,side,fap,au_from,au_to,fap_from,fap_to\n"


def written(folder: Path, text: str, name: str = "own.txt") -> Path:
    path = folder / name
    path.write_text(text, "utf-8")
    return path


def test_read_mapping_reads_the_figure_of_the_thesis(tmp_path: Path) -> None:
    units = read_mapping(written(tmp_path, FIGURE))
    assert units[23, ""] == tuple(AuToFap(23, "", fap, 0.0, 1.0, 0.0, -300.0) for fap in (53, 54))
    assert [row.fap_to for row in units[24, ""]] == [1000, 500]
    assert [(row.fap, row.au_from, row.fap_to) for row in units[25, ""]] == [
        (3, 0.0, 900),
        (4, 0.5, -100),
        (5, 0.0, -1000),
        (10, 0.2, -1000),
        (11, 0.2, -1000),
    ]


@pytest.mark.parametrize("form", FORMS)
def test_write_mapping_round_trips(tmp_path: Path, form: str) -> None:
    rows = tables.au_to_fap()
    write_mapping(tmp_path / f"all{form}", rows, "the table")
    units = read_mapping(tmp_path / f"all{form}")
    assert sorted((row for unit in units.values() for row in unit), key=repr) == sorted(rows, key=repr)


@pytest.mark.parametrize("form", FORMS)
def test_write_mapping_writes_an_action_unit_without_effect(tmp_path: Path, form: str) -> None:
    write_mapping(tmp_path / f"few{form}", [row for row in tables.au_to_fap() if row.au != 25], "without 25")
    assert not any(row.fap_to for row in read_mapping(tmp_path / f"few{form}")[25, ""])


def test_read_mapping_ignores_blanks_comments_and_a_byte_order_mark(tmp_path: Path) -> None:
    units = read_mapping(written(tmp_path, "\ufeff# mine\r\n\r\n26 # the jaw\r\n 3 0 1  0 500 # down\r\n"))
    assert units == {(26, ""): (AuToFap(26, "", 3, 0.0, 1.0, 0.0, 500.0),)}


def test_read_mapping_of_an_action_unit_without_lines_has_no_rows(tmp_path: Path) -> None:
    assert read_mapping(written(tmp_path, "12\tL\n9\n")) == {(9, "L"): (), (9, "R"): (), (12, "L"): ()}


def test_read_mapping_without_a_side_assigns_faps_to_their_sides(tmp_path: Path) -> None:
    units = read_mapping(written(tmp_path, "10\n8 0 1 0 -90\n56 0 1 0 -80\n4 0 1 0 -70\n"))
    assert {side: [row.fap for row in unit] for (_, side), unit in units.items()} == {
        "L": [4, 8],
        "R": [4, 56],
    }


@each_row("row", [row for row in tables.faps()[2:] if row.mirror != row.fap])
def test_read_mapping_gives_a_mirrored_fap_one_side(tmp_path: Path, row: tables.Fap) -> None:
    units = read_mapping(written(tmp_path, f"12\n{row.fap} 0 1 0 9\n{row.mirror} 0 1 0 9\n"))
    assert {len(unit) for unit in units.values()} == {1}


def test_read_mapping_counts_equal_lines_of_both_sides_once(tmp_path: Path) -> None:
    assert len(read_mapping(written(tmp_path, "17 L\n18 0 1 0 50\n17 R\n18 0 1 0 50\n"))[17, ""]) == 1


def test_read_mapping_joins_segments_of_one_fap(tmp_path: Path) -> None:
    units = read_mapping(written(tmp_path, "26\n3 0.5 1 300 400\n3 0 0.5 0 300\n"))
    assert [row.fap_to for row in units[26, ""]] == [300, 400]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "wanted action units and their FAPs, got none"),
        ("3 0 1 0 9\n", "line 1: wanted an action unit before its FAPs"),
        ("12 B\n", "line 1: wanted L or R beside AU12, got 'B'"),
        ("\ntwelve\n", "line 2: wanted an action unit's number, got 'twelve'"),
        ("40\n", r"line 1: wanted a FACS action unit, got 40; near: 38 \(Nostril dilator\), 39"),
        ("26\n3 0 1\n", "line 2: wanted an action unit .* got 3 fields"),
        ("26\nx 0 1 0 5\n", "line 2: wanted a FAP's number, got 'x'"),
        ("26\n3 0 1 0 far\n", "line 2: FAP-end: wanted a number, got 'far'"),
        ("26\n69 0 1 0 5\n", r"line 2: wanted a FAP of 3\.\.68, got 69"),
        ("26\n2 0 1 0 5\n", r"line 2: wanted a FAP of 3\.\.68, got 2"),
        ("26\n3 0.5 0.5 0 5\n", r"line 2: wanted an AU range that rises within 0\.\.1, got 0.5 to 0.5"),
        ("26\n3 0 2 0 5\n", "line 2: wanted an AU range"),
        ("26\n3 0 nan 0 5\n", "line 2: wanted an AU range"),
        ("26\n3 0 1 0 -5\n", r"line 2: FAP 3 \(open_jaw\): wanted 0\.\.4320, got -5"),
        ("26\n5 0 1 0 nan\n", "line 2: FAP 5 .*got nan"),
        ("26\n3 0 1 100 500\n", "line 2: AU26, FAP 3: wanted FAP-start 0, or the face would jump"),
        ("26\n3 0 .5 0 5\n3 .5 1 6 7\n", "line 3: AU26, FAP 3: wanted FAP-start 5"),
        ("26\n3 0 1 0 5\n\n3 .5 1 5 7\n", "line 4: AU26, FAP 3: wanted it to begin at 1"),
    ],
)
def test_read_mapping_refuses_an_invalid_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(TableError, match=f"own.txt.*{says}"):
        read_mapping(written(tmp_path, text))


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("40,,3,0,1,0,5\n", "line 5: wanted a FACS action unit, got 40"),
        ("\n# a word\n26,,3,0,1,0,-5\n", r"line 7: FAP 3 \(open_jaw\)"),
        ("26,,3,0,1\n", "line 5: wanted 7 cells"),
    ],
)
def test_read_mapping_refuses_an_invalid_row(tmp_path: Path, rows: str, says: str) -> None:
    with pytest.raises(TableError, match=f"own.csv.*{says}"):
        read_mapping(written(tmp_path, HEAD + rows, "own.csv"))


def test_read_mapping_names_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"none\.txt: wanted a mapping of action units to FAPs"):
        read_mapping(tmp_path / "none.txt")


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_file_is_a_mapping_with_the_signs_of_our_own(name: str) -> None:
    path = published_file(name)
    assert path is not None
    ours = {row.key: row.fap_to for row in au_to_fap()}
    for rows in read_mapping(path).values():
        for row in rows:
            assert ours.get(row.key, row.fap_to) * row.fap_to > 0, row
    assert published_file("mine.txt") is None


def test_published_files_have_the_corrections() -> None:
    zhang, raouzaiou = (read_mapping(published_file(name)) for name in ("zhang", "raouzaiou"))
    assert {row.fap: row.fap_to for row in zhang[16, "L"]}[5] < 0
    assert 59 not in {row.fap for row in zhang[10, "L"]}
    assert {row.fap for row in raouzaiou[12, "L"]} == {6, 12, 53, 59}
    assert {row.fap for row in zhang[1, "R"]} == {32}
