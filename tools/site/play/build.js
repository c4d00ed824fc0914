// Builds the page: node build.js OUTPUT POLICIES LIBRARY
//   OUTPUT    the folder to fill
//   POLICIES  the folder with the policies, as text
//   LIBRARY   the folder with the npm package of mjenv, which has the WebAssembly
// The page is one script, one style sheet and one script for each policy, so that it also works when it is opened
// from a folder.
import { build } from "esbuild";
import { cp, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const [output, policies, library] = process.argv.slice(2);
const source = fileURLToPath(new URL(".", import.meta.url));
// dm_control's ids begin with "dm_control/", and their policies are in a folder of that name.
const suite = (await readdir(join(policies, "dm_control"))).map((name) => `dm_control/${name}`);
const ids = [...(await readdir(policies)), ...suite]
  .filter((name) => name.endsWith(".txt"))
  .map((name) => name.slice(0, -".txt".length));

await rm(output, { recursive: true, force: true });
await mkdir(join(output, "policies", "dm_control"), { recursive: true });
await build({
  entryPoints: { page: join(source, "src/main.ts") },
  outdir: output,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  alias: { mjenv: join(library, "src/index.js"), "mjenv-suite.wasm": join(library, "src/mjenv-suite.wasm") },
  define: { POLICIES: JSON.stringify(ids), "import.meta.url": "document.baseURI" },
  external: ["node:*"], // what the module uses in Node.js
  loader: { ".wasm": "binary" },
  logLevel: "warning",
});
for (const id of ids) {
  const text = await readFile(join(policies, `${id}.txt`), "utf8");
  await writeFile(
    join(output, "policies", `${id}.js`),
    `mjenvPolicies[${JSON.stringify(id)}] = ${JSON.stringify(text)};\n`,
  );
}
await cp(join(source, "index.html"), join(output, "index.html"));

// The licences of what the page is made of
const licenses = join(output, "licenses");
await cp(join(library, "licenses"), licenses, { recursive: true });
await cp(join(library, "LICENSE"), join(licenses, "LICENSE.mjenv"));
await cp(join(library, "THIRD_PARTY_NOTICES.md"), join(licenses, "THIRD_PARTY_NOTICES.txt")); // .md is a page of the site
for (const name of ["three", "uplot"])
  await cp(join(source, "node_modules", name, "LICENSE"), join(licenses, `LICENSE.${name}`));
