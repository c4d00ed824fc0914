// Each block of JavaScript in the documents runs, and prints what the document says.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { fileURLToPath } from "node:url";

import { root } from "./support.js";

const pages = ["bindings/javascript/README.md", "docs/from-dm_control.md", "docs/start/javascript.md"];
const folder = mkdtempSync(join(tmpdir(), "mjenv-"));
mkdirSync(join(folder, "node_modules"));
symlinkSync(fileURLToPath(new URL("build/javascript/package", root)), join(folder, "node_modules/mjenv"));
after(() => rmSync(folder, { recursive: true }));

for (const page of pages) {
  const text = readFileSync(new URL(page, root), "utf8");
  const blocks = [...text.matchAll(/^```js\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?/gms)];
  test(`${page} has JavaScript`, () => assert.ok(blocks.length > 0));
  blocks.forEach(([, program, output], index) =>
    test(`block ${index + 1} of ${page}`, () => {
      const file = join(folder, `${index}.mjs`);
      writeFileSync(file, program);
      const { status, stdout, stderr } = spawnSync(process.execPath, [file], { encoding: "utf8" });
      assert.equal(status, 0, stderr);
      if (output === undefined) return;
      const wanted = output.split("...").map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
      assert.match(stdout, new RegExp(`^${wanted.join(".*")}$`, "s"));
    }),
  );
}
