// npm install --no-package-lock && npm run build: makes labkit/stage/space.js, and puts the library's licence beside it.
import { createHash } from "node:crypto";
import { build } from "esbuild";
import { copyFileSync, readFileSync, statSync } from "node:fs";

const target = new URL("../../labkit/stage/", import.meta.url);
const library = new URL("node_modules/twgl.js/", import.meta.url);
const sources = createHash("sha256"); // of what it is made of, in the bundle's first line: a test tells a stale one
for (const name of ["build.mjs", "package.json", "renderer.js", "solids.js", "space.js", "world.js"]) {
  sources.update(readFileSync(new URL(name, import.meta.url), "utf8").replaceAll("\r\n", "\n"));
}
const { version } = JSON.parse(readFileSync(new URL("package.json", library)));
await build({
  entryPoints: [new URL("space.js", import.meta.url).pathname],
  outfile: new URL("space.js", target).pathname,
  bundle: true,
  format: "esm",
  minify: true,
  legalComments: "none",
  target: "es2022",
  banner: { js: `// Made of web/space by its build.mjs, with twgl.js ${version} (MIT, see space.LICENSE.txt). Sources: ${sources.digest("hex")}` },
});
copyFileSync(new URL("LICENSE.md", library), new URL("space.LICENSE.txt", target));
console.log(`labkit/stage/space.js: ${(statSync(new URL("space.js", target)).size / 1000).toFixed(1)} kB`);
