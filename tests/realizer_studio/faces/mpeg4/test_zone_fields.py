"""Tests of the fields of zones."""

import dataclasses

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.mpeg4.zone_fields import zone_fields
from realizer_studio.faces.mpeg4.zones import Setup, Zone, synchronised

# A sheet of skin, 1 mm apart, in the plane z = 0.
X, Y = np.meshgrid(np.arange(-40, 41) / 1000, np.arange(-40, 41) / 1000)
SHEET = np.stack([X.ravel(), Y.ravel(), np.zeros(X.size)], 1)
BROWS = {
    "4.1": (0.010, 0.0, 0.0),
    "4.3": (0.020, 0.0, 0.0),
    "4.5": (0.030, 0.0, 0.0),
    "4.2": (-0.010, 0.0, 0.0),
}


def at(x: float, y: float) -> int:
    return int(np.argmin(np.linalg.norm(SHEET - [x, y, 0], axis=1)))


def setup(*zones: Zone, joined: bool = True, masks: dict[int, np.ndarray] | None = None) -> Setup:
    return Setup(BROWS, {zone.fap: zone for zone in zones}, masks or {}, joined=joined)


def test_zone_fields_of_a_lone_zone_are_an_ellipsoid() -> None:
    field = zone_fields(setup(Zone(31, "linear", 0.008, (1, 0.5, 1))), SHEET)[31]
    assert field[at(0.010, 0)] == pytest.approx([0, 1, 0])
    assert field[at(0.014, 0), 1] == pytest.approx(0.5)
    assert field[at(0.010, 0.002), 1] == pytest.approx(0.5)
    assert field[at(0.018, 0)] == pytest.approx([0, 0, 0])
    assert field[at(0.010, 0.004)] == pytest.approx([0, 0, 0])


def brows(size: float, joined: bool) -> np.ndarray:
    """What FAPs 31, 33 and 35 together do along the brow, metres for each metre."""
    zones = [Zone(fap, "cosine", size) for fap in (31, 33, 35)]
    fields = zone_fields(setup(*zones, joined=joined), SHEET)
    row = [at(x / 1000, 0) for x in range(10, 31)]
    return sum(fields[fap][row, 1] for fap in (31, 33, 35))


def test_zone_fields_make_no_w_if_they_are_joined() -> None:
    assert np.ptp(brows(0.016, joined=False)) > 0.3
    assert np.ptp(brows(0.016, joined=True)) < 1e-9


@pytest.mark.parametrize("size", [0.006, 0.011, 0.025])
def test_zone_fields_move_each_feature_point_exactly(size: float) -> None:
    fields = zone_fields(setup(*(Zone(fap, "cosine", size) for fap in (31, 33, 35))), SHEET)
    for fap, name in ((31, "4.1"), (33, "4.3"), (35, "4.5")):
        for other, field in fields.items():
            wanted = 1 if other == fap else 0
            assert field[at(*BROWS[name][:2]), 1] == pytest.approx(wanted, abs=1e-6)


def test_zone_fields_obey_masks_and_inverted_masks() -> None:
    upper = np.flatnonzero(SHEET[:, 1] >= 0).astype(np.int32)
    zone = Zone(31, "cosine", 0.010, use_mask=True)
    field = zone_fields(setup(zone, masks={31: upper}), SHEET)[31]
    assert field[at(0.010, 0.003), 1] > 0.5
    assert not field[at(0.010, -0.003)].any()
    below = np.flatnonzero(SHEET[:, 1] > 0).astype(np.int32)
    turned = zone_fields(setup(dataclasses.replace(zone, invert_mask=True), masks={31: below}), SHEET)[31]
    assert not turned[at(0.010, 0.003)].any()
    assert turned[at(0.010, -0.003), 1] > 0.5


def test_zone_fields_slide_and_move_away_from_a_pivot() -> None:
    slid = zone_fields(setup(Zone(31, "cosine", 0.01, slide=-0.5)), SHEET)[31]
    assert slid[at(0.010, 0)] == pytest.approx([0, 1, -0.5])
    spread = zone_fields(setup(Zone(31, "cosine", 0.01, radial=1, pivot=(0.010, -0.010, 0.0))), SHEET)[31]
    assert spread[at(0.010, 0), 1] == pytest.approx(1)
    assert spread[at(0.014, 0), 0] > 0.1
    assert spread[at(0.006, 0), 0] < -0.1


def test_zone_fields_name_what_is_wrong_with_a_zone() -> None:
    with pytest.raises(FaceError, match=r"falloff: wanted one of ease, smooth, cosine, linear, got 'cubic'"):
        Zone(31, "cubic", 0.01)  # type: ignore[arg-type]
    with pytest.raises(FaceError, match="wanted a size and scales above 0"):
        Zone(31, "linear", 0.0)
    with pytest.raises(FaceError, match=r"ease: wanted -100..100, got 300"):
        Zone(31, "ease", 0.01, ease=300)
    with pytest.raises(FaceError, match="wanted finite numbers"):
        Zone(31, "ease", float("nan"))
    with pytest.raises(FaceError, match=r"its feature point 8\.1 is not there"):
        zone_fields(setup(Zone(51, "cosine", 0.01)), SHEET)
    with pytest.raises(FaceError, match="it uses a mask and there is none"):
        zone_fields(setup(Zone(31, "cosine", 0.01, use_mask=True)), SHEET)
    far = {31: np.array([3, 10**6], np.int32)}
    with pytest.raises(FaceError, match=r"mask of FAP 31: wanted vertices 0\.\.6560, got 3\.\.1000000"):
        zone_fields(setup(Zone(31, "cosine", 0.01, use_mask=True), masks=far), SHEET)
    none = {31: np.array([0], np.int32)}
    with pytest.raises(FaceError, match="it does not move vertex"):
        zone_fields(setup(Zone(31, "cosine", 0.01, use_mask=True), masks=none), SHEET)
    lopsided = SHEET[SHEET[:, 0] > -0.005]
    mask = np.arange(len(lopsided), dtype=np.int32)
    wanted = setup(Zone(31, "cosine", 0.01), masks={31: mask})
    with pytest.raises(FaceError, match="has no twin on the other side"):
        synchronised(dataclasses.replace(wanted, synced=frozenset({31})), lopsided)


def test_synchronised_copies_zones_with_their_masks() -> None:
    right = np.flatnonzero(SHEET[:, 0] > 0.008).astype(np.int32)
    zone = Zone(31, "ease", 0.010, ease=30, use_mask=True, pivot=(0.01, 0, 0), radial=0.5)
    both = synchronised(dataclasses.replace(setup(zone, masks={31: right}), synced=frozenset({31})), SHEET)
    assert both.zones[32].ease == 30
    assert both.zones[32].pivot == (-0.01, 0, 0)
    assert (SHEET[both.masks[32], 0] < -0.008).all()
    fields = zone_fields(both, SHEET)
    assert fields[32][at(-0.012, 0.002)] == pytest.approx(fields[31][at(0.012, 0.002)] * [-1, 1, 1])
