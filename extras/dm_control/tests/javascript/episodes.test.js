// dm_control's suite: every bit of the episodes equals dm_control's.

import assert from "node:assert/strict";
import { test } from "node:test";

import { play } from "../../../../examples/javascript/episodes.js";
import { expectedEpisodes, load, mjenv, refusal, root } from "../../../../bindings/javascript/test/support.js";

const { wasm } = await import(new URL("build/javascript/package/src/dm_control.js", root));
const suite = await load({ wasm });
const expected = expectedEpisodes("extras/dm_control/tests/golden");

test("the module has the suite's ids and the others", () => {
  const ids = suite.ids();
  assert.deepEqual(ids.filter((id) => !id.startsWith("dm_control/")).sort(), mjenv.ids().sort());
  const known = new Set(ids);
  for (const { id } of expected) assert.ok(known.has(id), id);
  assert.equal(ids.length - mjenv.ids().length, 46);
});

test("without the suite, its ids are unknown", () => {
  assert.match(refusal(() => mjenv.make("dm_control/cheetah-run-v0")).message, /its plug-in cannot be loaded/);
});

for (const { id, norm, ...episodes } of expected)
  test(`episodes of ${id}`, () => {
    const env = suite.make(id, { norm, max_episode_steps: 50 });
    // The motors of lqr have no bounds, so its actions were not sampled.
    if (id.startsWith("dm_control/lqr")) env.sampleActions = () => new Float32Array(env.actionSize);
    try {
      assert.deepEqual(play(env), episodes);
    } finally {
      env.free();
    }
  });

test("rows have seeds of their own, and observations have the names of dm_control's terms", () => {
  const env = suite.make("dm_control/walker-walk-v0", { numEnvs: 2, seed: 1 });
  const alone = suite.make("dm_control/walker-walk-v0", { seed: 2 });
  try {
    env.reset();
    alone.reset();
    assert.deepEqual(env.observations.slice(env.observationSize), alone.observations.slice());
    assert.deepEqual(
      env.fields("observation").map(({ name, count }) => [name, count]),
      [
        ["orientations", 14],
        ["height", 1],
        ["velocity", 9],
      ],
    );
  } finally {
    env.free();
    alone.free();
  }
});
