"""The table against the facts that it was made from, and what is read into it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import DeviceError, SettingsError
from drivers.stage import CONTROLLERS, Controller, controller_named, open_stage
from drivers.stage.protocol import MAX_PREAMBLE, Answer, angle, finish, home, initialise, position, rotate

HALF_A_DIGIT = 0.5  # of the last digit of the printed step, which was cut and not always rounded

MODELS = st.sampled_from(sorted(CONTROLLERS))


@pytest.mark.parametrize("row", CONTROLLERS.values(), ids=lambda row: row.model)
def test_the_printed_step_is_a_turn_divided_by_its_pulses(row: Controller) -> None:
    digits = len(row.step.split(".")[1])
    assert float(row.step) == pytest.approx(row.pulse_deg, abs=2 * HALF_A_DIGIT * 10**-digits)


@pytest.mark.parametrize("row", CONTROLLERS.values(), ids=lambda row: row.model)
def test_a_rotation_names_its_pulses_once(row: Controller) -> None:
    assert rotate(row, 1234, travel=0).sent.count(b"1234") == 1
    with pytest.raises(ValueError, match="from 0"):
        rotate(row, -1, travel=0)


def test_the_isel_strings_are_those_that_the_emulation_answers() -> None:
    row = CONTROLLERS["isel(RF-1)"]
    assert rotate(row, 5200, travel=5200).sent == b"@0M5200,+600\r"
    assert rotate(row, 5200, travel=5200).answer == b"0"
    assert home(row).sent == b"@0M0,+600\r"


def test_the_zeta_answers_the_rotation_with_four_prompts_as_the_table_expects() -> None:
    row = CONTROLLERS["ZETA6104"]
    assert rotate(row, 7, travel=7).answer == b"\r\n> " * 4
    assert home(row).answer == b"\r\n> " * 4
    assert finish(row).sent == b"MA1 D0 \rGO1\rWAIT(1PE<>1)\rRESET\r"
    assert not row.handshake


def test_the_marks_answer_every_line() -> None:
    assert initialise(CONTROLLERS["Mark-202"]).answer == b"OK\r\n" * 2
    assert home(CONTROLLERS["Mark-102"]).answer == b"OK\r\n"


def test_a_move_that_no_answer_ends_is_waited_for() -> None:
    row = CONTROLLERS["CSG-602R v2.0"]
    assert rotate(row, 72_000, travel=72_000).motion_s > 72_000 / 5_000  # 500F5000: 5000 pulses a second
    assert rotate(row, 72_000, travel=0).motion_s < 1
    assert rotate(CONTROLLERS["MMC-2"], 1000, travel=1000).motion_s == 0


@given(MODELS, st.floats(-1e4, 1e4))
def test_positions_and_angles_are_each_others_inverse(model: str, wanted: float) -> None:
    row = CONTROLLERS[model]
    pulses = position(row, wanted)
    assert 0 <= pulses < row.pulses
    assert position(row, angle(row, pulses)) == pulses
    assert abs((angle(row, pulses) - wanted + 180) % 360 - 180) <= abs(row.pulse_deg) * (0.5 + 1e-6)


@given(MODELS, st.lists(st.integers(1, 8), max_size=20), st.data())
def test_an_answer_is_recognised_in_whatever_pieces_it_comes(model: str, cuts: list[int], data: st.DataObject) -> None:
    exchange = rotate(CONTROLLERS[model], 100, travel=100)
    answer, rest = Answer(exchange), exchange.answer
    while rest:
        assert not answer.complete
        size = data.draw(st.integers(1, len(rest)))
        answer.feed(rest[:size])
        rest = rest[size:]
    assert answer.complete


@given(MODELS, st.binary(max_size=200))
def test_any_bytes_are_an_answer_or_a_declared_error(model: str, data: bytes) -> None:
    row = CONTROLLERS[model]
    for exchange in (initialise(row), rotate(row, 100, travel=100), finish(row)):
        answer = Answer(exchange)
        try:
            answer.feed(data)
        except DeviceError as error:
            assert error.hint
        assert len(answer.got) < 1000


def test_an_echo_may_come_before_the_first_answer_of_the_zeta() -> None:
    exchange = initialise(CONTROLLERS["ZETA6104"])
    answer = Answer(exchange)
    answer.feed(exchange.sent + exchange.answer)
    assert answer.complete


def test_noise_without_end_is_not_a_controller() -> None:
    answer = Answer(initialise(CONTROLLERS["ZETA6104"]))
    with pytest.raises(DeviceError, match="without end"):
        answer.feed(b"\x00" * (MAX_PREAMBLE + 1))


def test_an_unknown_model_is_refused_with_the_list() -> None:
    with pytest.raises(SettingsError) as caught:
        controller_named("ZETA")
    assert "ZETA6104" in caught.value.hint


def test_only_an_ambiguous_controller_can_be_relative() -> None:
    with pytest.raises(SettingsError, match="counts from home"):
        open_stage("MMC-2", "/dev/null", relative=True)
