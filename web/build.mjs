// Bundles src/main.js with three.js and uPlot into the script that network.html contains.
// The first comment of the bundle has the hash of all it is made from, and the licences of both;
// tests/dragchain/network_page/test_bundle.py compares that hash with the files here.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

process.chdir(import.meta.dirname);
const target = process.argv[2] ?? "../analysis/dragchain/network_page/network.js";
const own = ["build.mjs", "package.json", "package-lock.json", ...readdirSync("src").map((name) => `src/${name}`)];
const sources = ["../workflow/dragdeck/data/colours.json", ...own];
const hash = createHash("sha256");
for (const name of sources.sort()) hash.update(`${name}\n`).update(readFileSync(name));
const licence = (name) => readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim();

const result = await build({
  absWorkingDir: import.meta.dirname,
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "none",
  charset: "ascii",
  loader: { ".css": "text" },
  write: false,
});
const script = result.outputFiles[0].text;
if (/<\/script|<!--/i.test(script)) throw new Error("the bundle would end the script element that it stands in");
const head = `/*! sources: ${hash.digest("hex")}\nMade by ./run web from web/; do not edit. It contains three.js:\n\n${licence("three")}\n\nand uPlot:\n\n${licence("uplot")}\n*/\n`;
writeFileSync(target, head + script);
console.log(`${target}: ${((head.length + script.length) / 1e3).toFixed(0)} kB`);
