"""Every command with its arguments."""

import argparse

from homeostat import __version__
from homeostat.cli.options import plants, records, running
from homeostat.cli.options.arguments import Parser

ENDING = """\
exit status:
  0  done; a run: the plant recovered, or was rightly left alone
  1  a problem was found (graph check, plant verify, trace verify, replay), there was nothing to show (prompt), or
     runs of a campaign could not be carried out; or an error of the program itself; a run: its result could not be
     stored, a full disk for example
  2  the command cannot be carried out as given; one line on standard error says why
  3  a run: the plant is held, or the fallback acted; an order to a run: refused by its guard; trace verify: nobody
     signed the run, which is in the format from before signatures
  4  a run: something was done without need, or a fault that violates a limit was not detected
  5  a run: a hard limit was violated that could have been kept, or is violated at the end
  130  interrupted with Ctrl-C; the trace of the run is closed
"""


def parser() -> Parser:
    """The parser of the whole command line; a parsed command has the name of its function in ``carry_out``."""
    top = Parser(
        prog="homeostat",
        description="Closed-loop fault recovery for process plants: propose, try on the twin, judge, release.",
        epilog=ENDING,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    top.add_argument("--version", action="version", version=f"homeostat {__version__}")
    commands = top.add_subparsers(metavar="COMMAND", required=True)
    running.run(commands)
    records.orders(commands)
    running.campaign(commands)
    running.resume(commands)
    records.replay(commands)
    running.prompt(commands)
    plants.cases(commands)
    traces = commands.add_parser("trace", help="work with recorded runs").add_subparsers(metavar="WHAT", required=True)
    records.trace_verify(traces)
    graph = commands.add_parser("graph", help="work with a plant's knowledge graph")
    graphs = graph.add_subparsers(metavar="WHAT", required=True)
    plants.graph_check(graphs)
    plants.graph_query(graphs)
    plants.graph_export(graphs)
    plant = commands.add_parser("plant", help="sign a plant's configuration")
    plants.plant(plant.add_subparsers(metavar="WHAT", required=True))
    return top
