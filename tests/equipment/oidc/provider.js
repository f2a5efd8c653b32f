// A provider of somebody else's making (node oidc-provider, certified), with its own pages to sign in at. Anybody signs in;
// what is before a dot in a name is their group. Arguments: port, redirect address, "stale" for a provider that asks
// nobody again or "", and a file with certificate and key of one that is asked over TLS.
import http from "node:http";
import https from "node:https";
import { readFileSync } from "node:fs";
import { generateKeyPairSync } from "node:crypto";
import Provider from "oidc-provider";

const [port, redirect, kind, pem] = process.argv.slice(2);
const scheme = pem ? "https" : "http";
const key = { ...generateKeyPairSync("rsa", { modulusLength: 2048 }).privateKey.export({ format: "jwk" }), kid: "one", use: "sig", alg: "RS256" };
const renamed = new Map();
const provider = new Provider(`${scheme}://localhost:${port}`, {
  clients: [{ client_id: "homeostat", client_secret: "a secret of the client", redirect_uris: [redirect], response_types: ["code"], grant_types: ["authorization_code"], require_auth_time: true }],
  jwks: { keys: [key] },
  cookies: { keys: ["a key of the test"] },
  conformIdTokenClaims: false,
  claims: { openid: ["sub"], profile: ["preferred_username", "groups"] },
  features: { devInteractions: { enabled: true }, revocation: { enabled: true } },
  findAccount: (_, id) => ({
    accountId: id,
    claims: () => ({ sub: `id-${id}`, preferred_username: renamed.get(id) ?? id.split(".").pop(), groups: [`plant-${id.split(".")[0]}`] }),
  }),
  loadExistingGrant: async (ctx) => {
    const grant = new ctx.oidc.provider.Grant({ clientId: ctx.oidc.client.clientId, accountId: ctx.oidc.session.accountId });
    grant.addOIDCScope(String(ctx.oidc.params.scope));
    await grant.save();
    return grant;
  },
});
const answer = provider.callback();
const answered = (request, response) => {
  const asked = new URL(request.url, "http://x");
  if (asked.pathname === "/rename") { // what an administrator, or somebody themselves, does at a provider
    renamed.set(asked.searchParams.get("id"), asked.searchParams.get("to"));
    response.end();
    return;
  }
  if (kind === "stale" && asked.pathname === "/auth") { // does not do what it is asked: whoever is signed in is not asked again
    asked.searchParams.delete("prompt");
    asked.searchParams.delete("max_age");
    request.url = asked.pathname + asked.search;
  }
  answer(request, response);
};
const server = pem ? https.createServer({ cert: readFileSync(pem), key: readFileSync(pem) }, answered) : http.createServer(answered);
server.listen(Number(port), "127.0.0.1", () => console.log("ready"));
