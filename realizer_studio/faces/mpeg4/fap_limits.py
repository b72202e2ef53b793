"""The usual range of each FAP: what action units use, or what faces can reach."""

from functools import cache

from realizer.tables import au_to_fap, faps

# Limits of FAPs that no action unit uses, in the FAP's unit: what faces can reach.
REACH = {"MNS": 250.0, "MW": 150.0, "ENS": 100.0, "ES": 100.0, "IRISD": 300.0, "angle_unit": 20000.0}
EYEBALLS_OUT = 30.0  # ES: 2 mm
PUPIL = 150.0  # IRISD: 1.5 mm wider or narrower; half an iris would shut a pupil
OPEN_JAW = 3
ROLLED = -0.5  # cosine of 120 degrees, by which lips may turn at most
ON_JAW = {5, 10, 11, 12, 13, 52, 57, 58, 59, 60}  # points that the jaw moves: lower lip, corners


@cache
def usual_range(fap: int, sign: int) -> float:
    """Return the usual maximum of a FAP in one direction (sign 1 or -1), in its unit, positive.

    It is the largest value that an action unit sets, or else what faces reach. For FAPs in ON_JAW it is what
    an action unit adds to the movement of the jaw.
    """
    row = faps()[fap - 1]
    on_jaw = fap in ON_JAW and sign < 0
    most = max(
        sign * unit.get(fap, 0.0) - (unit.get(OPEN_JAW, 0.0) if on_jaw else 0.0)
        for unit in _faps_of_units().values()
    )
    if most <= 0:
        most = _face_range(fap)
    return float(min(most, row.most if sign > 0 else -row.least))


@cache
def required_range(fap: int, sign: int) -> float:
    """Return the largest value that a face must support: the usual maximum, or what faces reach if larger."""
    row = faps()[fap - 1]
    most = row.most if sign > 0 else -row.least
    return max(usual_range(fap, sign), min(_face_range(fap), float(most)))


@cache
def accompanying_faps(fap: int, sign: int) -> dict[int, float]:
    """Return the FAPs of the action unit that moves a FAP most in a direction, empty if none does."""
    strongest = max(_faps_of_units().values(), key=lambda unit: sign * unit.get(fap, 0.0))
    return dict(strongest) if sign * strongest.get(fap, 0.0) > 0 else {}


def _face_range(fap: int) -> float:
    row = faps()[fap - 1]
    if row.direction == "growing":
        return PUPIL
    return EYEBALLS_OUT if row.name.endswith("eyeball") and row.unit == "ES" else REACH[row.unit]


@cache
def _faps_of_units() -> dict[str, dict[int, float]]:
    """Return action unit -> FAP -> value at intensity 1, of both sides."""
    out: dict[str, dict[int, float]] = {}
    for row in au_to_fap():
        values = out.setdefault(str(row.au), {})
        if abs(row.fap_to) > abs(values.get(row.fap, 0.0)):
            values[row.fap] = float(row.fap_to)
    return out
