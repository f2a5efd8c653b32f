// A plant of somebody else's making (node-opcua): a counter, readings, a setpoint that clamps nothing, a node that is read only.
// Usage: node third_party_server.js CERTIFICATE.pem KEY.pem PKI_FOLDER APPLICATION_URI
"use strict";
const { OPCUAServer, OPCUACertificateManager, Variant, DataType, DataValue, StatusCodes, SecurityPolicy, MessageSecurityMode } =
  require("node-opcua");
const [certificateFile, privateKeyFile, rootFolder, applicationUri] = process.argv.slice(2);

async function main() {
  const serverCertificateManager = new OPCUACertificateManager({ rootFolder, automaticallyAcceptUnknownCertificate: true });
  await serverCertificateManager.initialize();
  const server = new OPCUAServer({
    port: 0, host: "127.0.0.1", certificateFile, privateKeyFile, serverCertificateManager, serverInfo: { applicationUri },
    securityPolicies: [SecurityPolicy.Basic256Sha256], securityModes: [MessageSecurityMode.SignAndEncrypt],
    userManager: { isValidUser: (name, password) => name === "operator" && password === "s3cret" },
  });
  await server.initialize();
  const space = server.engine.addressSpace.getOwnNamespace();
  const plant = space.addObject({ organizedBy: server.engine.addressSpace.rootFolder.objects, browseName: "Plant" });
  let count = 0, status = StatusCodes.Good;
  const read = (name, value) => {
    const variable = space.addVariable({
      componentOf: plant, browseName: name, nodeId: `s=${name}`, dataType: "Double", accessLevel: "CurrentRead",
      userAccessLevel: "CurrentRead", minimumSamplingInterval: 20,
    });
    setInterval(() => {
      const shown = name === "T" ? status : StatusCodes.Good;
      variable.setValueFromSource({ dataType: DataType.Double, value: value() }, shown, new Date());
    }, 50);
  };
  read("L", () => 10 + 0.01 * Math.random());
  read("T", () => 300 + 0.01 * Math.random());
  const counter = space.addVariable({
    componentOf: plant, browseName: "Counter", nodeId: "s=Counter", dataType: "UInt32", minimumSamplingInterval: 20,
  });
  setInterval(() => counter.setValueFromSource({ dataType: DataType.UInt32, value: ++count }), 50);
  const setpoint = space.addAnalogDataItem({
    componentOf: plant, browseName: "L.sp", nodeId: "s=L.sp", dataType: "Double", engineeringUnitsRange: { low: 2, high: 12 },
    minimumSamplingInterval: 20,
  });
  setpoint.setValueFromSource({ dataType: DataType.Double, value: 10 });
  const order = space.addVariable({ componentOf: plant, browseName: "Order", nodeId: "s=Order", dataType: "String" });
  order.bindVariable({
    get: () => new Variant({ dataType: DataType.String, value: status.name }),
    set: (variant) => { status = StatusCodes[variant.value]; return StatusCodes.Good; },
  }, true);
  await server.start();
  console.log("READY", server.endpoints[0].port, `ns=${space.index};s=`);
}
main().catch((error) => { console.error(error); process.exit(1); });
