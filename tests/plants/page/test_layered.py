"""The layered layout: nothing overlaps, links cross no box, and they lead where they should."""

from __future__ import annotations

from itertools import combinations, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.plants.page.layered import Box, Layout, layered
from homeostat.plants.page.layers import Corrections

GAP = (30.0, 12.0)
NAMES = st.sampled_from([f"b{i}" for i in range(12)])


@st.composite
def graphs(draw: st.DrawFn) -> tuple[dict[str, Box], list[tuple[str, str]]]:
    sizes = st.floats(5.0, 200.0)
    boxes = draw(st.dictionaries(NAMES, st.builds(Box, sizes, sizes), min_size=1))
    ends = st.sampled_from(sorted(boxes))
    return boxes, draw(st.lists(st.tuples(ends, ends), max_size=30))


def apart(layout: Layout) -> bool:
    """Whether every two boxes are away from each other: by a gap along, or by one across."""
    for a, b in combinations(layout.places.values(), 2):
        along = max(a.along - b.along - b.box.along, b.along - a.along - a.box.along)
        across = max(a.across - b.across - b.box.across, b.across - a.across - a.box.across)
        if along < GAP[0] - 1e-6 and across < GAP[1] - 1e-6:
            return False
    return True


@settings(max_examples=150, deadline=None)
@given(graphs())
def test_no_two_boxes_come_nearer_than_the_gap(graph: tuple[dict[str, Box], list[tuple[str, str]]]) -> None:
    layout = layered(*graph, GAP)
    assert layout.places.keys() == graph[0].keys()
    assert apart(layout)
    for place in layout.places.values():
        assert -1e-6 <= place.along <= layout.along - place.box.along + 1e-6
        assert -1e-6 <= place.across <= layout.across - place.box.across + 1e-6


@settings(max_examples=150, deadline=None)
@given(graphs())
def test_a_link_joins_its_boxes_and_passes_the_others(graph: tuple[dict[str, Box], list[tuple[str, str]]]) -> None:
    layout = layered(*graph, GAP)
    assert set(layout.routes) == {link for link in graph[1] if link[0] != link[1]}
    for (source, target), route in layout.routes.items():
        for name, point in ((source, route[0]), (target, route[-1])):
            place = layout.places[name]
            assert point[0] == pytest.approx(place.along) or point[0] == pytest.approx(place.along + place.box.along)
            assert place.across < point[1] < place.across + place.box.across
        straight = list(pairwise(route))[::2]  # between them it runs in a gap, where no box is
        for (begin, at), (end, same) in straight:
            assert at == same
            for name in layout.places.keys() - {source, target}:
                place = layout.places[name]
                beside = max(begin, end) <= place.along or min(begin, end) >= place.along + place.box.along
                assert beside or not place.across < at < place.across + place.box.across


@settings(max_examples=100, deadline=None)
@given(graphs(), st.data())
def test_corrections_move_boxes_and_make_none_overlap(
    graph: tuple[dict[str, Box], list[tuple[str, str]]], data: st.DataObject
) -> None:
    names = sorted(graph[0])
    some = st.lists(st.sampled_from(names), unique=True) if names else st.just([])
    order, later = data.draw(some), {name: data.draw(st.integers(1, 4)) for name in data.draw(some)}
    layout = layered(*graph, GAP, corrections=Corrections(later, tuple(order)))
    assert layout.places.keys() == graph[0].keys() and apart(layout)
    middle = {name: place.along + place.box.along / 2.0 for name, place in layout.places.items()}
    for before, after in combinations(order, 2):
        if middle[before] == pytest.approx(middle[after]):
            assert layout.places[before].across < layout.places[after].across


def test_a_box_that_stands_further_on_takes_with_it_what_follows() -> None:
    boxes = dict.fromkeys("abcx", Box(10.0, 10.0))
    links = [("a", "b"), ("b", "c"), ("a", "x"), ("x", "c")]
    found = layered(boxes, links, GAP)
    moved = layered(boxes, links, GAP, corrections=Corrections({"b": 1}))
    assert found.places["b"].along == found.places["x"].along
    assert moved.places["b"].along == found.places["c"].along < moved.places["c"].along
    assert moved.places["x"].along == found.places["x"].along


def test_links_lead_forward_but_for_those_that_close_a_circle() -> None:
    boxes = dict.fromkeys("abc", Box(10.0, 10.0))
    layout = layered(boxes, [("a", "b"), ("b", "c"), ("c", "a")], GAP)
    a, b, c = (layout.places[name].along for name in "abc")
    assert a < b < c
    assert layout.routes["a", "b"][0][0] < layout.routes["a", "b"][-1][0]
    assert layout.routes["c", "a"][0][0] > layout.routes["c", "a"][-1][0]


def test_what_starts_is_in_the_first_layer_whatever_leads_to_it() -> None:
    boxes = dict.fromkeys("abc", Box(10.0, 10.0))
    layout = layered(boxes, [("a", "b"), ("c", "a")], GAP, start="a")
    assert layout.places["a"].along == 0.0 < layout.places["c"].along


def test_two_ways_between_two_boxes_do_not_coincide() -> None:
    layout = layered(dict.fromkeys("ab", Box(10.0, 40.0)), [("a", "b"), ("b", "a")], GAP)
    assert layout.routes["a", "b"][0][1] != layout.routes["b", "a"][-1][1]


def test_a_tree_is_drawn_without_a_crossing() -> None:
    links = [("r", "x"), ("r", "y"), ("y", "y1"), ("x", "x1"), ("y", "y2"), ("x", "x2")]
    layout = layered(dict.fromkeys({end for link in links for end in link}, Box(10.0, 10.0)), links, GAP)
    order = sorted(("x1", "x2", "y1", "y2"), key=lambda name: layout.places[name].across)
    assert {name[0] for name in order[:2]} in ({"x"}, {"y"})


def test_nothing_is_drawn_of_nothing() -> None:
    assert layered({}, [], GAP) == Layout({}, {}, 0.0, 0.0)
