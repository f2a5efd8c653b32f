// Builds the page into the folder that the first argument names: document, script, style sheet, and whose work is in it.
import { readFile, writeFile, copyFile, mkdir } from "node:fs/promises";
import { build } from "esbuild";

const into = process.argv[2];
const bundled = ["preact", "uplot"];
await mkdir(into, { recursive: true });
await build({
  entryPoints: { console: "src/main.tsx" },
  outdir: into,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  jsx: "automatic",
  jsxImportSource: "preact",
  legalComments: "none",
  charset: "ascii",
  logLevel: "warning",
});
await copyFile("src/index.html", `${into}/index.html`);
const texts = bundled.map(async (name) => {
  const { version } = JSON.parse(await readFile(`node_modules/${name}/package.json`, "utf8"));
  return `${name} ${version}\n\n${(await readFile(`node_modules/${name}/LICENSE`, "utf8")).trim()}\n`;
});
await writeFile(`${into}/LICENSES.txt`, (await Promise.all(texts)).join("\n\n"));
