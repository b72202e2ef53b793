"""Tests of the deformer, by the standard's definition of each FAP on every face."""

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.tables import Fap, faps
from realizer_studio.faces.mpeg4.fap_measures import Measure
from tests.rows import each_row
from tests.shipped import FACES, FOLDERS

LOW_LEVEL = faps()[2:]
WAYS = {
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "left": (1, 0, 0),
    "right": (-1, 0, 0),
    "forward": (0, 0, 1),
}
TURNS = (
    "yaw_l_eyeball",
    "yaw_r_eyeball",
    "pitch_l_eyeball",
    "pitch_r_eyeball",
    "head_pitch",
    "head_yaw",
    "head_roll",
)
SPECIAL = (*TURNS, "tongue_roll", "dilate_l_pupil", "dilate_r_pupil", "open_jaw")
STRAIGHT = [row for row in LOW_LEVEL if row.name not in SPECIAL]
UPPER = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6")
LOWER = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
CORNERS = ("2.4", "2.5", "8.3", "8.4")
CORNERS_DOWN = {12: -480, 13: -480, 59: -420, 60: -420}
WIDE = {3: 1100, 5: -1350, 10: -1190, 11: -1190, 52: -1350, 57: -1180, 58: -1180} | CORNERS_DOWN  # as AU27
OPEN = {3: 600, 5: -600, 10: -540, 11: -540, 52: -600, 57: -540, 58: -540}


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def rows(values: dict[int, float]) -> np.ndarray:
    out = np.zeros((1, 68), np.float32)
    for fap, value in values.items():
        out[0, fap - 1] = value
    return out


def moved(face: Face, values: dict[int, float]) -> np.ndarray:
    """(n_vertices, 3) metres from the neutral face."""
    return deform(face, rows(values))[0].astype(float) - face.vertices


def usual(row: Fap) -> float:
    """A value that people's faces reach: what animation asks for, not the most that can be coded."""
    reach = {"MNS": 250, "MW": 150, "ENS": 100, "ES": 100, "IRISD": 300, "angle_unit": 20000}[row.unit]
    if row.name.startswith("thrust") and row.unit == "ES":
        reach = 30  # eyeballs: 2 mm
    if row.group == 6 and row.unit != "angle_unit":
        reach = 60  # where the mouth has room for the tongue
    return min(reach, row.most)


def both(row: Fap) -> list[float]:
    return [usual(row)] if row.least == 0 else [usual(row), -usual(row)]


def test_deform_lowers_brows_without_a_ledge_over_the_nose(face: Face) -> None:
    skin, brow = slice(*face.parts["skin"]), face.points["4.1"][1]
    at = face.vertices[skin]
    bridge = (np.abs(at[:, 0]) < 0.001) & (at[:, 2] > 0) & (brow - 0.04 < at[:, 1]) & (at[:, 1] < brow)
    downwards = np.flatnonzero(bridge)[np.argsort(-at[bridge, 1])]
    down = at + moved(face, {fap: -130 if fap < 33 else -90 for fap in range(31, 37)})[skin]
    assert (np.diff(down[downwards, 1]) / np.diff(at[downwards, 1])).min() > 0.49


def test_load_face_has_a_default() -> None:
    assert load_face().name in FOLDERS


def test_deform_keeps_the_neutral_mesh(face: Face) -> None:
    assert np.array_equal(deform(face, np.zeros((3, 68)))[1], face.vertices)


@each_row("row", STRAIGHT)
def test_deform_moves_a_feature_point_by_value_times_fapu(face: Face, row: Fap) -> None:
    mouth = OPEN if row.group == 6 else {}
    for value in both(row):
        move = moved(face, mouth | {row.fap: value}) - moved(face, mouth)
        move = move[face.feature_points[row.feature_point]]
        asked = value * face.fapu.metres(row.unit)
        assert move @ np.array(WAYS[row.direction]) == pytest.approx(asked, rel=0.02)


def test_deform_lowers_the_chin_by_open_jaw_without_the_lips(face: Face) -> None:
    for value in (150, 600, 1500):
        move = moved(face, {3: value})
        asked = value * face.fapu.metres("MNS")
        assert -move[face.feature_points["2.1"], 1] == pytest.approx(asked, rel=0.02)
        for name in (*UPPER, *LOWER, *CORNERS):
            x, y, z = move[face.feature_points[name]]
            assert np.hypot(x, y) < 0.05 * asked, name
            # Stretched cheeks draw the corners backwards.
            assert -0.52 * asked < z < 0.05 * asked, name


def test_deform_draws_the_corners_back_while_the_chin_falls(face: Face) -> None:
    move = moved(face, {3: 800})
    chin = move[face.feature_points["2.1"]]
    for name in CORNERS:
        assert move[face.feature_points[name], 2] < 0.35 * chin[1]
    assert chin[2] > 1.1 * chin[1]  # on the arc of the jaw, not into the neck


def test_deform_moves_lower_teeth_and_tongue_by_open_jaw(face: Face) -> None:
    move = np.linalg.norm(moved(face, {3: 800}), axis=1)
    for part in ("lower_teeth", "tongue"):
        assert np.median(move[slice(*face.parts[part])]) > 0.003
    assert move[slice(*face.parts["upper_teeth"])].max() < 1e-6
    first, last = face.parts["lower_teeth"]
    before = face.vertices[first:last]
    after = deform(face, rows({3: 800}))[0, first:last]
    size = lambda at: np.linalg.norm(at - at[0], axis=1)  # noqa: E731
    assert np.allclose(size(before), size(after), atol=5e-5)


@pytest.mark.parametrize(
    ("fap", "value", "way"), [(14, 300, (0, 0, 1)), (15, 200, (-1, 0, 0)), (15, -200, (-1, 0, 0))]
)
def test_deform_moves_lower_teeth_and_tongue_by_thrust(
    face: Face, fap: int, value: int, way: tuple[int, int, int]
) -> None:
    move = moved(face, {fap: value})
    asked = value * face.fapu.metres("MNS" if fap == 14 else "MW") * np.array(way)
    assert np.allclose(move[slice(*face.parts["lower_teeth"])], asked, atol=2e-6)
    # The tongue's tip and borders stop at the upper teeth.
    off = np.linalg.norm(move[slice(*face.parts["tongue"])] - asked, axis=1)
    assert np.median(off) < 1e-4
    assert np.abs(move[slice(*face.parts["upper_teeth"])]).max() == 0


def test_jaw_pose_turns_before_it_slides(face: Face) -> None:
    first, last = face.parts["lower_teeth"]
    before = face.vertices[first:last].astype(float)
    after = before + moved(face, {3: 400})[first:last]
    # A rigid motion: the best one leaves nothing over, and turns about the axis through both joints.
    u, _, vt = np.linalg.svd((before - before.mean(axis=0)).T @ (after - after.mean(axis=0)))
    turn = (u @ vt).T
    assert np.allclose((before - before.mean(axis=0)) @ turn.T, after - after.mean(axis=0), atol=5e-5)
    assert np.linalg.det(turn) == pytest.approx(1)
    assert turn[0, 0] == pytest.approx(1, abs=1e-4)
    assert 0.02 < np.arcsin(turn[2, 1]) < 0.42


def outside(face: Face, at: np.ndarray, cover: str) -> np.ndarray:
    """(skin,) metres that the skin lies before the nearest triangle of what covers it; -inf far from it."""
    from scipy.spatial import cKDTree

    first, last = face.parts[cover]
    corners = at[face.triangles[((face.triangles >= first) & (face.triangles < last)).all(axis=1)]]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
    skin = at[slice(*face.parts["skin"])]
    away, nearest = cKDTree(corners.mean(axis=1)).query(skin)
    depth = ((skin - corners.mean(axis=1)[nearest]) * up[nearest]).sum(axis=1)
    return np.where(away < 0.012, depth, -np.inf)


@pytest.mark.parametrize("fap", [48, 49, 50])
def test_deform_keeps_covered_skin_covered_on_a_turned_head(face: Face, fap: int) -> None:
    rest = outside(face, face.vertices.astype(float), "shirt")
    covered = np.isfinite(rest) & (rest < -0.0005)
    assert covered.any()
    for value in (52360, -52360):
        now = outside(face, deform(face, rows({fap: value}))[0].astype(float), "shirt")
        assert (now[covered] > 0).mean() < 0.007  # at the rim of a collar single vertices may show


@pytest.mark.parametrize(
    ("side", "part", "yaw", "pitch"), [(0, "left_eye", 23, 25), (1, "right_eye", 24, 26)]
)
def test_deform_turns_eyeballs_by_the_angle(face: Face, side: int, part: str, yaw: int, pitch: int) -> None:
    _, centre = face.basis["eyes"][side]
    pupil = face.feature_points["3.5" if side == 0 else "3.6"]
    for fap, way in ((yaw, (1, 0)), (pitch, (0, -1))):
        for value in (30000, -30000):
            at = deform(face, rows({fap: value}))[0, pupil] - centre
            angle = np.arctan2(at[0] * way[0] + at[1] * way[1], at[2])
            assert angle == pytest.approx(value * 1e-5, rel=0.02)
    other = "right_eye" if side == 0 else "left_eye"
    assert np.abs(moved(face, {yaw: 30000})[slice(*face.parts[other])]).max() == 0
    assert part in face.parts


@pytest.mark.parametrize(("fap", "part"), [(29, "left_eye"), (30, "right_eye")])
def test_deform_widens_pupils_by_value_times_fapu(face: Face, fap: int, part: str) -> None:
    first, last = face.parts[part]
    eye = 0 if part == "left_eye" else 1
    _, centre = face.basis["eyes"][eye]
    out = np.hypot(*(face.vertices[first:last] - centre)[:, :2].T)
    edge = np.flatnonzero(np.isclose(out, 0.002, atol=1e-4) & (face.vertices[first:last, 2] > centre[2]))
    for value in (200, -200):
        after = deform(face, rows({fap: value}))[0, first:last] - centre
        grown = 2 * (np.hypot(*after[:, :2].T) - out)[edge].mean()
        assert grown == pytest.approx(value * face.fapu.metres("IRISD"), rel=0.05)


def test_deform_turns_the_head_by_the_angle_without_the_bust(face: Face) -> None:
    tip, pivot = face.feature_points["9.3"], face.points["7.1"]
    before = face.vertices[tip] - pivot
    for fap, plane, sign in ((48, (2, 1), -1), (49, (2, 0), 1), (50, (1, 0), -1)):
        for value in (25000, -25000):
            after = deform(face, rows({fap: value}))[0]
            a = np.arctan2(before[plane[1]], before[plane[0]])
            b = np.arctan2((after[tip] - pivot)[plane[1]], (after[tip] - pivot)[plane[0]])
            turned = (b - a + np.pi) % (2 * np.pi) - np.pi
            assert sign * turned == pytest.approx(value * 1e-5, rel=0.02)
            low = face.vertices[:, 1] < -0.24
            assert np.abs(after[low] - face.vertices[low]).max() < 1e-6


def test_deform_lifts_both_borders_by_tongue_roll(face: Face) -> None:
    after = deform(face, rows({47: 60000}))[0]
    for name in ("6.3", "6.4"):
        vertex = face.feature_points[name]
        rise = after[vertex, 1] - face.vertices[vertex, 1]
        assert rise == pytest.approx(abs(face.vertices[vertex, 0]) * np.sin(0.6), rel=0.02)


@each_row("row", LOW_LEVEL)
def test_deform_mirrors_mirrored_faps(face: Face, row: Fap) -> None:
    from scipy.spatial import cKDTree

    value = usual(row)
    # Hair, brows and teeth are mirrored in place, not vertex by vertex; the skin is.
    skin = slice(*face.parts["skin"])
    at = face.vertices[skin].astype(float)
    off, twin = cKDTree(at).query(at * [-1, 1, 1])
    pairs = off < 1e-5
    assert pairs.mean() > 0.95
    here = moved(face, {row.fap: value})[skin]
    there = moved(face, {row.mirror: value * row.sign})[skin][twin] * [-1, 1, 1]
    largest = np.abs(here).max()
    assert np.abs(here - there)[pairs].max() <= max(0.01 * largest, 2e-6)


@pytest.mark.parametrize(
    "row", [r for r in LOW_LEVEL if r.feature_point in UPPER + LOWER], ids=lambda r: r.name
)
def test_deform_leaves_the_opposite_lip(face: Face, row: Fap) -> None:
    opposite = LOWER if row.feature_point in UPPER else UPPER
    move = np.linalg.norm(moved(face, {row.fap: usual(row)}), axis=1)
    asked = usual(row) * face.fapu.metres(row.unit)
    for name in opposite:
        assert move[face.feature_points[name]] < 0.05 * asked, name


@pytest.mark.parametrize(
    ("fap", "others"), [(19, "3.3 3.1"), (20, "3.4 3.2"), (21, "3.1 3.3"), (22, "3.2 3.4")]
)
def test_deform_leaves_the_opposite_lid(face: Face, fap: int, others: str) -> None:
    opposite, _ = others.split()
    move = moved(face, {fap: 300})
    assert np.linalg.norm(move[face.feature_points[opposite]]) < 0.05 * 300 * face.fapu.metres("IRISD")


@pytest.mark.parametrize("upper", [1024, 700, 512])
def test_deform_closes_lids_whose_faps_add_up_to_the_aperture(face: Face, upper: int) -> None:
    closed = deform(face, rows({19: upper, 20: upper, 21: 1024 - upper, 22: 1024 - upper}))[0]
    for high, low in (("3.1", "3.3"), ("3.2", "3.4")):
        gap = closed[face.feature_points[high]] - closed[face.feature_points[low]]
        assert abs(gap[1]) < 0.0003
        assert np.linalg.norm(gap) < 0.0015


def test_deform_keeps_eyeballs_behind_the_lids_of_a_blink(face: Face) -> None:
    for share in np.linspace(0.1, 1, 8):
        upper, lower = 700 * share, 324 * share
        at = deform(face, rows({19: upper, 20: upper, 21: lower, 22: lower}))[0]
        for eye, (_, centre) in enumerate(face.basis["eyes"]):
            radius = face.basis["bulges"][eye][2]
            lids = face.basis["lid"][face.basis["lid_eye"] == eye]
            assert np.linalg.norm(at[lids] - centre, axis=1).min() > radius


@each_row("row", LOW_LEVEL)
def test_deform_flips_no_triangle_at_usual_values(face: Face, row: Fap) -> None:
    first, last = face.parts["skin"]
    mine = face.triangles[(face.triangles < last).all(axis=1)]
    inside = np.asarray(face.occlusion)[mine].max(axis=1) < 0.30  # behind the lips, in the sockets

    def ups(at: np.ndarray) -> np.ndarray:
        a, b, c = (at[mine[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    rest = ups(face.vertices.astype(float))
    value = usual(row)
    for v in (value, -value) if row.least < 0 else (value,):
        # The head's turn turns triangles: compare what is left when it is taken away.
        if row.name.startswith("head"):
            continue
        now = ups(deform(face, rows({row.fap: v}))[0].astype(float))
        flipped = (rest * now).sum(axis=1) < -0.2 * np.linalg.norm(rest, axis=1) * np.linalg.norm(now, axis=1)
        assert not (flipped & ~inside).any(), np.flatnonzero(flipped & ~inside)[:10]
    assert first == 0


def test_deform_moves_a_lip_evenly_by_equal_faps(face: Face) -> None:
    move = moved(face, dict.fromkeys((5, 10, 11, 52, 57, 58), -300))[:, 1]
    inner = [move[face.feature_points[name]] for name in ("2.8", "2.3", "2.9")]
    assert np.ptp(inner) < 0.02 * abs(inner[1])
    skin = slice(*face.parts["skin"])
    assert move[skin].min() > 1.045 * inner[1]  # nothing between the points sinks below them


def test_deform_opens_a_lower_lip_without_lumps(face: Face) -> None:
    measure = Measure.of(face)
    move = measure.displacement(WIDE)[measure.skin]
    lip = face.vertices[[face.feature_points[name] for name in LOWER]]
    away = np.linalg.norm(face.vertices[measure.skin][:, None] - lip, axis=2).min(axis=1)
    off = np.linalg.norm(move - measure.average @ move, axis=1)[measure.visible & (away < 0.006)]
    assert np.percentile(off, 95) < 0.00105


def test_deform_of_batches_equals_single_frames(face: Face) -> None:
    rng = np.random.default_rng(7)
    table = np.array([[row.least, row.most] for row in faps()])
    frames = (rng.uniform(-0.2, 0.2, (9, 68)) * np.abs(table).max(axis=1)).astype(np.float32)
    batch = deform(face, frames)
    for frame, vertices in zip(frames, batch, strict=True):
        assert np.allclose(deform(face, frame[None])[0], vertices, atol=1e-6)


@pytest.mark.parametrize("bad", [np.zeros(68), np.zeros((2, 67)), np.full((1, 68), np.nan)])
def test_deform_refuses_wrong_rows(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="poses: wanted"):
        deform(load_face(), bad)
