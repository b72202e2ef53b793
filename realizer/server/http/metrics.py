"""Metrics in the Prometheus text format (0.0.4), and their sum over workers."""

import logging
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from prometheus_client import Metric, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.utils import floatToGoString

log = logging.getLogger(__name__)

MEDIA_TYPE = "text/plain; version=0.0.4; charset=utf-8"
# Upper bounds of buckets in seconds. Lateness is mostly below a millisecond, but may be several frames.
LATENESS = (0.0005, 0.001, 0.002, 0.003, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0)
PLANNING = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
SLOW_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)


class Histogram:
    """A histogram of seconds.

    Each wake-up of a session observes its lateness: that of the library takes thirty times as long.

    Attributes:
        observe: takes seconds.
    """

    def __init__(self, name: str, description: str, ends: Sequence[float]) -> None:
        self._name, self._description = f"realizer_{name}_seconds", description
        self._ends = ends
        self._pending: list[float] = []
        self.observe = self._pending.append
        self._counts = np.zeros(len(ends) + 1, np.int64)
        self._sum = 0.0

    def count(self) -> None:
        """Sort what was observed into the buckets."""
        places = np.searchsorted(self._ends, self._pending)
        self._counts += np.bincount(places, minlength=len(self._counts))
        self._sum += sum(self._pending)
        self._pending.clear()

    def family(self, labels: Mapping[str, str]) -> Metric:
        """Return the samples, with these labels."""
        self.count()
        ends = [*map(floatToGoString, self._ends), "+Inf"]
        made = HistogramMetricFamily(self._name, self._description, labels=list(labels))
        buckets = list(zip(ends, self._counts.cumsum().tolist(), strict=True))
        made.add_metric(list(labels.values()), buckets, self._sum)
        return made


class Metrics:
    """The metrics of one process; of no registry of the library, because a process may have several services.

    Attributes:
        counts: name in `COUNTERS` -> its count.
        late: seconds by which sessions woke too late to send frames.
        slow_steps: seconds of the steps of the event loop that delayed all clients.
    """

    def __init__(self, worker: int | None = None) -> None:
        self._labels = {} if worker is None else {"worker": str(worker)}
        self.counts: Counter[str] = Counter(dict.fromkeys(COUNTERS, 0))
        self.late = Histogram("lateness", "By how much a session was woken too late.", LATENESS)
        self.planning = Histogram("planning", "How long it took to read and plan a document.", PLANNING)
        self.slow_steps = Histogram("slow_step", "Steps of the event loop of 0.05 s or more.", SLOW_STEPS)
        self._histograms = (self.late, self.planning, self.slow_steps)

    def count(self) -> None:
        """Sort what histograms have observed; call it every few seconds."""
        for histogram in self._histograms:
            histogram.count()

    def report_slow_step(self, seconds: float, action: str, session: str, connections: Sequence[int]) -> None:
        """Count and log a step of the event loop that took long.

        Args:
            action: what it did, and for which session and connections.
        """
        self.slow_steps.observe(seconds)
        fields = {
            "session": session,
            "connections": connections,
            "seconds": round(seconds, 3),
            "action": action,
        }
        log.info(
            "slow step: %.0f ms for %s (session %s, connections %s)",
            *(1000 * seconds, action, session, ", ".join(map(str, connections)) or "none"),
            extra=fields,
        )

    def text(self, now: Mapping[str, float], more: Mapping[str, int]) -> str:
        """Return all metrics in the text format.

        Args:
            now: name in `GAUGES` -> its present value.
            more: name in `COUNTERS` -> a count to add, of sessions that still run.
        """
        labels, values = list(self._labels), list(self._labels.values())
        families: list[Metric] = []
        for name, description in GAUGES.items():
            gauge = GaugeMetricFamily(f"realizer_{name}", description, labels=labels)
            gauge.add_metric(values, now[name])
            families.append(gauge)
        for name, description in COUNTERS.items():
            counter = CounterMetricFamily(f"realizer_{name}", description, labels=labels)
            counter.add_metric(values, self.counts[name] + more.get(name, 0))
            families.append(counter)
        families += [histogram.family(self._labels) for histogram in self._histograms]
        return _text(families)


def sum_samples(texts: Mapping[int, str]) -> str:
    """Return the metrics of several workers as one text, in which each sample is the sum of theirs.

    Args:
        texts: number of a worker -> its text. The samples of `realizer_worker_sessions` list the workers.
    """
    families: dict[str, Metric] = {}
    sums: dict[tuple[str, str, tuple[tuple[str, str], ...]], float] = {}  # by family, sample and labels
    workers = GaugeMetricFamily(
        "realizer_worker_sessions", "Sessions of each worker that has answered.", labels=["worker"]
    )
    for number, text in texts.items():
        for family in text_string_to_metric_families(text):
            families.setdefault(family.name, Metric(family.name, family.documentation, family.type))
            for sample in family.samples:
                labels = tuple(item for item in sample.labels.items() if item[0] != "worker")
                key = family.name, sample.name, labels
                sums[key] = sums.get(key, 0.0) + sample.value
                if sample.name == "realizer_sessions":
                    workers.add_metric([str(number)], sample.value)
    for (of, name, labels), value in sums.items():
        families[of].add_sample(name, dict(labels), value)
    return _text([*families.values(), workers])


@dataclass(frozen=True)
class _Collected:
    families: Iterable[Metric]

    def collect(self) -> Iterable[Metric]:
        return self.families


def _text(families: Iterable[Metric]) -> str:
    return generate_latest(_Collected(families)).decode()


GAUGES = {
    "sessions": "Sessions that are open.",
    "connections": "Connections that are open.",
    "blocks_waiting": "Blocks that wait for a voice or to be planned.",
    "blocks_playing": "Blocks that are planned and have not ended.",
    "unsent_bytes": "Bytes that wait for clients to read them.",
    "memory_bytes": "Bytes of the process that are in memory.",
    "overloaded": "Processes that are overloaded: they refuse new sessions, and leave out late frames.",
}
COUNTERS = {
    "messages": "Messages that came in.",
    "refused": "Connections that were refused.",
    "control_frames": "Pings, pongs and close frames of WebSockets that came in.",
    "over_limit": "Blocks that were refused because planning them takes more than max_planning steps.",
    "rate_exceeded": "How often a connection began to exceed max_rate, and was read more slowly.",
    "http_errors": "HTTP requests that were answered with a status of 400 to 499.",
    "http_failures": "HTTP requests that were answered with a status of 500 or more.",
    "frames_dropped": "Frames, pictures and sound packets that slow clients, or an overload, left out.",
    "taken_back": "How often frames that were sent ahead were taken back, because a plan had changed.",
    "quarantined": "Documents that sessions were restored without, after two replays that did not end.",
    "failures": "Sessions that an internal error ended.",
    "records_stopped": "Recordings that could not be written to their end.",
}
