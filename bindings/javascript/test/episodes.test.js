// Every bit of the episodes equals Gymnasium's.

import assert from "node:assert/strict";
import { test } from "node:test";

import { play } from "../../../examples/javascript/episodes.js";
import { expectedEpisodes, mjenv, withEnv } from "./support.js";

const expected = expectedEpisodes();

test("the ids are those of the recordings", () => {
  assert.deepEqual(mjenv.ids().sort(), expected.map(({ id }) => id).sort());
});

for (const { id, norm, ...episodes } of expected)
  test(`episodes of ${id}`, () => withEnv(id, { norm }, (env) => assert.deepEqual(play(env), episodes)));
