// A client of somebody else's making (node-opcua) at a served plant: it reads, takes the lease and writes, in JSON.
// Usage: node third_party_client.js URL CERTIFICATE.pem KEY.pem PKI_FOLDER APPLICATION_URI
"use strict";
const { OPCUAClient, OPCUACertificateManager, DataType, AttributeIds, SecurityPolicy, MessageSecurityMode } = require("node-opcua");
const [url, certificateFile, privateKeyFile, rootFolder, applicationUri] = process.argv.slice(2);

async function main() {
  const clientCertificateManager = new OPCUACertificateManager({ rootFolder, automaticallyAcceptUnknownCertificate: true });
  await clientCertificateManager.initialize();
  const client = OPCUAClient.create({
    securityPolicy: SecurityPolicy.Basic256Sha256, securityMode: MessageSecurityMode.SignAndEncrypt, applicationUri,
    certificateFile, privateKeyFile, clientCertificateManager, endpointMustExist: false,
    connectionStrategy: { maxRetry: 1 },
  });
  await client.connect(url);
  const session = await client.createSession();
  const item = (name, dataType, value) =>
    ({ nodeId: `ns=2;s=${name}`, attributeId: AttributeIds.Value, value: { value: { dataType, value } } });
  const write = async (...items) => (await session.write(items)).map((status) => status.name);
  const found = {};
  found.reading = (await session.read({ nodeId: "ns=2;s=T", attributeId: AttributeIds.Value })).value.value;
  found.without = await write(item("L.sp/Target", DataType.Double, 11));
  found.lease = await write(item("Guard/Lease", DataType.UInt32, 7));
  found.target = await write(
    item("Guard/Lease", DataType.UInt32, 7), item("L.sp/Mode", DataType.Int32, 2), item("L.sp/Target", DataType.Double, 11));
  found.outside = await write(item("Guard/Lease", DataType.UInt32, 7), item("L.sp/Target", DataType.Double, 500));
  found.type = await write(item("Guard/Lease", DataType.UInt32, 7), item("L.sp/Target", DataType.Float, 9));
  found.reader = await write(item("Guard/Lease", DataType.UInt32, 7), item("T", DataType.Double, 9));
  await session.close();
  await client.disconnect();
  console.log(JSON.stringify(found));
}
main().catch((error) => { console.error(error); process.exit(1); });
