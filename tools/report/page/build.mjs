// Bundles the page into one HTML file: node build.mjs OUT.html. Scripts and styles are inlined; the
// program puts the data where kDataMark stands.
import { build } from "esbuild";
import { mkdirSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, "report.html");

const result = await build({
  entryPoints: [join(here, "src", "main.ts")],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "eof", // the licences of three and uPlot travel in the file
  loader: { ".css": "css" },
  write: false,
  outdir: "unused",
  logLevel: "warning",
});
const text = (suffix) => result.outputFiles.find((file) => file.path.endsWith(suffix))?.text ?? "";
const script = text(".js").replaceAll("</script", "<\\/script");
const notices = ["three", "uplot"]
  .map((name) => `${name}\n\n${readFileSync(join(here, "node_modules", name, "LICENSE"), "utf8")}`)
  .join("\n\n")
  .replaceAll("--", "- -");
const page = readFileSync(join(here, "src", "index.html"), "utf8")
  .replace("<!--LICENCES-->", () => `<!--\nThis page contains:\n\n${notices}\n-->`)
  .replace("/*STYLE*/", () => text(".css"))
  .replace("/*SCRIPT*/", () => script);
mkdirSync(dirname(out), { recursive: true });
writeFileSync(`${out}.new`, page);
renameSync(`${out}.new`, out); // whole or not at all
console.log(`${out}: ${(page.length / 1024).toFixed(0)} kB`);
