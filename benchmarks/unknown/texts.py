"""What the page says in words."""

HEAD = """# What is said of causes that no table names

Made by `python -m benchmarks.unknown` for the sources of `{commit}`. Mismatch of every true plant: `{mismatch}`.
The causes stand in `benchmarks/unknown/causes_*.toml`, each with its class, the component and the balances that it
truly is in, whether the fault list has its equation, and what the instruments cannot tell from it; all of it was
written before anything was judged. Nobody acts in these runs; the diagnosis is asked at the first symptom from the
onset on that the same plant does not raise by itself, and again later. Seeds are 601 and the ones after it; thresholds
and explanations were chosen on smaller ones, in the end on all causes with seeds 401 to 403.

*Wrong*: another item or balance than the true one, at 0.9 or more. *Right*: the name, or an unknown on its balance;
at a look after a disturbance has ended (three of the reactor do), that nothing is wrong any more is right, too, and
that nothing is wrong is so where an input is moved that an instrument measures, or a command that is shown as it
reaches its actuator (`measured` in the table of causes; a bar of its own leaves them out).
*Set*: nothing else is sure, and what lies within 3 nats of the best holds the item. *Noticeable*: with nobody
acting some feature leaves its fault-free 99.9 % band, for 60 s at the reactor, as long as its symptom rules wait at
the module. A noticeable cause without a symptom counts as one of which nothing was said. Every 0.9 is of what is said
about items: the share that is stated for something else makes nothing wrong unsure."""
VERDICTS = """Looks at causes that are in no row of the fault list, those that are not noticeable included. *Alike*:
of the wrong ones, those about what the instruments cannot tell from the truth, as the table of causes said before.
*Right by a fault's name*: the item is right, but the fault of the list that is named is not what happened to it."""
KNOWN_TEXT = """Severity and onset are drawn at random, the severity from the range of the table. Named: by a fault
of the component. The error of the severity is a share of its range, where the fault is named, 120 s after the first
symptom (fouling: 900 s)."""
CALIBRATION = """Every statement of every look, that nothing is wrong included, by its probability; below, the
answer of every look as a set: what lies within 3 nats of the best, by its summed probability. That something else is
wrong is right where nothing else that is said is. Bins begin and end at 0.1, 0.3, 0.5, 0.7 and 0.85; in the diagram
one with fewer than 150 statements is merged with the neighbour that has fewer. The mix: causes that no list names,
those of the generated list among them, known faults, harmless disturbances and fault-free runs.
Looks of one run are not independent of one another. *By part*: what is said with 85 % or more. *Refused*: looks at
known faults at which the best explanation fails the absolute test of fit, so that something else counts as likely as
not: the false alarms of that test.

![How often statements are right, by their probability](../images/unknown.png)"""
SIZES = """Sizes that the best statement of a look says of what is truly there, where its true size is known:
severities of known faults, offsets and factors of transmitters, changes of parameters. An interval reaches two
standard deviations to either side, so that 95 % of them ought to hold the truth. Where one size alone is stated it
counts as an interval that does not hold."""
OPERATION = """Each run with guard and recovery beside the same true plant that is left alone, thinking being
charged 1 s of process time. *Longer outside*: by more than 10 s, in one hard limit. *More lost*: of the production,
where leaving alone keeps every hard limit."""
PAIRS = """Two faults of the tables, severities and onsets drawn at random: every pair of the reactor, random pairs
of two components of the module. Where a run is outside a hard limit after its first symptom or trip, the same true
plant is operated otherwise from that moment on, the cheapest first: left alone, which is local control by its own
recipe; every fallback; whatever was released in the run, at once; then every set of constant setpoints of a grid of
three values and the design value each, or, for a batch, the best route from its start by exhaustive search with the
faults known. A strategy keeps a limit that it is not outside of, or comes back into within 60 s where it was
outside at that moment."""
LABELS = """Monitoring is replaced by a label: from the true onset on, recovery is told with certainty that another
fault of nominal severity is there. The true one has its nominal severity and a random onset. Every fault of the
reactor is given as every other, of the module's a random sample of about a hundred. *Outside*: a hard limit is
violated after the first release. *Caught*: the guard falls back after the release, 10 s after the limit is left at
the latest; the plant ends inside its hard limits, and is outside no more than 10 s longer than if nobody had acted, or
no more than a minute."""
COST = """Processor time; the largest is that of runs with which a process compiles what it needs."""
LIMITATIONS = """- Causes, their truth and what the instruments cannot tell apart were written by those who wrote the
  isolation.
- The true plants depart from the twin's equations by the mismatch and by the cause; what they still share stands in
  `docs/limitations.md`.
- A cause is an item of the tables: two things that act alike on one item are one.
- Looks of one run are not independent, nor are runs of one seed, which are one true plant.
- True sizes are known of what is measured in the unit of the fault alone; a disturbance of a parameter that is named
  as a balance has none, and the size of what answers name beside something else is not judged. A parameter counts
  with its true value, also where the mismatch gives it another law.
- A pair is compared with the strategies that are named, not with every possible one; the best route of a batch knows
  the faults before they begin.
- A fault-free day is one run of the reactor, and 144 batches of the module on as many true plants: its inlet valves
  leak through in the mismatch, so that a module that is left standing for six hours is over a hard limit.
- The bar of 300 harmless runs is met by both plants together."""
