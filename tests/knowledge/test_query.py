"""Templates: what they declare is what they do, and no argument can change a query's shape."""

from __future__ import annotations

import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pyoxigraph import NamedNode, RdfFormat

from benchmarks.graph_scaling import questions, size_of_answer
from benchmarks.synthetic_plant import node, plant
from homeostat.knowledge.questions.query import (
    Argument,
    Form,
    Kind,
    ParameterError,
    Template,
    TemplateError,
    names,
    parse,
    template,
)
from homeostat.knowledge.store.embedded import EmbeddedStore

ECHO = parse(
    "echo",
    """# form: SELECT
# doc: Gives its arguments back.
# param text: string -- a text
# param whole: integer -- a whole number
# param number: double -- a number
# param flag: boolean -- a truth value
# param thing: iri -- a thing
# param things: iri* -- some things
SELECT ?text_ ?whole_ ?number_ ?flag_ ?thing_ ?each ?literally # $text is no parameter here
WHERE {
  BIND($text AS ?text_) BIND("$text <$text> # $text" AS ?literally)
  BIND($whole AS ?whole_) BIND($number AS ?number_) BIND($flag AS ?flag_) BIND($thing AS ?thing_)
  OPTIONAL { VALUES ?each { $things } }
}
""",
)
PLAIN: dict[str, Argument] = {
    "text": "a",
    "whole": 1,
    "number": 1.5,
    "flag": True,
    "thing": NamedNode("urn:x"),
    "things": (NamedNode("urn:a"), NamedNode("urn:b")),
}
ATTACKS = (
    '"> . ?s ?p ?o } #',
    '" . } ; DROP ALL #',
    "' } UNION { ?s ?p ?o } #",
    '"""',
    "\\",
    "\\u0022 . ?s ?p ?o } #",
    "\\\\u0022) FILTER(false",
    "\\U00000022",
    "\n\r",
    "\x00\x01",
    "?s",
    "$text",
    "urn:x> ?p ?o . <urn:y",
    "#",
    "}",
    "@en",
    "^^<urn:x>",
)
ANY_TEXT = st.text(max_size=40) | st.sampled_from(ATTACKS) | st.text("\\uU0\"'\n{}#<>?$. 002227Cc", max_size=25)
STORE = EmbeddedStore()
PLANT = EmbeddedStore()
PLANT.load(plant(2), RdfFormat.N_TRIPLES)


def echo(**arguments: Argument) -> tuple[str, float, float, bool, NamedNode]:
    """What the echo template gives back in its first row, as Python values."""
    row = ECHO.select(STORE, **{**PLAIN, **arguments})[0]
    assert row.text("literally") == "$text <$text> # $text"
    return row.text("text_"), row.number("whole_"), row.number("number_"), row.flag("flag_"), row.iri("thing_")


@given(text=ANY_TEXT)
@example("\\\x00").via("an escaped backslash before an escaped control character")
@example("\\\\\\u0022")
def test_any_text_arrives_unchanged_and_changes_nothing_else(text: str) -> None:
    assert echo(text=text) == (text, 1.0, 1.5, True, NamedNode("urn:x"))


@given(text=ANY_TEXT)
@example("\\u0022 . ?s ?p ?o } #")
@example("\\\\U00000022 . ?s ?p ?o } #")
def test_a_store_that_decodes_escapes_before_parsing_is_not_fooled_either(text: str) -> None:
    bound = ECHO.bind({**PLAIN, "text": text})
    decoded = re.sub(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})", lambda code: chr(int(code[1] or code[2], 16)), bound)
    assert STORE.select(decoded)[0].text("text_") == text


@given(
    whole=st.integers(-(2**63) + 1, 2**63 - 1),
    number=st.floats(allow_nan=False, allow_infinity=False),
    flag=st.booleans(),
    path=st.text(st.characters(codec="ascii", categories=["L", "N"]), max_size=10),
)
def test_numbers_truth_values_and_things_arrive_unchanged(whole: int, number: float, flag: bool, path: str) -> None:
    thing = NamedNode(f"urn:test:{path}")
    row = ECHO.select(STORE, **{**PLAIN, "whole": whole, "number": number, "flag": flag, "thing": thing})[0]
    term = row.term("whole_")
    assert term is not None and int(term.value) == whole
    assert (row.number("number_"), row.flag("flag_"), row.iri("thing_")) == (number, flag, thing)


@pytest.mark.parametrize("count", [0, 1, 2, 50])
def test_a_list_is_that_many_terms(count: int) -> None:
    things = tuple(NamedNode(f"urn:n:{i}") for i in range(count))
    rows = ECHO.select(STORE, **{**PLAIN, "things": things})
    assert {row.optional_iri("each") for row in rows} == set(things or (None,)) and len(rows) == max(1, count)


WRONG: tuple[tuple[str, object], ...] = (
    *(("thing", value) for value in ("urn:x", "", 1, True, None, ("urn:x",), (NamedNode("urn:x"),), *ATTACKS)),
    *(("things", value) for value in (NamedNode("urn:x"), "urn:x", ["x"], ("urn:x",), (NamedNode("urn:x"), "y"), None)),
    *(("things", (attack,)) for attack in ATTACKS),
    *(("text", value) for value in (1, 1.5, True, None, NamedNode("urn:x"), b"a", ("a",), "\ud800", "a\udfff" * 200)),
    *(("whole", value) for value in ("1", 1.0, True, None, 2**63, -(2**70), NamedNode("urn:x"))),
    *(("number", value) for value in ("1", True, None, float("nan"), float("inf"), float("-inf"), 10**400)),
    *(("flag", value) for value in ("true", 1, 0.0, None)),
)


@pytest.mark.parametrize(("name", "value"), WRONG, ids=lambda value: ascii(value)[:40])
def test_an_argument_of_another_type_is_refused_by_name(name: str, value: object) -> None:
    (parameter,) = (parameter for parameter in ECHO.parameters if parameter.name == name)
    with pytest.raises(ParameterError) as error:
        ECHO.bind({**PLAIN, name: value})  # type: ignore[dict-item]
    message = str(error.value)
    assert "'echo'" in message and repr(name) in message and f"needs {parameter.kind.value}" in message
    assert "\n" not in message and len(message) < 250
    assert repr(value)[:100] in message


@pytest.mark.parametrize("value", ["x", "http://a b", "urn:x>", 'urn:"', "urn:\\u003e", "urn:{}", "http://a/\n"])
def test_what_is_no_iri_cannot_become_one(value: str) -> None:
    with pytest.raises(ValueError, match="IRI"):
        NamedNode(value)


def test_missing_and_unknown_arguments_are_refused_by_name() -> None:
    without = {name: value for name, value in PLAIN.items() if name != "thing"}
    with pytest.raises(ParameterError, match="'echo': parameter 'thing' is missing, takes text: string, whole"):
        ECHO.bind(without)
    with pytest.raises(ParameterError, match="'echo': parameter 'thnig' is unknown"):
        ECHO.bind({**PLAIN, "thnig": NamedNode("urn:x")})


@pytest.mark.parametrize("name", questions(1))
def test_an_attack_on_any_template_is_refused_or_finds_nothing(name: str) -> None:
    good = questions(1)[name]
    assert size_of_answer(PLANT, name, good) > 0
    before = PLANT.dump(RdfFormat.N_QUADS)
    for parameter in template(name).parameters:
        for attack in ATTACKS:
            try:
                thing = NamedNode(f"urn:{attack}")
            except ValueError:
                continue
            bad: Argument = thing if parameter.kind is Kind.IRI else (thing,)
            changed = size_of_answer(PLANT, name, {**good, parameter.name: bad})
            assert changed <= size_of_answer(PLANT, name, good)
        with pytest.raises(ParameterError):
            template(name).bind({**good, parameter.name: ATTACKS[0]})
    assert PLANT.dump(RdfFormat.N_QUADS) == before


@pytest.mark.parametrize("name", names())
def test_every_template_keeps_its_declaration(name: str) -> None:
    item = template(name)
    nothing: dict[Kind, Argument] = {
        Kind.IRI: NamedNode("urn:nothing"),
        Kind.IRIS: (NamedNode("urn:nothing"),),
        Kind.STRING: "",
        Kind.INTEGER: 0,
        Kind.DOUBLE: 0.0,
        Kind.BOOLEAN: False,
    }
    arguments = {parameter.name: nothing[parameter.kind] for parameter in item.parameters}
    assert item.doc.endswith(".") and all(parameter.doc for parameter in item.parameters)
    asks = {
        Form.SELECT: item.select,
        Form.CONSTRUCT: item.construct,
        Form.ASK: item.ask,
        Form.UPDATE: item.update,
    }
    assert not asks[item.form](EmbeddedStore(), **arguments)
    for form, other in asks.items():
        if other != asks[item.form]:
            with pytest.raises(TypeError, match=f"{name!r} has form {item.form.value}, not .*{form.value}"):
                other(EmbeddedStore(), **arguments)


def test_every_form_of_query_has_a_template() -> None:
    assert {template(name).form for name in names()} == set(Form)


def test_every_template_without_a_plant_of_its_own_is_measured() -> None:
    assert set(questions(0)) <= set(names())
    for name, arguments in questions(0).items():
        assert {parameter.name for parameter in template(name).parameters} == set(arguments)


def test_an_unknown_template_is_refused_with_a_hint() -> None:
    with pytest.raises(KeyError, match="no template 'state_machin'; did you mean 'state_machine'"):
        template("state_machin")


HEAD = "# form: ASK\n# doc: Something.\n"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("ASK {}", "needs '# form:"),
        ("# form: ASK\nASK {}", "needs '# form:"),
        ("# form: ask\n# doc: x.\nASK {}", "needs '# form:"),
        ("# form: ASK\n# form: ASK\n# doc: x.\nASK {}", "cannot read the declaration '# form: ASK'"),
        (HEAD + "# hello\nASK {}", "cannot read the declaration '# hello'"),
        (HEAD + "# param a: iris -- x\nASK { $a ?p ?o }", "cannot read the declaration"),
        (HEAD + "# param a: iri\nASK { $a ?p ?o }", "cannot read the declaration"),
        (HEAD + "# param a: iri -- x\nASK {}", r"declares parameters \['a'\], uses \[\]"),
        (HEAD + "ASK { $a ?p ?o }", r"declares parameters \[\], uses \['a'\]"),
        (HEAD + "# param a: iri -- x\nASK { ?s ?p '$a' }", r"uses \[\]"),
        (HEAD + "# param a: iri -- x\n# param a: iri -- x\nASK { $a ?p ?o }", r"declares parameters \['a', 'a'\]"),
        (HEAD + "# param a: iri -- x\nASK { $a ?p ?a }", "'a' is both a parameter and a variable"),
        (HEAD + "# param a: iri* -- x\nASK { $a ?p ?o }", r"'\$a' must stand in 'VALUES"),
        (HEAD + "# param a: iri -- x\nASK { VALUES ?s { $a } }", r"'\$a' must stand in 'VALUES"),
    ],
)
def test_a_template_that_contradicts_itself_is_refused(text: str, complaint: str) -> None:
    with pytest.raises(TemplateError, match=f"template 'bad': .*{complaint}") as error:
        parse("bad", text)
    assert "\n" not in str(error.value)


def test_parameters_are_found_only_where_a_term_can_stand() -> None:
    places = "ASK { <urn:$a> <urn:p> '''$a\n\"$a''' . # $a\n $a ?p \"\\\"$a\" FILTER(1 < 2 && 3 > 2) }"
    text = f"{HEAD}# param a: iri -- x\n{places}"
    bound = parse("places", text).bind({"a": NamedNode("urn:term")})
    assert bound == text.replace("\n $a ?p", "\n <urn:term> ?p")
    assert STORE.ask(bound) is False


def test_a_template_is_what_the_file_says() -> None:
    item = template("is_admissible_step")
    assert isinstance(item, Template) and item is template("is_admissible_step")
    assert [(p.name, p.kind) for p in item.parameters] == [
        ("machine", Kind.IRI),
        ("source", Kind.IRI),
        ("target", Kind.IRI),
        ("faults", Kind.IRIS),
    ]
    machine = node(0, "machine")
    assert f"{machine} UML:containsTransition" in item.bind({**questions(0)["is_admissible_step"], "machine": machine})
