"""A writer of a study's results: a CSV for each table, and an HTML report with pictures."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realizer.core.atomic_files import write_text
from realizer_studio.corpus.report import html, write_tables
from realizer_studio.study.analysis import tables
from realizer_studio.study.answers import Answer, inattentive

FACTS = "variant", "reference", "triple", "emotion", "profiles", "strength", "fap", "name", "sign"
WORST = 12  # items of each kind that are shown with pictures


def write_report(
    folder: Path, key: Mapping[str, Any], answers: Sequence[Answer], pictures: Path, keep: bool
) -> list[str]:
    """Write all tables and report.html into a folder, and return the names of the files.

    Args:
        pictures: folder of the study; without it, the report has no pictures.
        keep: whether to include judges who failed attention items.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = tables(answers, keep)
    write_tables(folder, found)
    failed = set() if keep else set(inattentive(answers))
    counted = [one for one in answers if (one.group, one.judge) not in failed]
    pictures_of_worst = _worst(counted, pictures) if pictures.is_dir() else {}
    write_text(folder / "report.html", html(f"Study {key['study']}", found, pictures_of_worst))
    return [*(f"{table.name}.csv" for table in found), "report.html"]


def _worst(answers: Sequence[Answer], folder: Path) -> dict[str, list[bytes]]:
    """Return caption -> pictures of the items of each kind with the worst answers."""
    by_item: dict[tuple[str, str], list[Answer]] = {}
    for one in answers:
        if "check" not in one.truth and one.kind != "films":
            by_item.setdefault((one.kind, one.item), []).append(one)
    ranked = sorted(by_item.items(), key=lambda found: sum(map(_worth, found[1])) / len(found[1]))
    count: Counter[str] = Counter()
    pictures = {}
    for (kind, _), every in ranked:
        count[kind] += 1
        if count[kind] <= WORST:
            names = [*every[0].truth["shown"].values(), *every[0].truth["options"]]
            files = [folder / name for name in names]
            pictures[_caption(every)] = [file.read_bytes() for file in files if file.is_file()]
    return pictures


def _worth(one: Answer) -> float:
    return float(one.role) if one.kind == "displacements" else float(one.right)


def _caption(every: Sequence[Answer]) -> str:
    """Return a caption with the facts of an item, the order of its options, and the answers."""
    truth, given = every[0].truth, Counter(one.role for one in every)
    facts = [str(truth[name]) for name in FACTS if name in truth]
    order = [f"faces: {', '.join(truth['options'].values())}"] if truth["options"] else []
    replies = ", ".join(f"{role} {number}" for role, number in given.most_common())
    return "; ".join([f"{every[0].kind}: {' '.join(facts)}", *order, f"answers: {replies}"])
