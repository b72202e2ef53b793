"""The hook that reading and writing call for each element."""

import contextvars

import pytest

from bml_schema import parse, write
from bml_schema.steps import on_element

NOD = '<head id="h{}" lexeme="NOD"/>'


@pytest.mark.parametrize("count", [1, 5, 50])
def test_on_element_is_called_for_each_element_read_or_written(count: int) -> None:
    calls: list[int] = []
    text = f'<bml id="a">{"".join(map(NOD.format, range(count)))}</bml>'

    def hooked() -> int:
        on_element.set(lambda: calls.append(1))
        parse(text)
        return len(calls)

    read = contextvars.copy_context().run(hooked)
    assert read >= count
    parse(text)
    assert len(calls) == read


def test_on_element_may_end_reading_and_writing() -> None:
    def stop() -> None:
        raise TimeoutError("enough")

    def hooked() -> None:
        block = parse('<bml id="a"><head id="h" lexeme="NOD"/></bml>')
        on_element.set(stop)
        with pytest.raises(TimeoutError, match="enough"):
            parse('<bml id="b"><head id="h" lexeme="NOD"/></bml>')
        with pytest.raises(TimeoutError, match="enough"):
            write(block)

    contextvars.copy_context().run(hooked)
