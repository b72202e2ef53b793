"""Tests of `realizer_studio.tracking.markers.colours`."""

from __future__ import annotations

import pytest
from PIL import Image

from realizer_studio.tracking.markers.colours import Colour, learnt, named, of_numbers
from realizer_studio.tracking.network import TrackingError


def test_mask_has_the_pixels_within_the_box() -> None:
    picture = Image.new("HSV", (4, 1))
    for x, pixel in enumerate([(250, 200, 200), (4, 200, 200), (30, 200, 200), (4, 40, 200)]):
        picture.putpixel((x, 0), pixel)
    red = Colour("red", (0, 80, 80), (15, 30, 30))  # hues are a circle
    assert red.mask(picture).tolist() == [[True, True, False, False]]


def test_learnt_puts_clicks_of_one_hue_together() -> None:
    picture = Image.new("RGB", (60, 20), (190, 150, 130))
    for x, colour in ((10, (60, 190, 80)), (30, (40, 140, 60)), (50, (50, 80, 200))):
        picture.paste(colour, (x - 3, 7, x + 4, 14))
    green, blue = learnt(picture, [(10, 10), (30, 10), (50, 10)], "film")
    assert green.centre[0] == pytest.approx(129, abs=4)
    assert blue.centre[0] == pytest.approx(228, abs=4)
    assert green.mask(picture.convert("HSV")).sum() == 2 * 49
    assert blue.mask(picture.convert("HSV")).sum() == 49


@pytest.mark.parametrize(
    ("place", "said"), [((70, 5), "within 60 x 20 pixels, got 70,5"), ((2, 2), "a coloured marker at 2,2")]
)
def test_learnt_refuses_places_without_a_colour(place: tuple[int, int], said: str) -> None:
    with pytest.raises(TrackingError, match=said):
        learnt(Image.new("RGB", (60, 20), (120, 118, 119)), [place], "film")


def test_colours_are_given_by_names_and_numbers() -> None:
    assert named(" Green ").name == "green"
    assert of_numbers("120,60,70").centre == (120, 60, 70)
    assert of_numbers("120,60,70,10,20,30").spread == (10, 20, 30)
    with pytest.raises(TrackingError, match=r"wanted some of red, .*, got 'mauve'"):
        named("mauve")
    for text in ("120,60", "400,60,70", "a,b,c", "1,2,3,0,1,1", "nan,1,1"):
        with pytest.raises(TrackingError, match="wanted H,S,V"):
            of_numbers(text)
