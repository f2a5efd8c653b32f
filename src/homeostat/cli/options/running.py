"""Commands that carry runs out: run, resume, prompt, campaign."""

from pathlib import Path

from homeostat.cli.options.arguments import Commands, Parser, command, number, whole_number

SEARCH = "search"
"""The proposer that is always there."""
FORMS = (
    "search, openai:MODEL, anthropic:MODEL, ollama:MODEL, http://HOST:PORT/v1#MODEL, replay:FILE, situated:FILE, "
    "scripted:reasonable, scripted:stubborn"
)
_PACE = "process seconds per second"
_NOTE = "a note of the operator to the model"


def run(commands: Commands) -> None:
    """Declare ``homeostat run``."""
    about = "Run one scenario of a plant: with a fault or without, from start-up to the end, with its score."
    ending = "'homeostat cases' lists the plants and their faults."
    made = command(commands, "run", "run:carry_out", "run one scenario and keep it", about, ending)
    add = made.add_argument
    add("case", metavar="CASE", help="name of the plant")
    add("--fault", default="none", metavar="F", help="fault; several joined by '+' (default: none)")
    _truth(made)
    add("--location", metavar="L", help="where the fault is, for faults with several places")
    add("--end", type=number(), metavar="S", help="when the run ends [s of process time]")
    _language(made)
    each = "per-step: agents are asked in every state, a language model for the next step only (default: route)"
    add("--protocol", choices=("route", "per-step"), default="route", help=each)
    add("--label-given", action="store_true", help="tell the agents the true fault, as in studies without detection")
    add("--out", type=Path, metavar="DIR", help="new or empty directory to keep the run in")
    add("--json", action="store_true", help="print the result as one JSON object and nothing else")
    _operation(made)
    add = made.add_mutually_exclusive_group().add_argument
    scale = f"{_PACE} of thinking (default: 1; 0: the plant waits)"
    add("--thinking-scale", type=number(0.0, 1000.0), default=1.0, metavar="K", help=scale)
    declared = "process seconds that each thought takes, whatever it took: equal seeds give equal runs"
    add("--thinking-declared", type=number(0.0, 3600.0), metavar="S", help=declared)


def resume(commands: Commands) -> None:
    """Declare ``homeostat resume``."""
    about = (
        "Go on with a run that was killed: the guard takes mode, latch, sequence, service and open writes "
        "from the journal, and the simulated plant is made again from its seed and what was written to it."
    )
    ending = "Exit status as of 'homeostat run'; 2 where the run is over, or cannot go on."
    add = command(
        commands, "resume", "resume:carry_out", "go on with a run that was killed", about, ending
    ).add_argument
    add("run", type=Path, metavar="RUN", help="run directory")
    add("--case", metavar="PATH", help="folder of the run's plant, where it is not where it was")
    add("--out", type=Path, metavar="DIR", help="go on in a copy, in this new directory")
    add("--pace", type=number(0.1, 1000.0), metavar="K", help=f"{_PACE}, for a paced run (default: as it was)")
    add("--json", action="store_true", help="print the result as one JSON object and nothing else")


def prompt(commands: Commands) -> None:
    """Declare ``homeostat prompt``."""
    about = "Run a scenario, and print a question that a language model is asked in it, with its length."
    made = command(commands, "prompt", "prompt:carry_out", "show what a language model would be asked", about)
    add = made.add_argument
    add("case", metavar="CASE", help="name of the plant")
    agents = ("planning", "action", "reprompting")
    add("--agent", choices=agents, default="action", help="whose question (default: action)")
    add("--fault", metavar="F", help="fault (default: the plant's most frequent one)")
    _truth(made)
    later = "the agent's N-th question: later ones show what was refused (default: 1)"
    add("--number", type=int, default=1, metavar="N", help=later)
    add("--note", action="append", default=[], metavar="TEXT", help=_NOTE)


def campaign(commands: Commands) -> None:
    """Declare ``homeostat campaign``."""
    about = (
        "Run every scenario of a file with every seed, proposer and ablation; keep a dataset and a report. "
        "A campaign that was stopped goes on where it stopped when it is started again."
    )
    made = command(commands, "campaign", "campaign:carry_out", "run a whole study from a file and report it", about)
    made.add_argument("file", type=Path, metavar="FILE.toml", help="the campaign; docs/how-to/run-a-campaign.md")
    made.add_argument("--out", type=Path, metavar="DIR", help="folder of the campaign (default: runs/NAME)")
    where = made.add_mutually_exclusive_group().add_argument
    where("--workers", type=whole_number(1, 1024), metavar="N", help="processes, one core each (default: one per core)")
    where("--cluster", metavar="ADDRESS", help="a running Dask scheduler, tcp://HOST:PORT")
    add = made.add_argument
    more = f"one more proposer, alone, in every scenario: {FORMS}"
    add("--proposer", action="append", default=[], metavar="P", help=more)
    _model(made)
    add("--seeds", type=whole_number(1, 10_000), metavar="N", help="seeds 1 to N of every scenario")
    add("--only", action="append", default=[], metavar="JOB", help="run this job alone and keep it")
    add("--list", action="store_true", help="print the names of the jobs and run nothing")


def _truth(made: Parser) -> None:
    """Options on what truly happens."""
    add = made.add_argument
    add("--seed", type=int, default=1, metavar="N", help="seed of the plant and its noise (default: 1)")
    add("--onset", type=number(), metavar="S", help="when the fault begins [s of process time]")
    add("--severity", type=number(), metavar="X", help="size of the fault, in its unit")


def _language(made: Parser) -> None:
    """Options of commands that may ask a language model."""
    add = made.add_argument
    who = f"who proposes first: {FORMS} (default: search; it follows every other one)"
    add("--proposer", default=SEARCH, metavar="P", help=who)
    _model(made)
    add("--note", action="append", default=[], metavar="TEXT", help=_NOTE)
    add("--record", type=Path, metavar="FILE", help="add every call of the model to FILE (JSON lines)")
    shown = "what the model is shown of the plant: a part of the graph (default), the same facts as text, nothing"
    add("--grounding", choices=("graph", "documents", "none"), help=shown)


def _model(made: Parser) -> None:
    """Options on how a model is asked."""
    add = made.add_argument
    add("--local-only", action="store_true", help="refuse any model that is not on this machine")
    add("--allow-host", action="append", default=[], metavar="HOST", help="with --local-only: a host to allow as well")
    add("--temperature", type=number(0.0, 2.0), metavar="X", help="temperature of the model (default: 0)")
    add("--model-seed", type=int, metavar="N", help="seed of the model's own sampling, if it has one")


def _operation(made: Parser) -> None:
    """Options on how a run is operated: mode, pace and people."""
    add = made.add_argument
    modes = ("observe", "advise", "approve", "closed-loop")
    who = "observe, advise: nobody writes; approve: what is proposed waits for a person (default: closed-loop)"
    add("--mode", choices=modes, default="closed-loop", help=who)
    orders = "the run takes orders meanwhile (default: 10 in mode approve, else as fast as it goes and without orders)"
    add("--pace", type=number(0.1, 1000.0), metavar="K", help=f"{_PACE}; {orders}")
    many = "people who must agree to a reset (default: 1)"
    add("--persons", type=whole_number(1, 9), default=1, metavar="N", help=many)
