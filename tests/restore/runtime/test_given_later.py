"""A field that is given as a function is made once, when it is first read."""

from dataclasses import dataclass, replace

from restore.runtime.given_later import given_later


@given_later("value")
@dataclass(frozen=True)
class Answer:
    """A value and a name."""

    value: int
    name: str = ""


def test_a_function_is_called_once_when_the_field_is_first_read():
    calls = []
    answer = Answer(lambda: calls.append(1) or 42)
    assert calls == []
    assert (answer.value, answer.value, calls) == (42, 42, [1])


def test_a_value_is_kept_and_replaced():
    assert replace(Answer(1), value=2).value == 2
    assert replace(Answer(lambda: 3), name="three").value == 3
