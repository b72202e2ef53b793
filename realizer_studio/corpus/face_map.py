"""Features of the faces of a corpus, matching pursuit, and a self-organising map (Wojdel 2005, 7.2, 7.3)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.optimize import nnls

from realizer.animation.arkit import MILLIMETRES
from realizer.animation.axis import au_row
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Bool, Float32, Float64, UInt8
from realizer.core.atomic_files import replacing, write_text
from realizer.core.toml_text import parse_toml
from realizer.tables import HEAD_COLUMNS, faps
from realizer.tables.templates import templates
from realizer_studio.corpus.recording import CorpusError, Recording


def explain(faces: Float64, shapes: Float64, most: int, least_gain: float) -> tuple[list[int], Float64]:
    """Return rows of shapes (m, d) that approximate faces (n, d), and their weights (n, chosen rows).

    Rows are chosen one after the other, each the one that reduces the residual most.

    Args:
        most: the largest number of rows.
        least_gain: the least share of the squared displacement that one more row explains.
    """
    total = float(np.sum(faces**2))
    lengths = np.maximum(np.linalg.norm(shapes, axis=1), 1e-9)
    chosen: list[int] = []
    weights = np.zeros((len(faces), 0))
    while len(chosen) < most:
        residual = faces - weights @ shapes[chosen]
        gains = np.sum(np.maximum(residual @ (shapes / lengths[:, None]).T, 0) ** 2, axis=0)
        gains[chosen] = 0
        if gains.max() <= least_gain * total:
            break
        chosen.append(int(gains.argmax()))
        weights = np.stack([nnls(shapes[chosen].T, face)[0] for face in faces])
    return chosen, weights


VARIANCE = 0.9  # of the data that the components keep
FAR = 0.3  # of the frames, those farthest from the mean, train the map; Wojdel's show expressions in 28 %
SIDE = 10  # neurons of a side of the map
ROUNDS = 60  # of its training
WIDEST, NARROWEST = SIDE / 3, 0.6  # radius of a neuron's neighbourhood in the first and last round
LIKE = 0.6  # least cosine of a neuron and the template that names it
MAJORITY = 0.5  # least share of a neuron's expression among its accepted frames
RECENT = 25  # frames over which this share is counted
USUAL = 0.9  # share of a neuron's frames that are accepted if no frames are labelled,
NEARER = 0.5  # of those nearer than this share of its distance from the mean frame
MAP, CELLS = "map.npz", "map.toml"
ARRAYS = ("mean", "components", "neurons", "accepted")
AGAIN = "make it by `realizer corpus learn`"


@dataclass(frozen=True, eq=False)
class FaceMap:
    """A map of faces."""

    mean: Float64  # (d,) mean frame
    components: Float64  # (k, d) principal components
    neurons: Float64  # (SIDE * SIDE, k), in rows
    accepted: Float64  # (SIDE * SIDE,) distance up to which a frame belongs to a neuron
    names: tuple[str, ...]  # expression of each neuron; "" for none

    def project(self, frames: Float64) -> Float64:
        """Return the principal components (n, k) of frames (n, d)."""
        projected: Float64 = (frames - self.mean) @ self.components.T
        return projected


def faps_of(rows: Float32) -> Float64:
    """Return the FAPs (n, 68) of rows (n, n_targets) of the animation axis."""
    return to_fap(AUFrames(np.arange(len(rows), dtype=np.float64), rows)).values.astype(np.float64)


def features(recording: Recording) -> Float64:
    """Return frames (n, d) in mm: FAPs of the face, or points without the head's pose.

    Raises:
        CorpusError: the recording has neither.
    """
    if recording.faps is not None:
        scale = np.array([MILLIMETRES[row.unit] for row in faps()])
        scale[HEAD_COLUMNS] = 0.0
        return np.asarray(recording.faps * scale)
    if recording.points is None:
        raise CorpusError(f"{recording.name}: wanted FAPs or points, got none; add them")
    points = recording.points[1]
    flat = points.reshape(len(points), -1).copy()
    frames = np.arange(len(flat))
    for column in flat.T:  # lost points are interpolated
        known = np.isfinite(column)
        column[:] = np.interp(frames, frames[known], column[known]) if known.any() else 0.0
    # Points are centred, scaled to unit size and rotated to their median (7.2.1; Kabsch 1976).
    centred = flat.reshape(points.shape) - flat.reshape(points.shape).mean(axis=1, keepdims=True)
    centred /= max(float(np.sqrt(np.square(centred).sum(axis=(1, 2)).mean())), 1e-12)
    u, _, vt = np.linalg.svd(np.einsum("nki,kj->nij", centred, np.median(centred, axis=0)))
    u[np.linalg.det(u @ vt) < 0, :, 2] *= -1
    return np.asarray((centred @ u @ vt).reshape(len(points), -1))


def learn(recordings: Sequence[Recording], seed: int = 0) -> FaceMap:
    """Return the map of the faces of recordings, with neurons named by labels, or else by templates.

    Raises:
        CorpusError: recordings without frames, with different points, or with too few different frames.
    """
    frames = [features(recording) for recording in recordings]
    if len({part.shape[1] for part in frames}) != 1:
        raise CorpusError("wanted FAPs, or the same points, in all recordings; got others or no recordings")
    data = np.concatenate(frames)
    mean = data.mean(axis=0)
    _, sizes, components = np.linalg.svd(data - mean, full_matrices=False)
    shares = np.cumsum(np.square(sizes)) / max(float(np.square(sizes).sum()), 1e-12)
    components = components[: int(np.searchsorted(shares, VARIANCE)) + 1]
    projected = (data - mean) @ components.T
    distance = np.linalg.norm(projected, axis=1)
    far = np.asarray(distance >= np.quantile(distance, 1 - FAR))
    if far.sum() < SIDE * SIDE or distance.max() < 1e-9:
        raise CorpusError(
            f"wanted {SIDE * SIDE / FAR:.0f} frames that differ, got {len(data)}; add recordings"
        )
    neurons = train(projected[far], seed)
    near = distances(projected, neurons)
    nearest = near.argmin(axis=1)
    neuron_frames = [np.asarray(far & (nearest == k)) for k in range(SIDE * SIDE)]
    labels = _labels(recordings, [len(part) for part in frames])
    names = _by_labels(neuron_frames, labels) if labels else _by_templates(neuron_frames, data)
    accepted = [
        _acceptance(near[:, k], frames_of, NEARER * float(np.linalg.norm(neurons[k])), labels.get(name))
        if name and frames_of.any()
        else 0.0
        for k, (frames_of, name) in enumerate(zip(neuron_frames, names, strict=True))
    ]
    return FaceMap(mean, components, neurons, np.array(accepted), names)


def train(frames: Float64, seed: int = 0) -> Float64:
    """Return the neurons (SIDE * SIDE, k) of a self-organising map of frames (n, k), by batch training."""
    grid = np.indices((SIDE, SIDE)).reshape(2, -1).T
    apart = np.square(grid[:, None] - grid).sum(axis=-1)
    neurons = frames[np.random.default_rng(seed).choice(len(frames), SIDE * SIDE, replace=False)]
    for radius in np.geomspace(WIDEST, NARROWEST, ROUNDS):
        nearest = distances(frames, neurons).argmin(axis=1)
        share = np.exp(-apart / (2 * radius**2))[:, nearest]
        neurons = share @ frames / np.maximum(share.sum(axis=1, keepdims=True), 1e-12)
    return neurons


def distances(frames: Float64, neurons: Float64) -> Float64:
    """Return the distances (n, neurons) between frames (n, k) and neurons."""
    squares: Float64 = np.square(frames).sum(axis=1)[:, None] - 2 * frames @ neurons.T
    return np.asarray(np.sqrt(np.maximum(squares + np.square(neurons).sum(axis=1), 0.0)))


def borders(neurons: Float64) -> Float64:
    """Return the U-matrix (2 * SIDE - 1, 2 * SIDE - 1): distances of neighbours, and their means."""
    cells = neurons.reshape(SIDE, SIDE, -1)
    found = np.zeros((2 * SIDE - 1, 2 * SIDE - 1))
    found[::2, 1::2] = np.linalg.norm(cells[:, 1:] - cells[:, :-1], axis=-1)
    found[1::2, ::2] = np.linalg.norm(cells[1:] - cells[:-1], axis=-1)
    padded, ones = (np.pad(part, 1) for part in (found, np.ones_like(found)))
    sums, counts = (m[:-2, 1:-1] + m[2:, 1:-1] + m[1:-1, :-2] + m[1:-1, 2:] for m in (padded, ones))
    return np.where(np.indices(found.shape).sum(axis=0) % 2 == 1, found, sums / counts)


def picture(learnt: FaceMap, cell: int = 28) -> UInt8:
    """Return the U-matrix as a grey picture, dark between different neurons, as in Wojdel's figure 7.16."""
    matrix = borders(learnt.neurons)
    grey = 255 - 230 * (matrix - matrix.min()) / max(float(np.ptp(matrix)), 1e-12)
    return np.kron(grey, np.ones((cell, cell))).astype(np.uint8)


def save(folder: Path, learnt: FaceMap) -> None:
    """Write the map, its picture, and the names of its neurons, which can be edited."""
    arrays = {name: getattr(learnt, name) for name in ARRAYS}
    with replacing(folder / MAP) as path, path.open("wb") as file:
        np.savez_compressed(file, **arrays)
    rows = [json.dumps(learnt.names[k : k + SIDE], ensure_ascii=False) for k in range(0, SIDE * SIDE, SIDE)]
    head = "# Expression of each neuron of the map, in rows; change names as you like.\ncells = [\n"
    write_text(folder / CELLS, head + "".join(f"  {row},\n" for row in rows) + "]\n")
    Image.fromarray(picture(learnt)).save(folder / "map.png")


def load(folder: Path) -> FaceMap:
    """Return the map of a corpus; raises CorpusError if there is none, or it is damaged."""
    try:
        with np.load(folder / MAP, allow_pickle=False) as data:
            mean, components, neurons, accepted = (np.asarray(data[name], np.float64) for name in ARRAYS)
        rows = parse_toml((folder / CELLS).read_text("utf-8"))["cells"]
        names = tuple(str(name) for row in rows for name in row)
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise CorpusError(f"{folder / MAP}: wanted a map, got: {error}; {AGAIN}") from None
    if len(names) != len(neurons):
        raise CorpusError(f"{folder / CELLS}: wanted {SIDE} rows of {SIDE} names, got {len(names)} names")
    return FaceMap(mean, components, neurons, accepted, names)


def _labels(recordings: Sequence[Recording], counts: Sequence[int]) -> dict[str, Bool]:
    """Return expression -> whether each frame of all recordings is labelled with it; {} without labels."""
    found: dict[str, Bool] = {}
    start = 0
    for recording, count in zip(recordings, counts, strict=True):
        for one in recording.segments():
            labelled = found.setdefault(one.text, np.zeros(sum(counts), bool))
            labelled[start + min(one.first, count) : start + min(one.last + 1, count)] = True
        start += count
    return found


def _by_labels(neuron_frames: Sequence[Bool], labels: Mapping[str, Bool]) -> tuple[str, ...]:
    """Return the most frequent label of each neuron's frames, or "" if fewer than half have it."""
    names = []
    for frames in neuron_frames:
        name = max(labels, key=lambda one: int((labels[one] & frames).sum()))
        count = int((labels[name] & frames).sum())
        names.append(name if count > 0 and count >= MAJORITY * frames.sum() else "")
    return tuple(names)


def _by_templates(neuron_frames: Sequence[Bool], data: Float64) -> tuple[str, ...]:
    """Return the template nearest to the difference between each neuron's mean and the median face.

    It is "" if none is near, or if the frames are points, for which there are no templates.
    """
    if data.shape[1] != 68:
        return ("",) * len(neuron_frames)
    directions = features(Recording("", faps=np.stack(list(template_faps().values()))))
    median, names = np.median(data, axis=0), []
    for frames in neuron_frames:
        move = data[frames].mean(axis=0) - median if frames.any() else median * 0
        cosines = (
            directions @ move / np.maximum(np.linalg.norm(directions, axis=1) * np.linalg.norm(move), 1e-12)
        )
        names.append(list(template_faps())[cosines.argmax()] if cosines.max() >= LIKE else "")
    return tuple(names)


@cache
def template_faps() -> Mapping[str, Float64]:
    """Return the FAPs (68,) of each template, by its name in lower case."""
    rows = faps_of(np.stack([au_row(template.aus) for template in templates().values()]))
    return {name.lower(): row for name, row in zip(templates(), rows, strict=True)}


def _acceptance(distances: Float64, own_frames: Bool, limit: float, labelled: Bool | None) -> float:
    """Return the distance up to which most frames have a neuron's expression (7.3.2, figure 7.17).

    Args:
        distances: of all frames; own_frames: those nearest to the neuron; labelled: those with its
            expression, None without labels.
        limit: the largest distance without labels.
    """
    if labelled is None:
        return min(float(np.quantile(distances[own_frames], USUAL)), limit)
    order = np.argsort(distances, kind="stable")
    right = np.convolve(labelled[order], np.ones(RECENT))[: len(order)]
    wrong = np.flatnonzero(right < MAJORITY * np.minimum(np.arange(1, len(order) + 1), RECENT))
    last = int(wrong[0]) if len(wrong) else len(order)
    return float(distances[order[last - 1]]) if last else 0.0
