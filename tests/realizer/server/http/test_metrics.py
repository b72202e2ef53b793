"""The metrics, parsed from their text format."""

from __future__ import annotations

import re
from pathlib import Path

from realizer.server.http.metrics import COUNTERS, GAUGES, Metrics, sum_samples

PAGE = Path(__file__).parents[4] / "docs" / "metrics.md"
SAMPLE = re.compile(r'([a-z_]+)(?:\{([a-z]+="[^"]*"(?:,[a-z]+="[^"]*")*)\})? (\S+)')


def samples(text: str) -> dict[tuple[str, str], float]:
    """(name, labels) -> value, of a text of which every line is a comment or a sample."""
    assert text.endswith("\n")
    found = {}
    for line in text.splitlines():
        if not line.startswith("# "):
            match = SAMPLE.fullmatch(line)
            assert match, line
            found[match[1], match[2] or ""] = float(match[3])
    return found


def test_metrics_describe_each_series_once() -> None:
    text = Metrics().text(dict.fromkeys(GAUGES, 0), {})
    names = re.findall(r"^# TYPE (\S+) (\S+)$", text, re.M)
    assert len(names) == len({name for name, _ in names}) == len(GAUGES) + len(COUNTERS) + 3
    assert re.findall(r"^# HELP (\S+) .+$", text, re.M) == [name for name, _ in names]


def test_metrics_are_all_described_in_the_documentation() -> None:
    text = sum_samples({0: Metrics(0).text(dict.fromkeys(GAUGES, 0), {})})
    kinds = dict(re.findall(r"^# TYPE (\S+) (\S+)$", text, re.M))
    rows = re.findall(r"^\| (realizer_\S+) \| (\w+) \| (.+) \|$", PAGE.read_text("utf-8"), re.M)
    helps = re.findall(r"^# HELP (\S+) (.+)$", text, re.M)
    assert rows == [(name, kinds[name], words) for name, words in helps]


def test_histogram_counts_rise_to_the_total() -> None:
    metrics = Metrics()
    for seconds in (0.0, 0.0005, 0.002, 0.3, 70.0):
        metrics.late.observe(seconds)
    got = samples(metrics.text(dict.fromkeys(GAUGES, 0), {}))
    buckets = [value for (name, _), value in got.items() if name == "realizer_lateness_seconds_bucket"]
    assert buckets == sorted(buckets)
    assert got["realizer_lateness_seconds_bucket", 'le="0.0005"'] == 2  # an end belongs to its bucket
    assert got["realizer_lateness_seconds_bucket", 'le="0.5"'] == 4
    assert got["realizer_lateness_seconds_bucket", 'le="+Inf"'] == 5
    assert got["realizer_lateness_seconds_count", ""] == 5
    assert abs(got["realizer_lateness_seconds_sum", ""] - 70.3025) < 1e-6


def test_metrics_of_a_worker_have_its_number() -> None:
    metrics = Metrics(worker=1)
    metrics.counts["messages"] += 3
    got = samples(metrics.text(dict.fromkeys(GAUGES, 2), {"messages": 4}))
    assert got["realizer_messages_total", 'worker="1"'] == 7
    assert got["realizer_sessions", 'worker="1"'] == 2
    assert got["realizer_planning_seconds_bucket", 'le="+Inf",worker="1"'] == 0


def test_metrics_print_counts_to_the_last_digit() -> None:
    metrics = Metrics()
    metrics.counts["messages"] = 123_456_789
    metrics.late.observe(1e9 + 0.25)
    got = samples(metrics.text(dict.fromkeys(GAUGES, 7_654_321), {}))
    assert got["realizer_messages_total", ""] == 123_456_789
    assert got["realizer_sessions", ""] == 7_654_321


def test_sum_samples_adds_the_counts_of_all_workers() -> None:
    texts = {}
    for number in (0, 2):
        metrics = Metrics(worker=number)
        metrics.counts["frames_dropped"] = 10_000_000 + number
        for seconds in (0.0001, 0.3 * (number + 1)):
            metrics.late.observe(seconds)
        texts[number] = metrics.text(dict.fromkeys(GAUGES, number + 1), {})
    whole = sum_samples(texts)
    got = samples(whole)
    assert got["realizer_frames_dropped_total", ""] == 20_000_002
    assert got["realizer_sessions", ""] == 4
    assert got["realizer_lateness_seconds_bucket", 'le="0.0005"'] == 2
    assert got["realizer_lateness_seconds_bucket", 'le="0.5"'] == 3
    assert got["realizer_lateness_seconds_bucket", 'le="+Inf"'] == 4
    assert abs(got["realizer_lateness_seconds_sum", ""] - 1.2002) < 1e-6
    assert {labels: v for (name, labels), v in got.items() if name == "realizer_worker_sessions"} == {
        'worker="0"': 1,
        'worker="2"': 3,
    }
    # The comments of a series come once, before its samples.
    types = re.findall(r"^# TYPE (\S+) \S+$", whole, re.M)
    assert len(types) == len(set(types))
    assert whole.index("# TYPE realizer_lateness_seconds ") < whole.index("realizer_lateness_seconds_bucket")
