"""``homeostat serve``: a simulated plant as an OPC UA server, in real or scaled time."""

import argparse
import asyncio
import sys
from dataclasses import replace

from homeostat.domain.quotation import printable
from homeostat.evaluate.restartable import RestartablePlant
from homeostat.evaluate.scenario import scenario
from homeostat.links.errors import LinkError
from homeostat.links.opcua.extra import need_opcua
from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.credentials import login_from
from homeostat.plants.plant import load_plant
from homeostat.process.batch import ProcessError


def carry_out(options: argparse.Namespace) -> int:
    """Serve until interrupted."""
    need_opcua()
    from homeostat.links.opcua.server.control_system import ControlSystem
    from homeostat.links.opcua.server.endpoint import Serving
    from homeostat.links.opcua.server.engineer import Engineer, Simulated
    from homeostat.links.opcua.server.serve import serve

    pki = None if options.pki is None else Pki(options.pki)
    if pki is not None:
        pki.check()
    elif not options.insecure:
        raise LinkError("no certificate was given: say --pki FOLDER, or --insecure to let anybody read")
    plant = load_plant(options.case)
    chosen = replace(scenario(plant, "none", options.seed), mismatch=options.mismatch)
    made = RestartablePlant(plant, chosen, options.heartbeat)
    link, process = made.begin()
    writables = {tag: rule.automatic for tag, rule in plant.description.writables.items()}
    tick_s = plant.description.timing.tick_s
    control = ControlSystem(link, plant.description.tags_by_name, writables, options.two_step, tick_s)
    made.holds = lambda: control.hold
    nominal = {f.name: f.severity_nominal for f in plant.description.faults}
    engineer = Engineer(control, process, lambda: Simulated(*made.begin()), nominal)
    serving = Serving(
        port=int(options.port),
        host=options.host,
        scale=options.scale,
        pki=pki,
        insecure=options.insecure,
        login=login_from(options.login),
        history=int(options.history),
    )

    def ready(port: int, engineers: int) -> None:
        if options.insecure:
            print("homeostat: INSECURE: anybody who reaches the port reads this plant, unencrypted", file=sys.stderr)
        address = f"opc.tcp://{options.host}:{port}/homeostat/"
        text = f"{plant.name} is served at {address}, {options.scale:g} s per s; engineer at 127.0.0.1:{engineers}"
        print(printable(text), flush=True)

    try:
        asyncio.run(serve(control, engineer, serving, int(options.engineer_port), ready))
    except OSError as taken:
        what = taken.strerror or str(taken)
        raise LinkError(f"the ports cannot be opened: {what}; choose others with --port, --engineer-port") from None
    except ProcessError as broke:
        raise LinkError(f"{plant.name} is served no longer: {broke}") from None
    return 0
