"""Heads of a network's junctions at which what flows in flows out (compiled).

The heads of the junctions are the unknowns. As every law grows with its difference of heads, the surplus of every
junction is the slope of a concave function of all of them (Collins et al., 1978), which Newton's method with a search
along each step climbs from anywhere: also where several non-return valves begin to pass at the same moment, and
linearised laws would throw the flows from one side to the other for ever.

All numbers lie in one array from ``at`` on: the branches, :data:`COLUMNS` each; heads of the junctions; flows of the
branches; and room for the solver. ``room`` says how much that is.
"""

from homeostat.process.blocks.hydraulics.laws import through_check_valve, through_pipe, through_pump
from homeostat.process.compiled import compiled
from homeostat.process.types import Vec

PIPE, ONE_WAY, PUMP = 0.0, 1.0, 2.0
"""Kinds of branches: both ways, behind a non-return valve, a pump behind one."""
COLUMNS = 9
"""Of a branch: kind; junction at its start and end, -1 where a head is given; these heads [m]; K; a, b, speed."""
STEPS = 200
"""Most Newton steps."""
ENOUGH = 1e-9
"""Largest surplus of a junction with which a network counts as solved [L/s]."""
HALVINGS = 60
"""Most tries along one step."""


def room(junctions: int, branches: int) -> int:
    """How many numbers a network takes."""
    return (COLUMNS + 2) * branches + junctions * (junctions + 4)


@compiled
def surpluses(work: Vec, at: int, junctions: int, branches: int, heads: int, left: int) -> None:
    """Flows at the heads from ``heads`` on, their slopes, and the surplus of every junction [L/s] from ``left`` on."""
    flows = at + COLUMNS * branches + junctions
    for j in range(junctions):
        work[left + j] = 0.0
    for i in range(branches):
        b = at + COLUMNS * i
        start, end = int(work[b + 1]), int(work[b + 2])
        head = work[heads + start] if start >= 0 else work[b + 3]
        head -= work[heads + end] if end >= 0 else work[b + 4]
        if work[b] == PIPE:
            flow, slope = through_pipe(work[b + 5], head)
        elif work[b] == ONE_WAY:
            flow, slope = through_check_valve(work[b + 5], head)
        else:
            flow, slope = through_pump(work[b + 6], work[b + 7], work[b + 5], work[b + 8], head)
        work[flows + i], work[flows + branches + i] = flow, slope
        if start >= 0:
            work[left + start] -= flow
        if end >= 0:
            work[left + end] += flow


@compiled
def newton_step(work: Vec, at: int, junctions: int, branches: int, left: int, step: int) -> None:
    """Change of the heads that closes linearised balances, from ``step`` on; the matrix behind it is used up."""
    slopes, matrix = at + (COLUMNS + 1) * branches + junctions, step + junctions
    for k in range(junctions * junctions):
        work[matrix + k] = 0.0
    for i in range(branches):
        b = at + COLUMNS * i
        start, end, slope = int(work[b + 1]), int(work[b + 2]), work[slopes + i]
        if start >= 0:
            work[matrix + junctions * start + start] += slope
        if end >= 0:
            work[matrix + junctions * end + end] += slope
        if start >= 0 and end >= 0:
            work[matrix + junctions * start + end] -= slope
            work[matrix + junctions * end + start] -= slope
    for j in range(junctions):
        work[step + j] = work[left + j]
    for j in range(junctions):  # elimination needs no exchange of rows: the matrix is positive definite
        for row in range(j + 1, junctions):
            share = work[matrix + junctions * row + j] / work[matrix + junctions * j + j]
            for k in range(j, junctions):
                work[matrix + junctions * row + k] -= share * work[matrix + junctions * j + k]
            work[step + row] -= share * work[step + j]
    for up in range(junctions):
        j = junctions - 1 - up
        for k in range(j + 1, junctions):
            work[step + j] -= work[matrix + junctions * j + k] * work[step + k]
        work[step + j] /= work[matrix + junctions * j + j]


@compiled
def solve_network(work: Vec, at: int, junctions: int, branches: int) -> float:
    """Find heads and flows of the network from ``at`` on; the largest surplus that is left [L/s].

    They stand behind the branches: ``junctions`` heads [m], then ``branches`` flows [L/s].
    """
    heads = at + COLUMNS * branches
    left = heads + junctions + 2 * branches
    tried, step = left + junctions, left + 2 * junctions
    highest = -1e12
    for i in range(branches):
        b = at + COLUMNS * i
        if work[b + 1] < 0.0:
            highest = max(highest, work[b + 3])
        if work[b + 2] < 0.0:
            highest = max(highest, work[b + 4])
    for j in range(junctions):
        work[heads + j] = highest
    surpluses(work, at, junctions, branches, heads, left)
    for _ in range(STEPS):
        newton_step(work, at, junctions, branches, left, step)
        low, share, high = 0.0, 1.0, 1.0
        for _ in range(HALVINGS):
            for j in range(junctions):
                work[tried + j] = work[heads + j] + share * work[step + j]
            surpluses(work, at, junctions, branches, tried, left)
            along = 0.0
            for j in range(junctions):
                along += work[left + j] * work[step + j]
            if (along >= 0.0 and share == 1.0) or high - low < 1e-3 * low:
                break
            if along >= 0.0:
                low = share
            else:
                high = share
            share = 0.5 * (low + high)
        moved, most = 0.0, 0.0
        for j in range(junctions):
            work[heads + j] = work[tried + j]
            moved, most = max(moved, abs(work[step + j])), max(most, abs(work[left + j]))
        if moved < 1e-13 or most < 1e-15:
            break
    worst = 0.0
    for j in range(junctions):
        worst = max(worst, abs(work[left + j]))
    return worst
