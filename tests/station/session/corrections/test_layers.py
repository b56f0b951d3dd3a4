"""What a page is restored with: preset, rules, its own corrections; and which pages have to be restored."""

from __future__ import annotations

import pytest

from restore import BadInput
from station.session import Volume, add_rule, add_scan, correct, create_session, open_session, read_session
from station.session.corrections.layers import effective_edits, is_corrected, layers_of
from station.session.derivation.parameters import inputs_of, needs_restoration, outdated_pages, parameters_of
from station.session.log.current import about_of
from station.session.log.steps import decide, record_run
from station.session.terms.about import ABOUT
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset
from station.session.terms.rules import Scope, edits_of


@pytest.fixture(params=["single", "auto"])
def writer(request, tmp_path, tiny_scan):
    """A session with one page, for each layout of a preset."""
    values = Preset(layout=request.param).model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=values))
    with open_session(tmp_path / "book") as opened:
        add_scan(opened, tiny_scan, facts={})
        yield opened


def turned(quarters):
    return {"parts": {"page": {"turn": quarters}}}


def page_of(writer):
    return writer.history.page(1)


def restored(writer):
    session, page = writer.session, page_of(writer)
    parameters = parameters_of(session, page)
    others = inputs_of(session, page)
    return record_run(writer, RESTORE, page.capture, parameters=parameters, result={}, others=others)


def test_without_corrections_nothing_is_added_to_the_parameters(writer):
    assert effective_edits(writer.session, page_of(writer)) is None
    layout = Preset.model_validate(writer.session.volume.preset_values).layout
    assert parameters_of(writer.session, page_of(writer)).get("layout", "single") == layout
    assert "edits" not in parameters_of(writer.session, page_of(writer))


def test_own_corrections_win_over_rules_and_later_rules_over_earlier_ones(writer):
    add_rule(writer, Scope(), edits_of({"layout": "split", **turned(1)}))
    add_rule(writer, Scope(), edits_of(turned(2)))
    assert effective_edits(writer.session, page_of(writer)) == {"layout": "split", **turned(2)}
    correct(writer, 1, edits_of({"layout": "whole", **turned(3)}))
    assert effective_edits(writer.session, page_of(writer)) == {"layout": "whole", **turned(3)}
    assert [source for source, _ in layers_of(writer.session, page_of(writer))] == ["rule 3", "rule 4", "page"]
    correct(writer, 1, edits_of(turned(0)))  # as found, against the rules
    assert effective_edits(writer.session, page_of(writer)) == {"layout": "split"}


def test_a_turned_page_is_not_split_by_it_in_a_session_of_single_pages(writer):
    correct(writer, 1, edits_of(turned(1)))
    single = Preset.model_validate(writer.session.volume.preset_values).layout == "single"
    assert effective_edits(writer.session, page_of(writer)) == {**turned(1), **({"layout": "whole"} if single else {})}
    correct(writer, 1, edits_of({"spine": [[3.0, 0.0], [3.0, 7.0]]}))
    assert "layout" not in effective_edits(writer.session, page_of(writer))  # a spine is drawn to split there


def test_what_changes_no_image_makes_no_restoration_outdated(writer):
    restored(writer)
    correct(
        writer, 1, edits_of({"note": "torn", "by": {"operator": "A. B."}, "parts": {"page": {"label": "7", "turn": 0}}})
    )
    assert effective_edits(writer.session, page_of(writer)) is None
    assert not needs_restoration(writer.session, page_of(writer))


def test_a_correction_asks_for_a_restoration_that_has_it_as_an_input(writer):
    assert needs_restoration(writer.session, page_of(writer))
    restored(writer)
    assert not needs_restoration(writer.session, page_of(writer))
    own, rule = correct(writer, 1, edits_of(turned(1))), add_rule(writer, Scope(), edits_of({"overlap_mm": 2.0}))
    assert outdated_pages(writer.session) == [1]
    run = restored(writer)
    assert outdated_pages(writer.session) == []
    assert [one.event for one in run.inputs] == [2, own.number, rule.number]
    assert run.facts["parameters"]["edits"] == effective_edits(writer.session, page_of(writer))


@pytest.mark.parametrize(("layout", "leaves"), [("single", ["page"]), ("auto", ["left", "right"])])
def test_a_preset_gives_size_overlap_and_direction(layout, leaves, tmp_path, tiny_scan):
    preset = Preset(layout=layout, size_mm=(120.0, 170.0), overlap_mm=2.0, direction="rtl")
    create_session(
        tmp_path / "book", Volume(title="A", preset_values=preset.model_dump(mode="json", exclude_none=True))
    )
    with open_session(tmp_path / "book") as writer:
        add_scan(writer, tiny_scan, facts={})
        sizes = {leaf: {"size_mm": [120.0, 170.0]} for leaf in leaves}
        whole = {"layout": "whole"} if layout == "single" else {}
        assert effective_edits(writer.session, page_of(writer)) == {"overlap_mm": 2.0, "parts": sizes, **whole}
        assert not is_corrected(writer.session, page_of(writer))
        assert about_of(writer.history).direction == "rtl"
        correct(writer, 1, edits_of({"overlap_mm": 3.0}))
        decide(writer, ABOUT, {"direction": "ltr"})
        assert effective_edits(writer.session, page_of(writer))["overlap_mm"] == 3.0
        assert [source for source, _ in layers_of(writer.session, page_of(writer))] == ["preset", "page"]
        assert is_corrected(writer.session, page_of(writer))
        assert about_of(writer.history).direction == "ltr"
    first = read_session(tmp_path / "book").history.event(1).facts
    assert not {"size_mm", "overlap_mm", "direction"} & set(first["volume"]["preset_values"])  # unknown to format 2


def test_points_in_space_are_for_loose_scans(writer):
    with pytest.raises(BadInput, match="loose scans"):
        correct(writer, 1, edits_of({"frame": "space", "spine": [[0.0, 0.0, -900.0], [0.0, 9.0, -900.0]]}))


def test_programs_without_layouts_read_such_a_session(writer):
    """Presets of format 2 refuse values that they do not know: `layout` stands where nobody looks."""
    known = {"settings", "outputs", "language", "foliation", "first", "sides", "thresholds"}
    first = writer.history.event(1).facts
    assert set(first["volume"]["preset_values"]) <= known
    assert set(first) == {"id", "volume", "layout"}
    assert read_session(writer.session.folder).volume == writer.session.volume
