"""A served plant from start to end: endpoint, engineer's port, and the word that both are there."""

import asyncio
from collections.abc import Callable

from homeostat.links.opcua.server.control_system import ControlSystem
from homeostat.links.opcua.server.endpoint import Endpoint, Serving
from homeostat.links.opcua.server.engineer import Engineer, listen


async def serve(
    control: ControlSystem,
    engineer: Engineer,
    serving: Serving,
    engineer_port: int,
    ready: Callable[[int, int], None],
) -> None:
    """Serve until cancelled; ``ready`` is told both ports once they are open. OSError where one is taken."""
    endpoint = Endpoint(control, serving)
    port = await endpoint.start()
    try:
        async with await listen(engineer, engineer_port, endpoint.show) as desk:
            ready(port, int(desk.sockets[0].getsockname()[1]))
            await endpoint.run()
    finally:
        await asyncio.shield(endpoint.stop())
