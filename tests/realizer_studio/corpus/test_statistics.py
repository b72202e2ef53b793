"""Tests of `realizer_studio.corpus.statistics`: corpora made from Wojdel's tables give these tables back."""

from collections.abc import Iterable

import pytest

from realizer.tables.emotional_words import word_list
from realizer_studio.corpus import statistics
from realizer_studio.corpus.recording import Annotation, Recording, Segment
from realizer_studio.corpus.statistics import Study, relation

FPS = 25.0
FRAMES = 26223
# Tables 6.3 and 6.4: segments, frames, shortest, longest.
LENGTHS = {
    "astonishment": (9, 165, 10, 41),
    "surprise": (106, 2712, 2, 101),
    "sadness": (6, 153, 9, 43),
    "disbelief": (5, 185, 13, 103),
    "regret": (8, 362, 7, 188),
    "grief": (40, 1197, 6, 96),
    "anger": (66, 1914, 6, 99),
    "disgust": (22, 480, 6, 48),
    "happiness": (20, 832, 13, 160),
    "understanding": (2, 58, 27, 31),
    "satisfaction": (2, 23, 9, 14),
    "ironic smile": (1, 15, 15, 15),
}
# Tables 6.7 and 6.8, names by the alphabet: count, frames, shortest, longest; the five relations.
BLENDS = {
    ("grief", "surprise"): (15, 318, 2, 60, (1, 3, 4, 3, 4)),
    ("anger", "disgust"): (17, 335, 7, 48, (2, 2, 11, 2, 0)),
    ("astonishment", "sadness"): (1, 4, 4, 4, (1, 0, 0, 0, 0)),
    ("happiness", "surprise"): (1, 14, 14, 14, (1, 0, 0, 0, 0)),
    ("anger", "sadness"): (1, 10, 10, 10, (1, 0, 0, 0, 0)),
    ("grief", "regret"): (1, 41, 41, 41, (1, 0, 0, 0, 0)),
    ("anger", "grief"): (1, 1, 1, 1, (1, 0, 0, 0, 0)),
}
# Table 6.5, first row, and table 6.6: s between expressions, per cent of frames, mean length.
FRAGMENTS = (
    (6.6, 14.1, 27.1), (2.9, 39.2, 47.6), (2.5, 24.7, 22.4), (2.8, 30.9, 34.8), (2.3, 27.8, 25.2),
    (1.7, 31.3, 20.3), (2.8, 24.8, 25.2), (1.9, 31.6, 24.7), (2.5, 31.8, 30.9), (2.8, 27.6, 34.1),
)  # fmt: skip
# Table 6.9: segments by speaker (subject, other, subject to other, other to subject), and per cent.
SPEAKERS = {
    "astonishment": ((6, 0, 0, 3), (67, 0, 0, 33)),
    "surprise": ((83, 3, 12, 8), (78, 3, 11, 8)),
    "disbelief": ((2, 2, 1, 0), (40, 40, 20, 0)),
    "regret": ((1, 1, 5, 1), (12, 12, 64, 12)),
    "anger": ((51, 1, 5, 9), (77, 2, 7, 14)),
    "happiness": ((17, 0, 2, 1), (85, 0, 10, 5)),
}
# Table 6.10: questions of one word, short and long ones, exclamations.
QUESTIONS = {
    "astonishment": (4, 0, 0, 0),
    "surprise": (8, 22, 1, 4),
    "regret": (1, 0, 0, 0),
    "grief": (3, 6, 0, 2),
    "anger": (4, 4, 3, 10),
    "disgust": (2, 0, 1, 2),
}
SENTENCES = (9, 33, 11, 19)
TEXTS = (["really?"], ["are", "you", "sure?"], ["do", "you", "know", "who", "he", "is?"], ["go", "away!"])
# Table 6.11: how often each word was said, and with which expressions.
SHOWN = ("anger", "surprise", "grief", "disgust")
WORDS = {
    "Co?": (19, (6, 8, 5, 1)),
    "coś": (6, (3, 2, 1, 0)),
    "jakiś": (1, (1, 0, 0, 0)),
    "nic": (3, (2, 1, 0, 0)),
}
# Table 6.14: expressions at emotional words, of 78.
EMOTIONAL = {"surprise": 21, "grief": 8, "anger": 21, "disgust": 9, "happiness": 10}


def spread(count: int, total: int, needed: Iterable[int]) -> list[int]:
    """Return lengths with this sum, of which some are given."""
    found = list(needed)
    rest = count - len(found)
    for k in range(rest):
        found.append((total - sum(found)) // (rest - k))
    assert sum(found) == total
    return found


def label(first: int, length: int, name: str) -> Annotation:
    return Annotation(first / FPS, (first + length) / FPS, name, "she")


def blended(a: str, b: str) -> list[list[tuple[int, int, str]]]:
    """Return pairs of (offset, length, name) that share frames as in the tables."""
    count, total, least, most, ways = BLENDS[a, b]
    shared = sorted(spread(count, total, [least, most][: min(count, 2)]))
    found = []
    order = (0, 1, 4, 3, 2)  # the shortest lie behind one another, as no segment is so short
    for way in [one for one in order for _ in range(ways[one])]:
        frames = shared.pop(0)
        more = max(4, *(LENGTHS[name][2] - frames for name in (a, b)))
        found.append(
            {
                0: [(0, frames + more, a), (more, frames + more, b)],
                1: [(more, frames + more, a), (0, frames + more, b)],
                2: [(0, frames + 2, a), (1, frames, b)],
                3: [(1, frames, a), (0, frames + 2, b)],
                4: [(0, frames, a), (0, frames, b)],
            }[way]
        )
    return found


@pytest.fixture(scope="module")
def hers() -> Study:
    """A corpus with the segments of tables 6.3, 6.4, 6.7 and 6.8."""
    groups = [group for pair in BLENDS for group in blended(*pair)]
    for name, (count, total, least, most) in LENGTHS.items():
        used = [length for group in groups for _, length, other in group if other == name]
        needed = [length for length in dict.fromkeys((least, most)) if length not in used]
        rest = spread(count - len(used), total - sum(used), needed)
        assert all(least <= length <= most for length in rest), name
        groups += [[(0, length, name)] for length in rest]
    at, labels = 50, []
    for group in groups:
        labels += [label(at + offset, length, name) for offset, length, name in group]
        at = max(at + offset + length for offset, length, _ in group) + 30
    assert at < FRAMES
    return Study([Recording("all", {"frames": FRAMES}, tuple(labels))])


def test_counts_are_those_of_table_6_3(hers: Study) -> None:
    table = statistics.counts(hers)
    for name, (count, frames, *_) in LENGTHS.items():
        assert (table.column("segments")[name], table.column("frames")[name]) == (count, frames)
        assert table.column("percent")[name] == pytest.approx(100 * frames / FRAMES)
    assert table.column("segments")["all"] == 287
    assert [table.column("frames")[f"frames with {k}"] for k in (0, 1, 2)] == [18850, 6650, 723]


def test_lengths_are_those_of_table_6_4(hers: Study) -> None:
    table = statistics.lengths(hers)
    for name, (count, frames, least, most) in LENGTHS.items():
        assert (table.column("shortest")[name], table.column("longest")[name]) == (least, most)
        assert table.column("mean")[name] == pytest.approx(frames / count)
        assert (table.column("deviation")[name] is None) == (count < 7)


def test_blends_are_those_of_tables_6_7_and_6_8(hers: Study) -> None:
    rows = {row[1:3]: row[3:] for row in statistics.blends(hers).rows}
    assert rows == {pair: (*figures[:4], *figures[4]) for pair, figures in BLENDS.items()}


def test_relation_names_the_five_ways_of_table_6_8() -> None:
    a = Segment(10, 20, "a")
    spans = {
        "a = b": (10, 20),
        "b in a": (12, 20),
        "a in b": (9, 20),
        "a then b": (15, 30),
        "b then a": (5, 12),
    }
    assert {way: relation(a, Segment(*span, "b")) for way, span in spans.items()} == {
        way: way for way in spans
    }


def test_distances_and_shares_are_those_of_tables_6_5_and_6_6() -> None:
    recordings = []
    for number, (distance, _, mean) in enumerate(FRAGMENTS, 1):
        count = 20
        lengths = spread(count, round(count * mean), [])
        frames = round(count * FPS * distance + sum(lengths))
        starts = [sum(lengths[:k]) + 20 * k for k in range(count)]
        labels = [label(at, length, "anger") for at, length in zip(starts, lengths, strict=True)]
        recordings.append(Recording(f"f{number}", {"frames": frames}, tuple(labels)))
    recordings.append(Recording("f11", {"frames": 100}, (label(1, 10, "grief"),)))
    study = Study(recordings)
    every, anger, grief = statistics.distances(study).rows
    shares = statistics.shares(study).rows
    for (distance, percent, mean), gap, share in zip(FRAGMENTS, every[1:], shares, strict=False):
        assert gap == pytest.approx(distance, abs=0.05)
        # Here no segments share frames; hers do, and such a frame counts once.
        assert percent - 0.7 < share[2] < percent + 6
        assert share[3] == pytest.approx(mean, abs=0.05)
    assert every[1:11] == anger[1:11]
    assert (anger[11], grief[1], grief[11]) == (None, None, float("inf"))


def said(texts: Iterable[str], first: int, by: str = "subject") -> list[Annotation]:
    """Return words of ten frames, one after the other."""
    return [
        Annotation((first + 10 * k) / FPS, (first + 10 * k + 10) / FPS, text, by)
        for k, text in enumerate(texts)
    ]


def test_speakers_are_those_of_table_6_9() -> None:
    labels, words, at = [], [], 0
    turns = (("subject",), ("other",), ("subject", "other"), ("other", "subject"))
    for name, (counts, _) in SPEAKERS.items():
        for turn in [turn for turn, count in zip(turns, counts, strict=True) for _ in range(count)]:
            for k, who in enumerate(turn):
                words += said(["hm"], at + 10 * k, who)
            labels.append(label(at + 2, 15, name))
            at += 60
    rows = {
        row[0]: row[1:]
        for row in statistics.speakers(Study([Recording("r", {}, tuple(labels), tuple(words))])).rows
    }
    for name, (counts, printed) in SPEAKERS.items():
        assert rows[name][:4] == pytest.approx([100 * count / sum(counts) for count in counts])
        assert rows[name][:4] == pytest.approx(printed, abs=2)


@pytest.fixture(scope="module")
def asked() -> Study:
    """A corpus with the sentences of table 6.10."""
    labels, words, at = [], [], 0
    for kind, (count, texts) in enumerate(zip(SENTENCES, TEXTS, strict=True)):
        for number in range(count):
            words += said([*texts], at)
            for name, counts in QUESTIONS.items():
                if number < counts[kind]:
                    labels.append(label(at, 8, name))
            at += 120
            words += said(["it", "is", "so."], at)
            at += 120
    return Study([Recording("r", {}, tuple(labels), tuple(words))])


def test_questions_are_those_of_table_6_10(asked: Study) -> None:
    rows = {row[0]: row[1:] for row in statistics.questions(asked).rows}
    assert rows == QUESTIONS | {"all": SENTENCES}


def test_words_have_the_expressions_of_table_6_11() -> None:
    labels, words, at = [], [], 0
    for text, (count, shown) in WORDS.items():
        for k in range(count):
            words += said([text], at)
            labels += [label(at, 10, name) for name, times in zip(SHOWN, shown, strict=True) if k < times]
            at += 60
    recording = Recording("r", {}, tuple(labels), tuple(words))
    table = statistics.words(Study([recording], watched=frozenset({"coś", "jakiś", "nic"})))
    assert table.columns == ("word", "count", *SHOWN)
    assert {row[0]: (row[1], row[2:]) for row in table.rows} == {
        k.strip("?").lower(): v for k, v in WORDS.items()
    }
    assert [row[0] for row in statistics.words(Study([recording])).rows] == ["co"]


def test_emotional_words_are_those_of_table_6_12() -> None:
    cells = {
        ("subject", "thing"): (1052, 736), ("subject", "sad"): (58, 48),
        ("other", "thing"): (1154, 286), ("other", "sad"): (61, 17),
    }  # fmt: skip
    labels, words, at = [], [], 60
    for (by, text), (count, linked) in cells.items():
        for k in range(count):
            words += said([text], at, by)
            # Half a second before or after still belongs to the word.
            labels += [label(at + (22 if k % 2 else -17), 5, "anger")] if k < linked else []
            at += 60
    recording = Recording("r", {}, tuple(labels), tuple(words))
    table = statistics.emotional(Study([recording], words=word_list("en")))
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["subject"][:5] == (1052, 736, pytest.approx(70.0, abs=0.05), 58, 48)
    assert rows["subject"][5] == pytest.approx(82.8, abs=0.05)
    assert rows["other"] == (1154, 286, pytest.approx(24.8, abs=0.05), 61, 17, pytest.approx(27.9, abs=0.05))
    assert rows["all"][0] == 2206


def test_occurrences_are_those_of_table_6_14() -> None:
    labels, words, at = [], [], 0
    for name, (count, *_) in LENGTHS.items():
        for k in range(count):
            labels.append(label(at, 10, name))
            words += said(["sad" if k < EMOTIONAL.get(name, 0) else "thing"], at)
            at += 60
    table = statistics.occurrences(
        Study([Recording("r", {}, tuple(labels), tuple(words))], words=word_list("en"))
    )
    assert table.column("percent of all")["surprise"] == pytest.approx(36.9, abs=0.05)
    assert table.column("percent at emotional words")["happiness"] == pytest.approx(100 * 10 / 69)


def test_categories_have_odds_ratios_with_intervals() -> None:
    labels, words, at = [], [], 0
    for k in range(200):
        text = "sad" if k % 4 == 0 else "thing"
        words += said([text], at)
        if (k % 4 == 0 and k % 3) or k % 10 == 1:
            labels.append(label(at, 5, "grief"))
        at += 60
    table = statistics.categories(
        Study([Recording("r", {}, tuple(labels), tuple(words))], words=word_list("en"))
    )
    ((_, kind, name, count, linked, ratio, low, high),) = table.rows
    assert (kind, name, count, linked) == ("sorrow", "grief", 50, 33)
    assert ratio == pytest.approx((33.5 * 130.5) / (17.5 * 20.5), rel=0.01)
    assert 1 < low < ratio < high


def test_neighbours_are_shares_of_segments() -> None:
    labels = []
    for k in range(9):
        at = 200 * k
        labels += [label(at, 20, "astonishment")]
        labels += [label(at - 10, 10, "surprise")] if 0 < k < 7 else []
        labels += [label(at + 20, 10, "surprise")] if k < 8 else []
    rows = {
        row[1:3]: row[3:] for row in statistics.neighbours(Study([Recording("r", {}, tuple(labels))])).rows
    }
    assert rows["astonishment", "surprise"][:3] == (9, pytest.approx(100 * 6 / 9), pytest.approx(100 * 8 / 9))


def test_sentences_end_with_signs_and_turns() -> None:
    words = said(["You", "know", "?", "Yes"], 0) + said(["No."], 50, "bob") + said(["«Go!»", "Well"], 70)
    found = list(statistics.sentences(Recording("r", {}, (), tuple(words))))
    assert [([word.text for word in words], sign) for words, sign in found] == [
        (["You", "know?"], "?"),
        (["Yes"], "."),
        (["«Go!»"], "!"),
        (["Well"], "."),
    ]
