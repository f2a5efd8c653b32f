"""A process module by MTPPy, in a process of its own environment: ``python mtp_module.py PORT CERTIFICATE KEY URI``.

A tank whose level setpoint is an analogue service parameter of VDI/VDE/NAMUR 2658: what is asked for (``VExt``) is
shown as requested (``VReq``) where it lies within its limits, and works (``VOut``) once it is applied. MTPPy 1.1.1 has
no node for the second step, so that the parameter here gets the standard's (``ApplyExt``); the rest is MTPPy's own.
"""

from __future__ import annotations

import sys
import time

from mtppy.attribute import Attribute
from mtppy.indicator_elements import AnaView
from mtppy.opcua_server_pea import OPCUAServerPEA
from mtppy.operation_elements import AnaServParam
from opcua import ua

LOW, HIGH = 2.0, 11.5
"""Limits of the setpoint [L]; ours reach up to 12 L."""


class Setpoint(AnaServParam):
    """The level's setpoint, with the second step of the standard."""

    def __init__(self) -> None:
        super().__init__("L_SP", "level setpoint", LOW, HIGH, LOW, HIGH)
        self._add_attribute(Attribute("ApplyExt", bool, init_value=False, sub_cb=self.apply))

    def apply(self, asked: bool) -> None:
        """What is requested works from now on; the module takes the word back, as the standard has it."""
        if asked:
            self.set_v_out()
            self.attributes["ApplyExt"].set_value(False)


def serve(port: str, certificate: str, key: str, uri: str) -> None:
    module = OPCUAServerPEA(endpoint=f"opc.tcp://127.0.0.1:{port}/homeostat/")
    server = module.get_opcua_server()
    server.set_application_uri(uri)
    server.load_certificate(certificate)
    server.load_private_key(key)
    server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
    setpoint, level = Setpoint(), AnaView("L", "level", 0.0, 14.0)
    for element in (setpoint, level):
        module.add_active_element(element)
    module.run_opcua_server()
    mode = setpoint.op_src_mode.attributes
    mode["StateAutOp"].set_value(True)  # the module's operator gives it to automatic, and that to whoever is outside
    mode["SrcExtOp"].set_value(True)
    print(f"opc.tcp://127.0.0.1:{port}/homeostat/; engineer at 127.0.0.1:0", flush=True)
    while True:
        level.set_v(level.attributes["V"].value * 0.9 + setpoint.get_v_out() * 0.1)
        time.sleep(0.1)


if __name__ == "__main__":
    serve(*sys.argv[1:])
