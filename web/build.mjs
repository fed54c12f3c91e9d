// Bundles the page into src/spacearm/report/page (or the folder that is given): report.js, report.css, LICENCES.txt.
//
//   npm ci --ignore-scripts && npm run build
//
// The same sources and lock file give the same bytes; tests/web/test_bundle.py compares.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, "..", "src", "spacearm", "report", "page");
mkdirSync(out, { recursive: true });

await build({
  entryPoints: [join(here, "src", "report.ts")],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2020",
  charset: "ascii",
  legalComments: "none",
  outfile: join(out, "report.js"),
});
await build({
  entryPoints: [join(here, "src", "report.css")],
  bundle: true,
  minify: true,
  charset: "ascii",
  legalComments: "none",
  outfile: join(out, "report.css"),
});

const parts = ["three", "uplot"].map((name) => {
  const folder = join(here, "node_modules", name);
  const { version, homepage } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const licence = readFileSync(join(folder, "LICENSE"), "utf8").replaceAll("\r\n", "\n").trim();
  return `${name} ${version} (${homepage})\n\n${licence}\n`;
});
writeFileSync(join(out, "LICENCES.txt"), "report.js and report.css contain these libraries.\n\n" + parts.join("\n----\n\n"));
