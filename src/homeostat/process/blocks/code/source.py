"""The kernel of a flowsheet as source code: one tick of one member, straight on, as an engineer would write it.

Each tick: controllers read what was measured last; actuators follow their commands; what comes from outside, lags and
dead times; the balances in steps, positions held; instruments. Times within `SAME_S` are the same: sums of
ticks are rounded.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, final

from homeostat.process.blocks.code.control import conclude, control
from homeostat.process.blocks.code.integrating import runge_kutta, runge_kutta_in_place, stabilised_in_place
from homeostat.process.blocks.code.pieces import cut
from homeostat.process.blocks.code.writing import Scope, function
from homeostat.process.blocks.hydraulics.solver import ENOUGH
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import Actuator, Delay, Disturbance, Hold, Lag, Network, Sensor, State
from homeostat.process.blocks.term import EACH_TICK, MEMBER, TICK, TIME, ZERO, Leaf, Term, leaves, maximum

_HEAD: Final = (
    "def advance(first, last, x, p, sev, onset, u, u_of, t_0, begin, steps, stride, seeds, process, sensor, picks,",
    "            out, broken_at, work):",
    "    for m in range(first, last):",
    "        xm, pm, sm, om, um = x[m], p[m], sev[m], onset[m], u[u_of[m]]",
    "        seed, loud, noisy, row = seeds[m], process[m], sensor[m], begin[m] // stride",
)
_THERE: Final = ("xm", "pm", "sm", "om", "um", "seed", "loud", "noisy", "m", "k", "t", "work", "t_0", "broken_at")
"""Variables that every tick may read."""
_MOST: Final = "1e12"
"""A state beyond this is no state of a plant."""


def kernel_source(layout: Layout) -> str:
    """Source of ``advance`` and the functions that it calls; see :class:`homeostat.process.batch.Kernel`."""
    return _Source(layout).text()


@final
class _Source:
    """Writes the source of one layout."""

    def __init__(self, layout: Layout) -> None:
        self._layout, self._sheet, self._at, self._tick = layout, layout.sheet, layout.column, repr(layout.tick_s)
        self._states = tuple(s.term for s in layout.sheet.states.values())
        self._room = layout.room_of_states
        parameters = {Term(Leaf.PARAMETER, value=n): f"pm[{i}]" for i, n in enumerate(layout.parameters)}
        held = {Term(Leaf.HELD, value=n): f"xm[{i}]" for i, n in enumerate(layout.states)}
        inputs = {Term(Leaf.INPUT, value=n): f"um[k, {i}]" for i, n in enumerate(layout.inputs)}
        faults = {Term(Leaf.FAULT, value=n): "0.0" for n in layout.sheet.faults}
        faults |= {Term(Leaf.AGE, value=n): "0.0" for n in layout.sheet.faults}
        faults |= {Term(Leaf.FAULT, value=n): f"f{i}" for i, n in enumerate(layout.faults)}
        faults |= {Term(Leaf.AGE, value=n): f"a{i}" for i, n in enumerate(layout.faults)}
        late = {Term(Leaf.FAULT, value=n): f"g{i}" for i, n in enumerate(layout.faults)}
        self._beyond = layout.beyond
        self._used = leaves(*layout.terms())
        self._off = leaves(*(s.off for s in layout.sheet.sensors.values()))
        self._member = Scope(parameters | {TICK: self._tick}, MEMBER, "w")
        states = {state: f"xm[{self._at[str(state.value)]}]" for state in self._states}
        known = held | inputs | faults | states | {TIME: "t"}
        self._each = Scope(known, EACH_TICK, "s", self._member)
        self._shown = Scope(known | late, EACH_TICK, "z", self._member)

    def text(self) -> str:
        """The whole source."""
        rates = list(self._layout.rates.values())
        slopes, needs = function("slopes", self._states, rates, self._room)
        shown = [*(s.of for s in self._sheet.sensors.values()), *(q.of for q in self._sheet.quantities.values())]
        measures, wants = function("measures", self._states, shown)
        body = self._whole_tick(needs, wants)
        at_start, member = cut("member", self._member.lines, ("pm",), wanted=self._member.named)
        each_tick, tick = cut("tick", body, (*_THERE, *self._member.named))
        physical = " & ".join(map(self._possible, self._sheet.states.values()))
        lines = [
            *slopes, "", *measures, "", *at_start, *each_tick, *_HEAD,
            f"        if not ({physical}):",
            f"            broken_at[m] = t_0 + begin[m] * {self._tick}",
            "            continue",
            *(f"        {line}" for line in member),
            "        for k in range(begin[m], steps):",
            f"            t = t_0 + k * {self._tick}",
            *(f"            {line}" for line in tick),
            f"            if not ({physical}):",
            f"                broken_at[m] = t + {self._tick}",
            "                break",
            "            if k % stride == stride - 1:",
            "                for j in range(picks.shape[0]):",
            "                    out[m, row, j] = xm[picks[j]]",
            "                row += 1",
        ]  # fmt: skip
        return "\n".join(lines) + "\n"

    def _possible(self, state: State) -> str:
        """The condition under which a state is one of a plant."""
        x = f"xm[{self._at[state.name]}]"
        least = f"(-{_MOST} < {x})" if state.least is None else f"({state.least!r} <= {x})"
        return f"{f'(0.0 < {x})' if state.unit == 'K' else least} & ({x} < {_MOST})"  # no `and`: each is a branch

    def _whole_tick(self, needs: Sequence[Term], wants: Sequence[Term]) -> list[str]:
        scope = self._each
        scope.say(*(f"f{i} = begun(sm[{i}], om[{i}], t)" for i in range(len(self._layout.faults))))
        for i, name in enumerate(self._layout.faults):
            if Term(Leaf.AGE, value=name) in self._used:
                scope.say(f"a{i} = aged(om[{i}], t)")
        for m in self._sheet.memories.values():
            scope.say(f"xm[{self._at[m.name]}] = {scope.name(m.update)}")
            scope = scope.forget()
        for c in self._sheet.controllers.values():
            scope = control(c, self._layout, scope).forget()
        for a in self._sheet.actuators.values():
            scope = self._act(a, scope).forget()
        for c in self._sheet.controllers.values():
            conclude(c, self._layout, scope)
        scope = scope.forget()
        # Counted, and not a number in each line: numba would compile what draws noise anew for each of them.
        scope.say(f"channel = {len(self._sheet.sensors) - 1}")
        for d in self._sheet.disturbances.values():
            scope.say("channel += 1")
            self._disturb(d, scope)
        scope = scope.forget()
        for each in self._sheet.lags.values():
            self._follow(each, scope)
            scope = scope.forget()
        self._integrate([scope.name(each) for each in needs], scope)
        at_end = [f"y{i}" if self._room is None else f"xm[{i}]" for i in range(len(self._states))]
        given = [*at_end, *(scope.name(each) for each in wants)]
        named = [f"q{i}" for i in range(len(self._sheet.sensors) + len(self._sheet.quantities))]
        scope.say(f"{', '.join(named)}, = measures({', '.join(given)})", f"tick = math.floor(t / {self._tick} + 1.5)")
        for i, name in enumerate(self._layout.faults):
            if Term(Leaf.FAULT, value=name) in self._off:  # what an instrument does wrong shows at the end of the tick
                scope.say(f"g{i} = begun(sm[{i}], om[{i}], t + {self._tick})")
        shown = () if self._beyond is None else self._beyond.departures.instruments
        columns = f"({', '.join(str(self._at[name]) for name in shown)},)"
        if self._beyond is not None:
            behind, first = self._beyond.behind()
            scope.say(f"restore(xm, {columns}, {behind})")
        scope.say("channel = -1")
        for i, s in enumerate(self._sheet.sensors.values()):
            scope.say(*self._show(s, i))
        ideal = [f"xm[{self._at[self._sheet.sensors[name].ideal]}]" for name in shown]
        if self._beyond is not None:
            scope.say(*(f"work[{i}] = {column}" for i, column in enumerate(ideal)))
            law = self._beyond.first_parameter
            scope.say(f"show(xm, {columns}, work, {behind}, pm, {first}, {law}, seed, int(tick))")
            scope.say(*(f"{column} = work[{i}]" for i, column in enumerate(ideal)))
        for i, name in enumerate(self._sheet.quantities, start=len(self._sheet.sensors)):
            scope.say(f"xm[{self._at[name]}] = q{i}")
        return scope.lines

    def _act(self, a: Actuator, scope: Scope) -> Scope:
        """The command that reaches an actuator, and where it stands after a tick."""
        at, command = self._at, f"xm[{self._at[a.command]}]"
        automatic = command if a.automatic is None else scope.name(a.automatic)
        by_hand = f"um[k, {self._layout.inputs.index(a.manual)}]"
        scope.say(f"{command} = commanded({automatic}, {by_hand})", f"go = {command}")
        if a.withheld != ZERO:
            scope.say(f"go = min(max(go - {scope.name(a.withheld)}, 0.0), 1.0)")
        if self._beyond is not None and (place := self._beyond.before(a.name)) is not None:
            scope.say(f"go = reached({command}, xm, {place[0]}, pm, {place[1]}, {self._tick})")
        for name, where in ((a.stuck_closed, "1.0 - {}"), (a.stuck_open, "{}")):
            if name in self._layout.faults:
                active = f"f{self._layout.faults.index(name)}"
                scope.say(f"go = stuck(go, {active}, {where.format(active)})")
        scope.say(f"before = xm[{at[a.positions[-1]]}]")
        for column, tau in zip(a.positions, a.lags, strict=True):
            scope.say(
                f"xm[{at[column]}] = approach(xm[{at[column]}], go, {self._share(tau)})", f"go = xm[{at[column]}]"
            )
        scope.say(f"xm[{at[f'{a.name}_rate']}] = abs(go - before)", f"xm[{at[f'{a.name}_travel']}] += abs(go - before)")
        return scope

    def _share(self, tau: Term) -> str:
        """Share of its way that a lag goes in a tick: a number of the member."""
        return self._member.kept(Term("share", (tau,)), f"lag_share({self._member.name(tau)}, {self._tick})")

    def _disturb(self, d: Disturbance, scope: Scope) -> None:
        mean = self._member.name(Term(Leaf.PARAMETER, value=d.name))
        now, sd = f"xm[{self._at[str(d.now.value)]}]", None if d.sd is None else scope.name(d.sd)
        noise = "" if sd is None else f"xm[{self._at[d.coloured]}]"
        if sd is None:
            scope.say(f"{now} = {mean}")
        else:
            share = "1.0" if d.tau is None else self._share(maximum(d.tau, 1e-6))
            now_tick = f"math.floor(t / {self._tick} + 0.5)"
            scope.say(f"{noise} = coloured({noise}, {share}, loud, seed, {now_tick}, channel)")
            scope.say(f"{now} = {mean} + {sd} * {noise}")
        if d.measured is not None:
            sensor = self._sheet.sensors[d.measured]
            bias = self._member.name(sensor.bias)
            read = f"um[k, {self._layout.inputs.index(d.reading)}]"
            true = f"{read} / (1.0 + {bias})" if sensor.relative else f"{read} - {bias}"
            scope.say(f"if not math.isnan({read}):", f"    {now} = {true}")
            if sd is not None:
                scope.say(f"    if {sd} > 0.0:", f"        {noise} = ({now} - {mean}) / {sd}")

    def _follow(self, each: Lag | Delay | Hold | Network, scope: Scope) -> None:
        """A lag, or a dead time, by a tick; what is held through it."""
        if isinstance(each, Network):
            self._flow(each, scope)
            return
        value = scope.name(each.of)
        if isinstance(each, Hold):
            scope.say(f"xm[{self._at[each.name]}] = {value}")
            return
        if isinstance(each, Lag):
            own = f"xm[{self._at[each.name]}]"
            scope.say(f"{own} += {self._share(each.tau)} * ({value} - {own})")
            return
        columns = each.columns(self._layout.tick_s)
        first, last = self._at[columns[0]], self._at[columns[-1]]
        scope.say(f"shifted(xm, {first}, {last}, {value})")

    def _flow(self, network: Network, scope: Scope) -> None:
        """Heads and flows of a network, by its solver."""
        at, n = self._layout.rooms[network.name], len(network.branches)
        rows = [each for row in network.numbers() for each in row]
        numbers = [scope.name(each) if isinstance(each, Term) else repr(each) for each in rows]
        scope.say(*(f"work[{at + i}] = {number}" for i, number in enumerate(numbers)))
        scope.say(f"if not solve_network(work, {at}, {len(network.junctions)}, {n}) <= {ENOUGH!r}:")
        scope.say(f"    broken_at[m] = t + {self._tick}", "    break")
        found = at + len(numbers)
        scope.say(*(f"xm[{self._at[name]}] = work[{found + i}]" for i, name in enumerate(network.columns)))

    def _integrate(self, given: Sequence[str], scope: Scope) -> None:
        """The states over a tick with everything held that is none."""
        columns = [f"xm[{self._at[name]}]" for name in self._sheet.states]
        ys = [f"y{i}" for i in range(len(self._states))] if self._room is None else columns
        parts = scope.name(self._sheet.parts)
        if self._room is None:
            scope.say(*(f"{y} = {column}" for y, column in zip(ys, columns, strict=True)))
            inner = list(runge_kutta(ys, given))
        elif not self._layout.stages:
            inner = list(runge_kutta_in_place(len(ys), self._room, given))
        else:
            inner = list(stabilised_in_place(len(ys), self._room, given, self._layout.stages))
        if self._layout.stages:
            scope.say(*inner)
        elif parts == "1.0":
            scope.say(f"h = {self._tick}", *inner)
        else:
            rounds = f"for _ in range(int({parts})):"
            scope.say(f"h = {self._tick} / {parts}", rounds, *(f"    {line}" for line in inner))
        for y, state in zip(ys, self._sheet.states.values(), strict=True):
            if state.least is not None:
                scope.say(f"{y} = max({y}, {state.least!r})")
        if self._room is None:
            scope.say(*(f"{column} = {y}" for y, column in zip(ys, columns, strict=True)))

    def _show(self, s: Sensor, number: int) -> Iterator[str]:
        """What a transmitter shows at the end of the tick of what is measured as ``number``."""
        bias, sd = self._member.name(s.bias), self._member.name(s.noise)
        true, ideal, shown = (f"xm[{self._at[name]}]" for name in (s.true, s.ideal, s.name))
        off = "" if s.off == ZERO else f" + {self._shown.name(s.off)}"
        yield from self._shown.taken()
        yield f"{true} = q{number}"
        yield f"{ideal} = {true} * (1.0 + {bias}){off}" if s.relative else f"{ideal} = {true} + {bias}{off}"
        every = max(round(s.every_s / self._layout.tick_s), 1)
        drawn = f"{sd}, noisy, seed, tick, channel, {every}, {s.relative}"
        yield "channel += 1"
        yield f"{shown} = sensed({shown}, {ideal}, {drawn})"
        if s.step > 0.0:
            yield f"{shown} = {s.step!r} * math.floor({shown} / {s.step!r} + 0.5)"
