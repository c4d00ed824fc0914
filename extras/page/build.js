// Builds the page: node build.js OUTPUT LIBRARY WASM POLICIES FOLDER...
//   OUTPUT    the folder to fill
//   LIBRARY   the folder with the npm package of mjenv
//   WASM      the module with the page's tasks
//   POLICIES  the folder with policies, as text, which are named by their ids
//   FOLDER    has the source of a task: its .xml files are models, and its policy.txt plays the id that it names
// The page is one script, one style sheet and one script for each policy, so that it also works when it is opened
// from a folder.
import { build } from "esbuild";
import { cp, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const [output, library, wasm, policyFolder, ...taskFolders] = process.argv.slice(2);
const source = fileURLToPath(new URL(".", import.meta.url));
const policies = {}; // texts, by ids
const models = {}; // texts, by the names that tasks give to their models

/** The files in a folder with this ending: pairs of name and text. */
async function read(folder, ending) {
  const names = (await readdir(folder)).filter((name) => name.endsWith(ending));
  return Promise.all(names.map(async (name) => [name, await readFile(join(folder, name), "utf8")]));
}

// dm_control's ids begin with "dm_control/", and their policies are in a folder of that name.
for (const group of ["", "dm_control/"])
  for (const [name, text] of await read(join(policyFolder, group), ".txt"))
    policies[group + name.slice(0, -".txt".length)] = text;
for (const folder of taskFolders) {
  for (const [name, text] of await read(folder, ".xml")) {
    if (`./${name}` in models) throw new Error(`two folders of tasks have a model called ${name}`);
    models[`./${name}`] = text;
  }
  for (const [name, text] of await read(folder, ".txt"))
    if (name === "policy.txt") policies[/^id (.*)$/m.exec(text)[1]] = text;
}

await rm(output, { recursive: true, force: true });
await build({
  entryPoints: { page: join(source, "src/main.ts") },
  outdir: output,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  alias: { mjenv: join(library, "src/index.js"), "mjenv-play.wasm": wasm },
  define: {
    POLICIES: JSON.stringify(Object.keys(policies)),
    MODELS: JSON.stringify(models),
    "import.meta.url": "document.baseURI",
  },
  external: ["node:*"], // what the module uses in Node.js
  loader: { ".wasm": "binary" },
  logLevel: "warning",
});
for (const [id, text] of Object.entries(policies)) {
  const file = join(output, "policies", `${id}.js`);
  await mkdir(dirname(file), { recursive: true });
  await writeFile(file, `mjenvPolicies[${JSON.stringify(id)}] = ${JSON.stringify(text)};\n`);
}
await cp(join(source, "index.html"), join(output, "index.html"));

// The licences of what the page is made of
const licenses = join(output, "licenses");
await cp(join(library, "licenses"), licenses, { recursive: true });
await cp(join(library, "LICENSE"), join(licenses, "LICENSE.mjenv"));
await cp(join(library, "THIRD_PARTY_NOTICES.md"), join(licenses, "THIRD_PARTY_NOTICES.txt")); // .md is a page of the site
for (const name of ["three", "uplot"])
  await cp(join(source, "node_modules", name, "LICENSE"), join(licenses, `LICENSE.${name}`));
