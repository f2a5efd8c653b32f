"""The typed questions, on a small plant written by hand."""

from __future__ import annotations

import pytest
from pyoxigraph import NamedNode, RdfFormat

from homeostat.knowledge.questions import questions
from homeostat.knowledge.questions.questions import CandidateFault, TransitionFact
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.store import UnexpectedAnswer
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, UML

PLANT = """
p:machine a UML:StateMachine ; UML:containsState p:run, p:bypass, p:stop ; UML:containsTransition p:t1, p:t2, p:t3 .
p:run a UML:State ; hs:name "run" ; hs:risk 0 ; hs:isInitialState true ; hs:settledWhen "level >= 1" ;
    rdfs:label "running"@en ; UML:doAction p:pump_on ; hs:requiresComponent p:pump ; hs:allowsSetpoint p:range .
p:bypass a UML:State ; hs:risk 2 ; rdfs:comment "Slow." ; UML:entryAction p:open_bypass .
p:stop a UML:State ; hs:isSafeState true ; hs:isInitialState false .
p:range a hs:SetpointRange ; hs:ofTag p:level_sp ; hs:low 0.0e0 ; hs:high 2.0e0 .
p:t1 a UML:Transition ; UML:sourceState p:run ; UML:targetState p:bypass ; UML:transitionGuard "flow < 0.1" ;
    UML:transitionEvent p:no_flow ; hs:priority 1 ; hs:isRecovery true ; rdfs:label "bypass" ;
    rdfs:comment "Only by decision." ; hs:requiresActuator p:valve .
p:t2 a UML:Transition ; UML:sourceState p:bypass ; UML:targetState p:stop .
p:t3 a UML:Transition ; UML:sourceState p:bypass ; UML:targetState p:run .
p:no_flow a UML:Event ; rdfs:label "no flow" .
p:pump_on a UML:Action ; CPSMod:isChangedByActuator p:pump ; hs:writes p:pump_cmd ; hs:commandValue 1.0e0 .
p:open_bypass a UML:Action ; CPSMod:isChangedByActuator p:valve, p:hand_valve .
p:say a UML:Action .
p:module a VDI2206:Module ; VDI2206:ModuleConsistsOfComponent p:pump, p:valve, p:level_sensor, p:loop .
p:pump a VDI2206:Actuator ; hs:hasParameter p:gain ; rdfs:label "pump" ; hs:feeds p:valve .
p:valve a VDI2206:Actuator . p:hand_valve a VDI2206:Actuator .
p:level_sensor a VDI2206:Sensor .
p:loop a hs:ControlLoop ; hs:hasSetpoint p:level_sp ; hs:proportionalGain 2.0e0 .
p:gain a hs:ModelParameter ; hs:symbol "K" ; hs:value 1.0e0 .
p:level a hs:Tag ; hs:measures p:level_sensor . p:level_sp a hs:Tag ; hs:unit "m" .
p:pump_cmd a hs:Tag ; hs:drives p:pump . p:pump_run a hs:Tag ; hs:reportsPosition p:pump .
p:operator a VDI3682:ProcessOperator ; VDI3682:isAssignedTo p:module ; VDI3682:hasInput p:water ;
    VDI3682:hasOutput p:clean_water ; CPSMod:processRealizesBehavior p:balance .
p:water a VDI3682:Product . p:clean_water a VDI3682:Product ; rdfs:label "clean" .
p:balance a VDI2206:MathematicalModel ; hs:equationText "dV/dt = F" .
p:high a hs:TripLimit ; hs:formula "level <= 2" ; hs:protects p:module .
p:dry a hs:Permissive ; hs:formula "level > 0" ; hs:protects p:pump ; hs:isRequiredFor p:t1 .
p:slow a hs:Envelope ; hs:formula "flow > 0" ; hs:appliesInState p:bypass .
p:clog a DIN17359:Fault ; hs:priorProbability 0.25e0 ; hs:affects p:pump ; hs:disables p:pump, p:t3 .
p:leak a DIN17359:Fault ; hs:affects p:module, p:valve ; hs:disables p:valve .
p:end a DIN17359:Fault ; hs:disables p:stop .
p:drop a DIN17359:Symptom ; DIN17359:SymptomIndicatesFault p:clog, p:leak .
p:noise a DIN17359:Symptom . p:leak DIN17359:FaultIsDescribedBySymptom p:noise .
p:other a DIN17359:Symptom . p:bare DIN17359:FaultIsDescribedBySymptom p:faint .
p:elsewhere a VDI2206:Module ; VDI2206:ModuleConsistsOfComponent p:hand_valve .
"""


def p(name: str) -> NamedNode:
    """A thing of the plant."""
    return NamedNode(f"urn:plant:{name}")


@pytest.fixture(scope="module")
def store() -> EmbeddedStore:
    """A store that holds the plant."""
    store = EmbeddedStore()
    prefixes = "".join(f"@prefix {prefix}: <{iri}> .\n" for prefix, iri in PREFIXES)
    store.load(f"{prefixes}@prefix p: <urn:plant:> .\n{PLANT}".encode(), RdfFormat.TURTLE)
    return store


def test_transitions_have_what_is_stated_and_gaps_where_nothing_is(store: EmbeddedStore) -> None:
    t1, t2, t3 = questions.transitions(store, p("machine"))
    assert t1 == TransitionFact(
        p("t1"), p("run"), p("bypass"), p("no_flow"), "flow < 0.1", 1, True, "bypass", "Only by decision."
    )
    assert t2 == TransitionFact(p("t2"), p("bypass"), p("stop"), None, None, None, False, None, None)
    assert t3.transition == p("t3")
    assert questions.transitions(store, p("nothing")) == ()


def test_a_graph_that_says_nonsense_is_not_believed(store: EmbeddedStore) -> None:
    broken = EmbeddedStore()
    broken.load(store.dump(RdfFormat.N_QUADS), RdfFormat.N_QUADS)
    broken.update(f"INSERT DATA {{ {p('t2')} {UML.transitionGuard} 3 }}")
    with pytest.raises(UnexpectedAnswer, match=r"'guard' is .*3.* where a text is needed"):
        questions.transitions(broken, p("machine"))


def test_candidate_faults_gather_what_symptoms_say(store: EmbeddedStore) -> None:
    clog, leak = questions.candidate_faults(store, [p("drop"), p("noise"), p("other")])
    assert clog == CandidateFault(p("clog"), (p("drop"),), 0.25, (p("pump"),), (p("pump"), p("t3")))
    assert leak == CandidateFault(p("leak"), (p("drop"), p("noise")), None, (p("module"), p("valve")), (p("valve"),))
    assert questions.candidate_faults(store, [p("noise")]) == (
        CandidateFault(p("leak"), (p("noise"),), None, (p("module"), p("valve")), (p("valve"),)),
    )
    assert questions.candidate_faults(store, [p("faint")]) == (CandidateFault(p("bare"), (p("faint"),), None, (), ()),)
    assert questions.candidate_faults(store, [p("other")]) == questions.candidate_faults(store, []) == ()


@pytest.mark.parametrize(
    ("path", "faults", "admissible"),
    [
        (["run", "bypass"], [], True),
        (["run", "bypass", "stop"], [], True),
        (["run", "bypass", "run", "bypass"], [], True),
        (["run", "stop"], [], False),
        (["bypass", "run", "stop"], [], False),
        (["stop", "bypass"], [], False),
        (["run", "bypass"], ["clog"], True),
        (["run", "bypass"], ["leak"], False),
        (["run", "bypass"], ["clog", "leak"], False),
        (["bypass", "run"], ["clog"], False),
        (["bypass", "stop"], ["end"], False),
        (["bypass", "stop"], ["clog", "leak"], True),
        (["run", "nowhere"], [], False),
    ],
)
def test_a_path_is_admissible_where_every_step_is(
    store: EmbeddedStore, path: list[str], faults: list[str], admissible: bool
) -> None:
    states, present = [p(state) for state in path], [p(fault) for fault in faults]
    assert questions.is_admissible_path(store, p("machine"), states, present) is admissible
    assert not questions.is_admissible_path(store, p("another"), states, present)


def test_each_way_of_taking_a_transition_away_is_enough(store: EmbeddedStore) -> None:
    for thing in ("pump", "t3", "run"):
        view = EmbeddedStore()
        view.load(store.dump(RdfFormat.N_QUADS), RdfFormat.N_QUADS)
        view.update(f"DELETE WHERE {{ {p('clog')} <urn:homeostat:ontology#disables> ?o }}")
        step = (p("machine"), [p("bypass"), p("run")], [p("clog")])
        assert questions.is_admissible_path(view, *step)
        view.update(f"INSERT DATA {{ {p('clog')} <urn:homeostat:ontology#disables> {p(thing)} }}")
        assert not questions.is_admissible_path(view, *step)


@pytest.mark.parametrize("path", [[], ["run"]])
def test_a_path_has_at_least_two_states(store: EmbeddedStore, path: list[str]) -> None:
    with pytest.raises(ValueError, match=f"at least 2 states, not {len(path)}"):
        questions.is_admissible_path(store, p("machine"), [p(state) for state in path], [])
