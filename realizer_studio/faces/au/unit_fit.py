"""The fit of a face's action unit model to measured displacements (Wojdel 2005, table 4.3)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.au.model import CENTIMETRE, HeadTurn, Model, Motion, Mouth, UnitModel
from realizer.face.au.regions import fit_mouth
from realizer.face.au.units import units
from realizer.face.model import Face
from realizer.tables import action_units
from realizer_studio.faces.au.fit_limits import FURTHEST, MonitoredPoints, furthest, monitored_points
from realizer_studio.faces.au.measure import UnitMeasurement
from realizer_studio.faces.au.solve import UNMOVED_WEIGHT, Fit

FORMS = ("published", "extended")  # one or two Gaussians; up to four
MOVES = 0.01  # of the largest displacement; smaller ones count as undisplaced
NEAR = 0.01  # m around displaced points, within which all points are used
FAR = 4  # one in so many of the points farther away is used
THIN = 3  # one in so many of the undisplaced points near them is used
HIDDEN = 0.1  # weight of hidden points
PARTS = 4  # of landmarks, each of which is left out once
LOWEST = 0.14  # m below the eyes, where faces do not move


@dataclass(frozen=True, slots=True)
class Row:
    """A row of Wojdel's table 4.3, in metres, over visible points that move by more than 1 % of d_max."""

    au: int
    n: int
    d: float
    d_max: float
    e: float
    e_max: float

    @property
    def ratio(self) -> float:
        """e / d_max, by which models are compared."""
        return self.e / self.d_max


def fit_models(
    face: Face,
    measured: Mapping[int, UnitMeasurement],
    forms: Sequence[str] = FORMS,
    progress: Callable[[str], None] = lambda _: None,
    source: str = "",
) -> dict[str, Model]:
    """Fit the measured displacement units; rotations come from the face's pivots.

    Density and direction are first fitted separately (4.8, 4.9), then together. The extended form starts from
    the published one. No vertex of the face may move much further than the furthest landmark.

    Args:
        forms: of "published" (one or two Gaussians) and "extended" (up to four).
        progress: called with a sentence for each fitted action unit.
        source: the source of the measurements, for the models' headers.

    Returns:
        Form -> model.

    Raises:
        FaceError: an unknown form, or a measurement without a visible displacement.
    """
    for form in forms:
        if form not in FORMS:
            raise FaceError(f"form: wanted one of {', '.join(FORMS)}, got {form!r}")
    mouth = fit_mouth(face)
    y, z = (np.asarray(face.points["2.1"][1:], np.float64) - face.basis["chin"]).tolist()
    jaw = 0.0, float(y), float(z)
    points, finer = monitored_points(face, mouth), monitored_points(face, mouth, between=True)
    fitted: dict[str, dict[int, UnitModel]] = {form: {} for form in forms}
    for au, one in measured.items():
        ratios = []
        size = _d_max(one)
        found = _fit_unit(one, mouth, points, forms)
        # Rarely a unit moves points between vertices too far: then those points are monitored as well.
        if any(furthest(unit, mouth, finer)[0] > FURTHEST * size for unit in found.values()):
            found = _fit_unit(one, mouth, finer, forms)
        for form, unit in found.items():
            if au in (26, 27):
                unit = UnitModel(au, unit.motions, _jaw_degrees(face, unit, mouth, jaw))
            fitted[form][au] = unit
            ratios.append(f"{_row(unit, one, mouth).ratio:.3f}")
        progress(f"AU{au}: e/d_max {', '.join(ratios)}")
    degrees = {row.au: row.degrees for row in action_units()}
    left, right = (_triple(centre) for _, centre in face.basis["eyes"])
    head = _head(face)
    return {
        form: Model(
            form=form,
            source=source or face.source,
            licence=face.licence,
            mouth=mouth,
            head=head,
            eyes=(left, right),
            jaw=jaw,
            units=fitted[form],
            degrees={au: degrees[au] for au, unit in units().items() if unit.kind != "displacement"},
        )
        for form in forms
    }


def table(model: Model, measured: Mapping[int, UnitMeasurement]) -> tuple[Row, ...]:
    """Return Wojdel's table 4.3 for the units in both arguments."""
    return tuple(_row(model.units[au], one, model.mouth) for au, one in measured.items() if au in model.units)


def table_text(rows: tuple[Row, ...]) -> str:
    """Return the table as Wojdel prints it, in millimetres."""
    lines = ["AU        n       d   d_max       e   e_max  e/d_max  e_max/d_max"]
    for row in rows:
        lengths = "".join(f"{1000 * value:8.3f}" for value in (row.d, row.d_max, row.e, row.e_max))
        lines.append(f"AU{row.au:<4}{row.n:5}{lengths}{row.ratio:9.4f}{row.e_max / row.d_max:13.4f}")
    ratios = [row.ratio for row in rows]
    worst = max(rows, key=lambda row: row.ratio)
    lines.append(
        f"mean e/d_max of {len(rows)} units {np.mean(ratios):.4f}, worst AU{worst.au} {worst.ratio:.4f}; "
        "lengths in mm"
    )
    return "\n".join(lines)


def left_out_text(face: Face, measured: Mapping[int, UnitMeasurement], models: Mapping[str, Model]) -> str:
    """Return the errors of models on landmarks that they were not fitted to, by cross-validation.

    A quarter of the landmarks of each unit is left out at a time. Units with more parameters than measured
    numbers are named, because they fit their landmarks anyway.
    """
    mouth = fit_mouth(face)
    points, forms = monitored_points(face, mouth), tuple(models)
    lines = []
    for au, one in measured.items():
        size, long = _d_max(one), np.linalg.norm(one.moves, axis=1)
        counts = one.visible & (long > MOVES * size)
        missed = {form: long.copy() for form in forms}  # the error of a unit without displacement
        order = np.random.default_rng(0).permutation(len(long))
        for out in (order[k::PARTS] for k in range(PARTS)):
            rest = np.setdiff1d(order, out)
            if not counts[rest].any():
                continue
            upper = [None, None] if one.upper is None else [one.upper[rest], one.upper[out]]
            part = UnitMeasurement(au, one.at[rest], one.moves[rest], one.visible[rest], upper[0])
            for form, unit in _fit_unit(part, mouth, points, forms).items():
                predicted = unit.displacement(one.at[out], mouth, upper[1])
                missed[form][out] = np.linalg.norm(predicted - one.moves[out], axis=1)
        for form, model in models.items():
            figures = sum(
                m.gaussians.size + np.count_nonzero(m.alpha) + np.count_nonzero(m.beta)
                for m in model.units[au].motions.values()
            )
            numbers = 3 * int(counts.sum())
            few = f"; {figures} figures for {numbers} numbers, measure more" if figures > numbers else ""
            ratio = missed[form][counts].mean() / size
            lines.append(f"AU{au:<4}{form}: e/d_max {ratio:.4f} on landmarks left out{few}")
    return "\n".join(lines)


def _d_max(one: UnitMeasurement) -> float:
    if not one.moves[one.visible].any():
        raise FaceError(f"AU{one.au}: wanted a landmark that moves and can be seen, got none")
    return float(np.linalg.norm(one.moves[one.visible], axis=1).max())


def _row(unit: UnitModel, one: UnitMeasurement, mouth: Mouth) -> Row:
    long = np.linalg.norm(one.moves, axis=1)
    d_max = _d_max(one)
    counts = one.visible & (long > MOVES * d_max)
    upper = None if one.upper is None else one.upper[counts]
    miss = np.linalg.norm(unit.displacement(one.at[counts], mouth, upper) - one.moves[counts], axis=1)
    return Row(
        one.au, int(counts.sum()), float(long[counts].mean()), d_max, float(miss.mean()), float(miss.max())
    )


def _fit_unit(
    one: UnitMeasurement, mouth: Mouth, points: MonitoredPoints, forms: Sequence[str]
) -> dict[str, UnitModel]:
    # Wojdel's units are symmetric, so the measurements of both sides are mirrored to the left.
    flip = np.where(one.at[:, :1] < 0, [-1.0, 1.0, 1.0], 1.0)
    at, moves = one.at * flip, one.moves * flip
    long = np.linalg.norm(moves, axis=1)
    size = _d_max(one)
    weight = np.where(one.visible, 1.0, HIDDEN) * np.where(long > MOVES * size, 1.0, UNMOVED_WEIGHT)
    # A point counts also for its mirror image, except in the middle.
    weight = weight * np.where(at[:, 0] < 1e-6, 0.5, 1.0)
    halves = {"whole": weight}
    if units()[one.au].split:
        upper = mouth.upper(at) if one.upper is None else one.upper
        halves = {"upper": weight * upper, "lower": weight * (1 - upper)}
    motions = {
        half: _fit_motion(at, moves, half_weight, size, points.of(half), forms)
        for half, half_weight in halves.items()
    }
    return {form: UnitModel(one.au, {half: found[form] for half, found in motions.items()}) for form in forms}


def _fit_motion(
    at: Float64, moves: Float64, weight: Float64, size: float, around: Float64, forms: Sequence[str]
) -> dict[str, Motion]:
    long = np.linalg.norm(moves, axis=1)
    counted = weight > 1e-3
    moved = counted & (long > MOVES * size)
    if not moved.any():  # this half does not move
        bell = np.array([[0, 0, 0, 0, 1, 0, 1, 0, 0, 1.0]])
        zeros = np.zeros(19)
        return dict.fromkeys(forms, Motion(np.zeros(3), bell, zeros, zeros))
    low, high = at[moved].min(axis=0) - NEAR, at[moved].max(axis=0) + NEAR
    near = counted & ((at > low) & (at < high)).all(axis=1)
    # Undisplaced points limit the functions: a part of them is enough.
    moving = moved & (weight >= UNMOVED_WEIGHT)
    near = np.flatnonzero(near & ~moving)[::THIN]
    far = np.flatnonzero(counted & (at[:, 1] > -LOWEST) & ~((at > low) & (at < high)).all(axis=1))[::FAR]
    use = np.r_[np.flatnonzero(moving), near, far]
    weight = np.r_[weight[moving], weight[near] * THIN, weight[far] * FAR]
    share = weight * long[use]
    origin = share @ at[use] / share.sum()
    origin[0] = 0
    fit = Fit((at[use] - origin) / CENTIMETRE, moves[use] / size, weight, (around - origin) / CENTIMETRE)
    found = {"published": fit.published()}
    if "extended" in forms:
        found["extended"] = fit.extended(found["published"])
    metres = np.r_[size, np.ones(9)]
    return {
        form: Motion(origin, found[form].gaussians * metres, found[form].alpha, found[form].beta)
        for form in forms
    }


def _head(face: Face) -> HeadTurn:
    """Return the smooth step that fits best how the face's vertices follow its head."""
    weight = np.asarray(face.basis["head"], np.float64).ravel()
    at = face.vertices.astype(np.float64)
    chin = float(face.points["2.1"][1])
    pivot = _triple(face.points["7.1"])

    def miss(x: Float64) -> Float64:
        return HeadTurn(pivot, x[0], min(x[1], x[0] - 1e-3), x[2]).density(at) - weight

    found = least_squares(miss, np.array([chin, chin - 0.06, 0.2]), x_scale=[0.01, 0.01, 0.1])
    top, end, tilt = (float(value) for value in found.x)
    return HeadTurn(pivot, top, min(end, top - 1e-3), tilt)


def _jaw_degrees(face: Face, unit: UnitModel, mouth: Mouth, jaw: tuple[float, float, float]) -> float:
    """Return the rotation of the jaw in degrees that moves the chin as the unit does."""
    chin = np.asarray(face.points["2.1"], np.float64)
    moved = chin + unit.displacement(chin[None], mouth)[0]
    arms = [position[1:] - np.array(jaw[1:]) for position in (chin, moved)]
    before, after = (np.arctan2(arm[1], arm[0]) for arm in arms)
    return float(np.degrees((after - before + np.pi) % (2 * np.pi) - np.pi))


def _triple(position: object) -> tuple[float, float, float]:
    x, y, z = np.asarray(position, np.float64).tolist()
    return x, y, z
