"""A control system with types of its own, in a process: ``python -m tests.equipment.opcua.foreign_server JSON``.

Every node can be written by whoever is trusted, and ``Counter`` goes on ten times per second.
"""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

from asyncua import ua
from asyncua.crypto.truststore import TrustStore
from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
from asyncua.server.server import Server

from homeostat.links.opcua.security.certificate import Pki
from homeostat.links.opcua.security.security import SERVED


async def serve(given: dict[str, Any]) -> None:
    pki, server = Pki(Path(given["pki"])), Server()
    await server.init()
    server.set_endpoint(f"opc.tcp://127.0.0.1:{given.get('port', 0)}/homeostat/")
    await server.set_application_uri(SERVED)
    await server.load_certificate(pki.certificate)
    await server.load_private_key(pki.key)
    trust = TrustStore([pki.trusted], [])
    await trust.load()
    options = CertificateValidatorOptions.TRUSTED_VALIDATION | CertificateValidatorOptions.PEER_CLIENT
    server.set_certificate_validator(CertificateValidator(options, trust))
    server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
    index, nodes = await server.register_namespace("urn:foreign"), {}
    for name, (kind, value) in given["nodes"].items():
        held = ua.LocalizedText(value) if kind == "LocalizedText" else value
        variant = ua.Variant(held, ua.VariantType[kind])
        declared = ua.NodeId(ua.Int32(ua.VariantType[kind].value))
        node = await server.nodes.objects.add_variable(f"ns={index};s={name}", name, variant, datatype=declared)
        await node.set_writable()
        nodes[name] = node
    await server.start()
    listening: Any = server.bserver
    port = listening._server.sockets[0].getsockname()[1]
    print(f"opc.tcp://127.0.0.1:{port}/homeostat/; engineer at 127.0.0.1:0", flush=True)
    kind = ua.VariantType[given["nodes"]["Counter"][0]]
    for count in range(2**30):
        await nodes["Counter"].write_value(ua.Variant(count % 100, kind))
        await asyncio.sleep(0.1)


if __name__ == "__main__":
    asyncio.run(serve(json.loads(sys.argv[1])))
