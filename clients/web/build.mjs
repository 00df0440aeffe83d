// Builds the page: node build.mjs [--out DIR]   (default ../../build/web)
// Runs the unit tests: node build.mjs --tests
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const shared = { bundle: true, format: "esm", target: "es2022", logLevel: "warning", absWorkingDir: here };

async function buildPage(out) {
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  await build({ ...shared, entryPoints: { app: "src/main.ts" }, outdir: out, minify: true, legalComments: "none" });
  for (const name of ["index.html", "favicon.svg"]) copyFileSync(join(here, name), join(out, name));
  writeFileSync(join(out, "licenses.txt"), licenses());
  for (const name of readdirSync(out)) {
    if (!/\.(js|css|html)$/.test(name)) continue;
    const bytes = readFileSync(join(out, name));
    const packed = gzipSync(bytes, { level: 9 });
    writeFileSync(join(out, `${name}.gz`), packed);
    console.log(`${name}: ${bytes.length} bytes, ${packed.length} packed`);
  }
}

/** Of what is bundled: whoever passes the page on has to pass these on as well. */
function licenses() {
  const texts = [];
  for (const name of ["three", "urdf-loader", "uplot"]) {
    const folder = join(here, "node_modules", name);
    const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    const file = ["LICENSE", "LICENSE.md"].map((one) => join(folder, one)).find(existsSync);
    texts.push(`${name} ${version} (${license})\n\n${file === undefined ? "https://www.apache.org/licenses/LICENSE-2.0" : readFileSync(file, "utf8")}`);
  }
  return texts.join("\n----\n\n");
}

async function runTests() {
  const out = mkdtempSync(join(tmpdir(), "exemplar-web-tests-"));
  const tests = readdirSync(join(here, "test")).filter((name) => name.endsWith(".test.ts"));
  try {
    await build({ ...shared, entryPoints: tests.map((name) => join("test", name)), outdir: out, platform: "node", outExtension: { ".js": ".mjs" } });
    execFileSync(process.execPath, ["--test", ...tests.map((name) => join(out, name.replace(/\.ts$/, ".mjs")))], { stdio: "inherit" });
  } finally {
    rmSync(out, { recursive: true, force: true });
  }
}

const words = process.argv.slice(2);
if (words.includes("--tests")) {
  await runTests().catch(() => process.exit(1));
} else {
  const at = words.indexOf("--out");
  await buildPage(at >= 0 && words[at + 1] ? words[at + 1] : join(here, "..", "..", "build", "web"));
}
