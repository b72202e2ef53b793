from realizer.tables import by_number
from realizer.tables.expression_motion import expression_motion


def test_expression_motion_orders_known_aus_from_0_to_1() -> None:
    places = expression_motion().places
    assert set(places) <= set(by_number())
    assert (min(places.values()), max(places.values())) == (0.0, 1.0)
    assert places[5] < places[1] < places[12] < places[26]


def test_expression_motion_names_even_aus() -> None:
    assert {43, 45} <= expression_motion().asymmetry.even <= set(by_number())
