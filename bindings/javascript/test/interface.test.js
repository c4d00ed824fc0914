// What the package offers: descriptions, rows, state, views, errors and memory.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { ALL_ROWS, DIVERGED, load, mjenv, MjenvError, refusal, root, withEnv } from "./support.js";

test("the version is that of CMakeLists.txt", () => {
  const [, version] = /project\(mjenv VERSION (\S+)/.exec(readFileSync(new URL("CMakeLists.txt", root), "utf8"));
  assert.equal(mjenv.version(), `${version} (MuJoCo 2.2.2, portable math)`);
});

test("options have Gymnasium's defaults", () => {
  const options = Object.fromEntries(mjenv.options("Ant-v5").map((option) => [option.name, option]));
  assert.equal(options.ctrl_cost_weight.default, 0.5);
  assert.equal(options.ctrl_cost_weight.type, "reals");
  assert.deepEqual(options.healthy_z_range.default, [0.2, 1.0]);
  assert.equal(options.healthy_z_range.count, 2);
  assert.equal(options.terminate_when_unhealthy.default, true);
  assert.equal(options.terminate_when_unhealthy.type, "flag");
  assert.equal(options.frame_skip.default, 5);
  assert.equal(options.frame_skip.min, 1);
  assert.equal(options.main_body.type, "string or integer");
  assert.equal(options.main_body.default, 1);
  assert.deepEqual(options.autoreset_mode.choices, ["disabled", "next_step", "same_step"]);
  assert.match(options.ctrl_cost_weight.doc, /\w/);
});

test("a spec has what Gymnasium registers, and the model", () => {
  const spec = mjenv.spec("Reacher-v4");
  assert.deepEqual(
    [spec.id, spec.robot, spec.version, spec.maxEpisodeSteps, spec.rewardThreshold],
    ["Reacher-v4", "Reacher", 4, 50, -3.75],
  );
  assert.equal(mjenv.spec("Humanoid-v5").rewardThreshold, null);
  assert.deepEqual(mjenv.spec("Humanoid-v5").camera.lookat, [0, 0, 2]);
  assert.equal(mjenv.spec("Humanoid-v5").camera.trackbodyid, 1);
  assert.equal(mjenv.spec("Swimmer-v5").camera.trackbodyid, -2);
  assert.ok(Number.isNaN(mjenv.spec("Swimmer-v5").camera.distance));
  assert.equal(mjenv.spec("Ant-v5").modelXml, readFileSync(new URL("assets/ant.xml", root), "utf8"));
});

test("a history stacks observations", () =>
  withEnv("HalfCheetah-v5", { history: 3 }, (env) => {
    assert.deepEqual([env.observationSize, env.observationShape], [51, [3, 17]]);
  }));

test("an observation is read by term", () =>
  withEnv("HalfCheetah-v5", { observation: "dict", numEnvs: 2 }, (env) => {
    assert.deepEqual(
      env.fields("groups").map(({ name, offset, count }) => [name, offset, count]),
      [
        ["qpos", 0, 8],
        ["qvel", 8, 9],
      ],
    );
    env.reset({ seed: 1 });
    const { qpos, qvel } = env.groups(1);
    assert.deepEqual([...qpos, ...qvel], [...env.observations.subarray(17)]);
    assert.throws(() => env.groups(2), { message: /row 2 is outside 0\.\.1/ });
    withEnv("HalfCheetah-v5", {}, (flat) => assert.deepEqual(flat.groups(), {}));
  }));

test("WebAssembly has no lanes, so no stage is in them", () =>
  withEnv("Hopper-v5", { numEnvs: 4 }, (env) => assert.deepEqual(env.laneStages(), {})));

test("an environment describes itself", () =>
  withEnv("HalfCheetah-v5", { forward_reward_weight: 2 }, (env) => {
    assert.deepEqual([env.numEnvs, env.observationSize, env.actionSize, env.frameSkip], [1, 17, 6, 5]);
    assert.deepEqual(env.observationShape, [17]);
    assert.equal(env.timestep, 0.01);
    assert.equal(env.dt, 0.05);
    assert.deepEqual([...env.actionLow, ...env.actionHigh], [-1, -1, -1, -1, -1, -1, 1, 1, 1, 1, 1, 1]);
    assert.ok(env.observationHigh.every((bound) => bound === Infinity));
    assert.equal(env.options.forward_reward_weight, 2);
    assert.deepEqual(
      env.fields("observation").map(({ name, shape, dtype }) => [name, shape, dtype]),
      [
        ["qpos", [8], "float64"],
        ["qvel", [9], "float64"],
      ],
    );
    assert.deepEqual(Object.keys(env.info), ["x_position", "x_velocity", "reward_forward", "reward_ctrl"]);
  }));

test("options of every kind can be set", () => {
  const options = { main_body: "torso", healthy_z_range: [0.3, 0.9], terminate_when_unhealthy: false, frame_skip: 2 };
  withEnv("Ant-v5", options, (env) => {
    for (const [name, value] of Object.entries(options)) assert.deepEqual(env.options[name], value);
  });
  withEnv("Ant-v5", { healthy_z_range: Float32Array.of(0.5, 1) }, (env) =>
    assert.deepEqual(env.options.healthy_z_range, [0.5, 1]),
  );
});

test("the model can be drawn from what read gives", () =>
  withEnv("Humanoid-v5", { seed: 1 }, (env) => {
    env.reset();
    const [geoms] = env.read("ngeom");
    const names = env.objectNames("geom");
    assert.equal(names.length, geoms);
    assert.equal(names[0], "floor");
    for (const [array, width] of Object.entries({ geom_type: 1, geom_size: 3, geom_rgba: 4, geom_group: 1 }))
      assert.equal(env.read(array).length, width * geoms);
    const torso = env.objectIndex("geom", "torso1");
    assert.deepEqual(env.read("geom_bodyid")[torso], env.objectIndex("body", "torso"));
    const rotation = env.read("geom_xmat").subarray(9 * torso, 9 * torso + 9);
    // Its rows have the length 1.
    for (const row of [0, 3, 6]) assert.ok(Math.abs(Math.hypot(...rotation.subarray(row, row + 3)) - 1) < 1e-12);
    assert.equal(env.read("geom_xpos").length, 3 * geoms);
    const model = Object.fromEntries(env.fields("model").map((field) => [field.name, field]));
    assert.deepEqual(model.jnt_range.shape, [env.read("njnt")[0], 2]);
  }));

test("a force pulls a body until it is taken away", () =>
  withEnv("Hopper-v5", {}, (env) => {
    const force = new Float64Array(6 * env.read("nbody")[0]);
    force[6 * env.objectIndex("body", "torso") + 2] = 200; // N, upwards
    const heights = [0, 1].map((pulled) => {
      env.reset({ seed: 3 });
      if (pulled) env.write("xfrc_applied", force);
      for (let i = 0; i < 5; ++i) env.step(new Float64Array(3));
      return env.observations[0];
    });
    assert.ok(heights[1] > heights[0]);
    env.reset();
    assert.ok(env.read("xfrc_applied").every((value) => value === 0));
  }));

test("rows are independent of each other, and equal single environments", () =>
  withEnv("Walker2d-v5", { numEnvs: 3, seed: 5 }, (envs) => {
    envs.reset();
    envs.seedActions(1);
    const actions = envs.sampleActions();
    envs.step(actions);
    for (let row = 0; row < 3; ++row)
      withEnv("Walker2d-v5", { seed: 5 + row }, (env) => {
        env.reset();
        env.step(actions.subarray(6 * row, 6 * row + 6));
        assert.deepEqual(envs.observations.slice(17 * row, 17 * row + 17), env.observations);
        assert.equal(envs.rewards[row], env.rewards[0]);
        assert.equal(envs.info.x_position[row], env.info.x_position[0]);
      });
    const before = envs.observations.slice();
    envs.step(actions, { mask: [false, true, false] });
    assert.deepEqual(envs.observations.slice(0, 17), before.slice(0, 17));
    assert.notDeepEqual(envs.observations.slice(17, 34), before.slice(17, 34));
    envs.reset({ seed: [null, 9, 9], mask: [0, 1, 1] });
    assert.deepEqual(envs.observations.slice(17, 34), envs.observations.slice(34));
    assert.deepEqual([...envs.wasReset], [0, 1, 1]);
    envs.copyRow(0, { mask: Uint8Array.of(0, 0, 1) });
    envs.observe();
    assert.deepEqual(envs.observations.slice(34), envs.observations.slice(0, 17));
    assert.notDeepEqual(envs.observations.slice(17, 34), envs.observations.slice(0, 17));
    envs.copyRow(0);
    envs.observe();
    assert.deepEqual(envs.observations.slice(17, 34), envs.observations.slice(0, 17));
  }));

test("seeds of any size", () => {
  const first = (seed) =>
    withEnv("Ant-v5", {}, (env) => {
      env.reset({ seed });
      return env.observations.slice();
    });
  assert.deepEqual(first(7), first(7n));
  assert.notDeepEqual(first(2n ** 64n), first(0n));
  assert.notDeepEqual(first(2n ** 64n), first(2n ** 64n + 1n));
});

// What NumPy's default_rng(seed).uniform(-0.01, 0.01) gives.
test("rows get seeds of different sizes", () =>
  withEnv("InvertedPendulum-v5", { numEnvs: 4 }, (env) => {
    env.reset({ seed: [2n ** 64n + 1n, 0, 2n ** 130n, 2 ** 53 - 1] });
    const positions = () => [0, 1, 2, 3].map((row) => env.read("qpos", row)[0]);
    const before = positions();
    assert.deepEqual(
      before,
      [0.0038455067294479034, 0.002739233746429086, 0.0030594515156696905, 0.005725362133522297],
    );
    env.seed([null, 7, 7, 7], { mask: [1, 1, 0, 0] });
    env.reset({ mask: [0, 1, 0, 0] });
    assert.deepEqual(positions(), [before[0], 0.002501909332093339, ...before.slice(2)]);
    env.reset({ seed: 7 });
    assert.deepEqual(positions().slice(0, 2), [0.002501909332093339, -0.003460554467888786]);
  }));

test("float32 actions are computed with as such", () => {
  const step = (actions) =>
    withEnv("Pusher-v5", { seed: 0 }, (env) => {
      env.reset();
      env.step(actions);
      return env.rewards[0];
    });
  const actions = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7];
  assert.equal(step(actions), step(Float64Array.from(actions)));
  assert.notEqual(step(actions), step(Float32Array.from(actions)));
});

test("a snapshot continues in the same bits, in another instance too", async () => {
  const other = await load();
  withEnv("Humanoid-v5", { seed: 8 }, (env) => {
    env.reset();
    env.seedActions(2);
    for (let i = 0; i < 5; ++i) env.step(env.sampleActions());
    const image = env.snapshot();
    const actions = env.sampleActions();
    env.step(actions);
    const [observations, reward] = [env.observations.slice(), env.rewards[0]];
    env.restore(image);
    env.step(actions);
    assert.deepEqual(env.observations, observations);
    const elsewhere = other.make("Humanoid-v5", { numEnvs: 2 });
    elsewhere.restore(image, 1);
    elsewhere.restore(image, 0);
    elsewhere.step(Float32Array.of(...actions, ...actions));
    assert.deepEqual(elsewhere.observations.slice(env.observationSize), observations);
    assert.equal(elsewhere.rewards[1], reward);
    assert.deepEqual(elsewhere.snapshot(ALL_ROWS), elsewhere.snapshot(ALL_ROWS));
    elsewhere.free();
  });
});

test("a rollout is the same as steps", () =>
  withEnv("HalfCheetah-v5", { numEnvs: 2, seed: 1 }, (env) => {
    env.reset();
    const image = env.snapshot(ALL_ROWS);
    const actions = Array.from({ length: 2 * 3 * 6 }, (_, index) => Math.sin(index));
    const { observations, rewards, terminated, truncated } = env.rollout(actions, 3);
    assert.deepEqual([...terminated, ...truncated], Array(12).fill(0));
    env.restore(image, ALL_ROWS);
    for (let step = 0; step < 3; ++step) {
      env.step([0, 1].flatMap((row) => actions.slice(6 * (3 * row + step), 6 * (3 * row + step + 1))));
      for (const row of [0, 1]) {
        const at = 3 * row + step;
        assert.deepEqual(observations.slice(17 * at, 17 * at + 17), env.observations.slice(17 * row, 17 * row + 17));
        assert.equal(rewards[at], env.rewards[row]);
      }
    }
  }));

test("episodes end, and are reset as the option says", () => {
  withEnv("Hopper-v5", { max_episode_steps: 2, autoreset_mode: "same_step", seed: 1, arrays: "xpos" }, (env) => {
    env.reset();
    env.step(new Float64Array(3));
    assert.equal(env.wasReset[0], 0);
    env.step(new Float64Array(3));
    assert.deepEqual([env.terminated[0], env.truncated[0], env.wasReset[0]], [0, 1, 1]);
    assert.notDeepEqual(env.finalObservations, env.observations);
    assert.deepEqual(Object.keys(env.finalInfo), Object.keys(env.info));
    assert.deepEqual(env.arrays.xpos, env.read("xpos"));
  });
  withEnv("Hopper-v5", {}, (env) => {
    assert.equal(env.finalObservations.length, 0);
    assert.deepEqual(env.finalInfo, {});
  });
});

test("states and model values can be written", () =>
  withEnv("InvertedPendulum-v5", { numEnvs: 2 }, (env) => {
    env.reset({ seed: 0 });
    env.setState([0.5, 0.1], [0, 1], 1);
    assert.deepEqual([...env.read("qpos", 1), ...env.read("qvel", 1)], [0.5, 0.1, 0, 1]);
    const masses = env.read("body_mass");
    masses[1] *= 2;
    env.write("body_mass", masses);
    env.setConstants();
    for (const row of [0, 1]) assert.deepEqual(env.read("body_mass", row), masses);
  }));

test("rows get the same values or their own, and a mask leaves the others as they are", () =>
  withEnv("InvertedPendulum-v5", { numEnvs: 3, seed: 0 }, (env) => {
    env.reset();
    const of = (name) => [0, 1, 2].map((row) => Array.from(env.read(name, row)));
    env.write("ctrl", [0.5], { mask: [1, 0, 1] });
    assert.deepEqual(of("ctrl"), [[0.5], [0], [0.5]]);
    env.write("ctrl", [1, 2, 3]);
    assert.deepEqual(of("ctrl"), [[1], [2], [3]]);
    // The values of a row outside of the mask are not read.
    env.write("qvel", [1, 2, NaN, NaN, 5, 6], { mask: [1, 0, 1] });
    assert.deepEqual(of("qvel")[0], [1, 2]);
    assert.ok(of("qvel")[1].every(Number.isFinite));
    assert.deepEqual(of("qvel")[2], [5, 6]);
    const total = env.read("body_subtreemass")[0];
    const masses = env.read("body_mass").map((mass) => 2 * mass);
    env.write("body_mass", masses);
    env.setConstants({ mask: [0, 1, 0] });
    assert.deepEqual(
      of("body_subtreemass").map(([all]) => all),
      [total, 2 * total, total],
    );
  }));

// A million steps of 4300 numbers have more bytes than 32 bits can count.
test("a delay that needs more memory than there is", () => {
  const body = "<body><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><joint type='slide'/></body>".repeat(2150);
  const xml = `<mujoco><compiler inertiafromgeom='false'/><worldbody>${body}</worldbody></mujoco>`;
  withEnv("Model-v0", { xml_string: xml, trust_xml: "yes" }, (env) => {
    env.reset();
    const error = refusal(() => env.randomize({ delay: { observation: 1_000_000 } }));
    assert.equal(error.code, "MJENV_E_MEMORY");
    assert.match(error.message, /noise, delays or pushes need 34401 MB/);
    env.randomize({ delay: { observation: 1 } });
    env.reset();
  });
});

test("resets draw what randomize says, with noise, delays and pushes", () =>
  withEnv("Ant-v5", {}, (env) => {
    const [mass] = env.read("body_mass").slice(1);
    env.randomize({
      randomize: {
        body_mass: { kind: "scale", low: 2, high: 3, body: "torso", set_constants: true },
        "opt.gravity": { choices: [-5], elements: 2 },
      },
    });
    env.reset({ seed: 0 });
    assert.ok(env.read("body_mass")[1] >= 2 * mass && env.read("body_mass")[1] <= 3 * mass);
    assert.equal(env.read("opt.gravity")[2], -5);
    const noise = { action: 0.1, observation: Array(105).fill(0.5) };
    const [strong, fast] = [100, 5].map((x) => [[x, x], [0, 0], [0, 0]]); // prettier-ignore
    const force = { body: 1, every: 1, force: strong };
    env.randomize({ randomize: null, noise, delay: { action: 1 }, push: force });
    env.reset({ seed: 0 });
    env.step(new Float64Array(8));
    assert.equal(env.read("xfrc_applied")[6], 100);
    const speed = env.read("qvel")[0];
    const kick = { body: 1, every: 1, velocity: fast };
    env.randomize({ noise: null, delay: null, push: [kick, { ...force, duration: [2, 3] }] });
    env.reset({ seed: 0 });
    env.step(new Float64Array(8));
    assert.ok(env.read("qvel")[0] > speed + 2);
    env.randomize(JSON.stringify({ noise, delay: { action: 1 }, push: force }));
    env.reset({ seed: 0 });
    env.step(new Float64Array(8));
    assert.notDeepEqual(env.observations.slice(0, 13), env.read("qpos").slice(2));
    assert.deepEqual(JSON.parse(env.randomization), { noise, delay: { action: 1 }, push: force });
    env.randomize(null);
    env.reset({ seed: 0 });
    assert.deepEqual(env.observations.slice(0, 13), env.read("qpos").slice(2));
  }));

test("views follow the memory when it grows", async () => {
  const own = await load();
  const env = own.make("Swimmer-v5", { seed: 1 });
  env.reset();
  const old = env.observations;
  assert.equal(env.observations, old);
  const values = old.slice();
  const large = own.make("Reacher-v5", { numEnvs: 50000 });
  assert.equal(old.length, 0);
  assert.deepEqual(env.observations, values);
  assert.equal(env.info.x_position.length, 1);
  large.reset({ seed: 1 });
  assert.equal(large.observations.length, 50000 * 10);
  assert.ok(large.observations.at(-1) !== 0);
  large.free();
  env.free();
});

/** A library whose memory grows before each allocation, which makes all views of it empty. */
async function growing() {
  const { instantiate } = WebAssembly;
  WebAssembly.instantiate = async (module, imports) => {
    const { exports } = await instantiate(module, imports);
    const malloc = (bytes) => {
      exports.memory.grow(1);
      return exports.malloc(bytes);
    };
    return { exports: { ...exports, malloc } };
  };
  try {
    return await load();
  } finally {
    WebAssembly.instantiate = instantiate;
  }
}

test("views of the memory are arguments as good as copies when it grows", async () => {
  const grows = await growing();
  /** Makes the same calls with views, or with copies, and returns what they have given. */
  const play = (own, given) => {
    const found = [];
    const env = own.make("Hopper-v5", { numEnvs: 3, seed: [1, 2, 3] });
    env.reset();
    env.reset({ seed: [4, 5, 6], mask: given(env.wasReset) });
    found.push(env.observations.slice());
    env.step(given(env.observations.subarray(0, 9)), { mask: given(env.wasReset) });
    env.seed([7, 8, 9], { mask: given(env.wasReset) });
    env.reset({ mask: given(env.wasReset) });
    found.push(env.observations.slice());
    found.push(env.rollout(given(env.observations.subarray(0, 18)), 2).observations);
    env.reset({ seed: 0 });
    env.setState(given(env.observations.subarray(0, 6)), given(env.observations.subarray(6, 12)), 1);
    env.write("qpos", given(env.observations.subarray(12, 18)), { mask: given(env.wasReset) });
    env.setConstants({ mask: given(env.truncated) });
    env.copyRow(1, { mask: given(env.truncated) });
    env.observe();
    found.push(env.observations.slice());
    const noise = given(env.observations.subarray(0, 1));
    const force = Array.from(given(env.observations.subarray(11, 14)), (x) => [x, x]);
    env.randomize({
      randomize: { "opt.gravity": { choices: noise, elements: given(env.wasReset.subarray(0, 1)) } },
      noise: { action: noise, observation: noise },
      push: { body: 1, every: 1, force },
    });
    env.reset();
    found.push(env.observations.slice(), env.read("opt.gravity", 2));
    const other = own.make("Hopper-v5", { healthy_z_range: given(env.observations.subarray(0, 2)).sort() });
    found.push(other.options.healthy_z_range);
    assert.throws(() => other.restore(given(env.wasReset)), { code: "MJENV_E_SNAPSHOT" });
    env.free();
    other.free();
    return found;
  };
  const views = play(grows, (view) => view);
  const copies = play(mjenv, (view) => view.slice());
  assert.deepEqual(views, copies);
});

test("sizes and numbers beyond those of WebAssembly are refused, and do not wrap", () =>
  withEnv("Humanoid-v5", { numEnvs: 2, seed: 1 }, (env) => {
    const refused = (call, code, text) => {
      const error = refusal(call);
      assert.equal(error.code, code);
      assert.match(error.message, text);
    };
    env.reset();
    // 8 * 1542766 * 348 is 2^32 + 93248.
    const steps = 1542766 / 2;
    refused(() => env.rollout(new Float32Array(2 * steps * 17), steps), "MJENV_E_MEMORY", /4295060544 bytes/);
    refused(() => mjenv.make("Ant-v5", { numEnvs: 2n ** 64n + 3n }), "MJENV_E_VALUE", /numEnvs.*64 bits/);
    refused(() => env.read("qpos", 2n ** 64n), "MJENV_E_VALUE", /row.*64 bits/);
    refused(() => env.rollout(new Float32Array(34), 2n ** 64n + 1n), "MJENV_E_VALUE", /steps.*64 bits/);
    refused(() => env.rollout(new Float32Array(34), 2 ** 53 - 1), "MJENV_E_SIZE", /34/);
    refused(() => env.step({ length: 2 ** 32 + 34 }), "MJENV_E_SIZE", /4294967330/);
    refused(() => env.step({ length: NaN }), "MJENV_E_SIZE", /NaN/);
    refused(() => env.step("1".repeat(34)), "MJENV_E_TYPE", /actions/);
    refused(() => env.step(new BigInt64Array(34)), "MJENV_E_TYPE", /BigInt/);
    refused(() => env.reset({ mask: { length: 2 ** 32 + 2 } }), "MJENV_E_SIZE", /mask/);
    refused(() => env.randomize({ push: { body: 2 ** 32 + 1 } }), "MJENV_E_VALUE", /push.body: body 4294967297/);
    refused(() => env.randomize('{"delay": {"action": 18446744073709551616}}'), "MJENV_E_TYPE", /delay.action/);
    refused(() => mjenv.make("Ant-v5\0"), "MJENV_E_VALUE", /NUL/);
    env.step(new Float64Array(34));
  }));

test("an environment can be disposed of where the engine has no Symbol.dispose", () => {
  const program = `
    const Old = Symbol;
    globalThis.Symbol = (description) => Old(description);
    for (const [name, property] of Object.entries(Object.getOwnPropertyDescriptors(Old)))
      if (!["length", "name", "dispose"].includes(name)) Object.defineProperty(Symbol, name, property);
    const { load } = await import(${JSON.stringify(new URL("build/javascript/package/src/index.js", root))});
    const env = (await load()).make("Hopper-v5");
    console.log(Symbol.dispose in env, "undefined" in env);
    env[Symbol.dispose]();
    try { env.observations; } catch (error) { console.log(error.message); }`;
  const { stdout, stderr } = spawnSync(process.execPath, ["--input-type=module"], { input: program, encoding: "utf8" });
  assert.match(stdout, /^true false\n.*was freed\n$/, stderr);
});

test("freed environments leave nothing", async () => {
  const own = await load();
  const held = own.make("Hopper-v5");
  // How many bytes the library's memory has after many environments.
  const sizes = [30, 60, 60].map((count) => {
    for (let i = 0; i < count; ++i) {
      const env = own.make("Humanoid-v5", { numEnvs: 8, seed: 1 });
      env.reset();
      env.step(env.sampleActions());
      env.restore(env.snapshot());
      env.read("geom_xpos");
      assert.throws(() => env.write("body_mass", [1]), MjenvError);
      assert.throws(() => own.make("Humanoid-v5", { frame_skip: 0 }), MjenvError);
      env.free();
    }
    return held.observations.buffer.byteLength;
  });
  held.free();
  assert.equal(sizes[1], sizes[0]);
  assert.equal(sizes[2], sizes[0]);
});

test("what is wrong is refused by an error that names it", () =>
  withEnv("Hopper-v5", { numEnvs: 2 }, (env) => {
    const refused = (call, code, text) => {
      const error = refusal(call);
      assert.equal(error.code, code);
      assert.match(error.message, text);
      assert.equal(error.name, "MjenvError");
      assert.ok(error instanceof Error);
    };
    const zeros = new Float64Array(6);
    refused(() => mjenv.make("Ant-v6"), "MJENV_E_NAME", /"Ant-v6".*Ant-v5/);
    refused(() => mjenv.spec("Ant"), "MJENV_E_NAME", /"Ant"/);
    refused(() => mjenv.options(undefined), "MJENV_E_NAME", /"undefined"/);
    refused(() => mjenv.make("Ant-v5", { ctrl_cost: 1 }), "MJENV_E_NAME", /"ctrl_cost".*ctrl_cost_weight/);
    refused(() => mjenv.make("Ant-v5", { ctrl_cost_weight: "much" }), "MJENV_E_TYPE", /ctrl_cost_weight/);
    refused(() => mjenv.make("Ant-v5", { ctrl_cost_weight: null }), "MJENV_E_TYPE", /is null/);
    refused(() => mjenv.make("Ant-v5", { ctrl_cost_weight: NaN }), "MJENV_E_VALUE", /ctrl_cost_weight/);
    refused(() => mjenv.make("Ant-v5", { frame_skip: 2.5 }), "MJENV_E_TYPE", /frame_skip/);
    refused(() => mjenv.make("Ant-v5", { frame_skip: 0 }), "MJENV_E_VALUE", /frame_skip/);
    refused(() => mjenv.make("Ant-v5", { frame_skip: 2n ** 64n }), "MJENV_E_VALUE", /64 bits/);
    refused(() => mjenv.make("Ant-v5", { healthy_z_range: [1] }), "MJENV_E_SIZE", /healthy_z_range/);
    refused(() => mjenv.make("Ant-v5", { autoreset_mode: "now" }), "MJENV_E_VALUE", /next_step/);
    refused(() => mjenv.make("Ant-v5", { numEnvs: 0 }), "MJENV_E_VALUE", /rows/);
    refused(() => mjenv.make("Ant-v5", { numEnvs: 1.5 }), "MJENV_E_VALUE", /1.5/);
    refused(() => mjenv.make("Ant-v5", { numEnvs: 2 ** 40 }), "MJENV_E_MEMORY", /MB/);
    refused(() => mjenv.make("Ant-v5", { numEnvs: 2, num_threads: 2 }), "MJENV_E_VALUE", /num_threads.*threads/);
    refused(() => mjenv.make("Ant-v5", { xml_file: "/ant.xml" }), "MJENV_E_FILE", /ant.xml/);
    refused(() => mjenv.make("Ant-v5", { xml_string: "<mujoco><worldbody><body>" }), "MJENV_E_MODEL", /XML/i);
    refused(() => mjenv.make("Ant-v5", { xml_string: "<mujoco/>" }), "MJENV_E_MODEL", /./);
    const including = "<mujoco><include file='a.xml'/></mujoco>";
    refused(() => mjenv.make("Ant-v5", { xml_string: including }), "MJENV_E_MODEL", /from memory.*trust_xml/);
    refused(() => mjenv.make("Ant-v5", { xml_string: including, trust_xml: true }), "MJENV_E_TYPE", /trust_xml/);
    refused(() => mjenv.make("Model-v0"), "MJENV_E_VALUE", /xml_file/);
    refused(() => env.step(zeros), "MJENV_E_NOT_RESET", /row 0/);
    refused(() => env.reset({ seed: -1 }), "MJENV_E_VALUE", /-1/);
    refused(() => env.reset({ seed: 0.5 }), "MJENV_E_VALUE", /0.5/);
    refused(() => env.reset({ seed: "1" }), "MJENV_E_TYPE", /seed/);
    refused(() => env.reset({ seed: [1] }), "MJENV_E_SIZE", /1 elements.*2 rows/);
    refused(() => env.reset({ mask: [1, 1, 1] }), "MJENV_E_SIZE", /mask has 3/);
    refused(() => env.reset({ sead: 1 }), "MJENV_E_NAME", /"sead"/);
    env.reset({ seed: 0 });
    refused(() => env.step(zeros.subarray(1)), "MJENV_E_SIZE", /5/);
    refused(() => env.step([]), "MJENV_E_SIZE", /0/);
    refused(() => env.step(), "MJENV_E_TYPE", /actions/);
    refused(() => env.step([NaN, 0, 0, 0, 0, 0]), "MJENV_E_VALUE", /nan/i);
    refused(() => env.step([undefined, 0, 0, 0, 0, 0]), "MJENV_E_VALUE", /nan/i);
    refused(() => env.step(Float32Array.of(0, 0, 0, 0, Infinity, 0)), "MJENV_E_VALUE", /inf/);
    refused(() => env.step(zeros, { mask: [1] }), "MJENV_E_SIZE", /mask/);
    refused(() => env.rollout(zeros, 0), "MJENV_E_VALUE", /steps/);
    refused(() => env.rollout(zeros, 2), "MJENV_E_SIZE", /12/);
    refused(() => env.rollout(zeros, -1), "MJENV_E_VALUE", /-1/);
    refused(() => env.read("xposs"), "MJENV_E_NAME", /xposs/);
    refused(() => env.read("xpos", 2), "MJENV_E_VALUE", /row/);
    refused(() => env.read("xpos", "0"), "MJENV_E_VALUE", /row/);
    refused(() => env.write("xpos", zeros), "MJENV_E_NAME", /xpos/);
    refused(() => env.write("qpos", zeros.subarray(1)), "MJENV_E_SIZE", /6/);
    refused(() => env.write("qpos", 1), "MJENV_E_TYPE", /values/);
    refused(() => env.write("qpos", zeros, { mask: [1] }), "MJENV_E_SIZE", /mask/);
    refused(() => env.write("qpos", zeros, { row: 1 }), "MJENV_E_NAME", /write has no setting "row"/);
    refused(() => env.write("body_mass", [0, -1, 1, 1, 1]), "MJENV_E_VALUE", /body_mass/);
    refused(() => env.setConstants({ mask: [1] }), "MJENV_E_SIZE", /mask/);
    refused(() => env.setConstants({ row: 1 }), "MJENV_E_NAME", /setConstants has no setting "row"/);
    refused(() => env.seed(1, [0, 1]), "MJENV_E_NAME", /seed has no setting/);
    refused(() => env.setState([0], zeros), "MJENV_E_SIZE", /nq is 1, not 6/);
    refused(() => env.snapshot(3), "MJENV_E_VALUE", /row/);
    refused(() => env.restore(new Uint8Array(100)), "MJENV_E_SNAPSHOT", /./);
    refused(() => env.restore([1, 2]), "MJENV_E_TYPE", /Uint8Array/);
    refused(() => env.restore(withEnv("Ant-v5", {}, (ant) => ant.snapshot())), "MJENV_E_SNAPSHOT", /another id/);
    refused(() => env.fields("data arrays"), "MJENV_E_NAME", /"observation"/);
    refused(() => env.objectNames("bone"), "MJENV_E_NAME", /bone/);
    refused(() => env.objectIndex("body", "tail"), "MJENV_E_NAME", /tail/);
    refused(() => env.seedActions(2n ** 64n), "MJENV_E_VALUE", /2\^64/);
    refused(() => env.copyRow(0, { mask: [1] }), "MJENV_E_SIZE", /mask/);
    refused(() => env.copyRow(0, [0, 1]), "MJENV_E_NAME", /copyRow has no setting/);
    refused(() => env.copyRow(2), "MJENV_E_VALUE", /2/);
    refused(() => env.randomize({ randomize: { body_mass: { distribution: "even" } } }), "MJENV_E_VALUE", /uniform/);
    refused(() => env.randomize({ noise: { action: -1 } }), "MJENV_E_VALUE", /noise.action/);
    refused(() => env.randomize({ noise: { action: NaN } }), "MJENV_E_TYPE", /noise.action.*NaN/);
    refused(() => env.randomize("{"), "MJENV_E_VALUE", /no JSON/);
    env.step(zeros);
  }));

test("an environment that was freed refuses everything", () => {
  const env = mjenv.make("Hopper-v5", { seed: 1 });
  env.reset();
  env.free();
  env.free();
  for (const use of [
    () => env.observations,
    () => env.info,
    () => env.reset(),
    () => env.step([0, 0, 0]),
    () => env.read("qpos"),
    () => env.snapshot(),
    () => env.fields("data"),
  ]) {
    const error = refusal(use);
    assert.equal(error.code, "MJENV_E_ARGUMENT");
    assert.match(error.message, /Hopper-v5.*freed/);
  }
});

test("an episode that has ended is refused, and a diverged one is told", () => {
  withEnv("Hopper-v5", { max_episode_steps: 1, seed: 1 }, (env) => {
    env.reset();
    env.step([0, 0, 0]);
    assert.equal(refusal(() => env.step([0, 0, 0])).code, "MJENV_E_EPISODE_ENDED");
  });
  withEnv("Ant-v5", { numEnvs: 2, seed: 1 }, (env) => {
    env.reset();
    const force = new Float64Array(6 * env.read("nbody")[0]).fill(1e12);
    env.write("xfrc_applied", force, { mask: [0, 1] });
    env.step(new Float64Array(16));
    assert.deepEqual([...env.statuses], [0, DIVERGED]);
  });
});

test("tasks can be compiled in", async () => {
  const own = await load({ wasm: new URL("build/javascript/mjenv-tasks.wasm", root) });
  assert.equal(own.ids().length, 27);
  const model = readFileSync(new URL("examples/tasks/cartpole/cartpole.xml", root), "utf8");
  const env = own.make("CartpoleSwingup-v0", { xml_string: model, ctrl_cost_weight: 0, seed: 1 });
  env.reset();
  assert.ok(env.observations[1] < -0.99); // the pole hangs
  env.step(env.sampleActions());
  assert.equal(env.rewards[0], env.info.height[0] / 0.6);
  assert.equal(refusal(() => own.make("CartpoleSwingup-v0")).code, "MJENV_E_FILE");
  env.free();
});

test("rewards of goals are those of the steps", async () => {
  const own = await load({ wasm: new URL("build/javascript/mjenv-tasks.wasm", root) });
  const env = own.make("tests/Goal-v0", { observation: "dict", numEnvs: 3, seed: 1 });
  env.reset();
  env.step([]);
  const goals = (name) => [0, 1, 2].flatMap((row) => [...env.groups(row)[name]]);
  const [achieved, desired] = [goals("achieved_goal"), goals("desired_goal")];
  assert.deepEqual(env.computeReward(achieved, desired), env.rewards.slice());
  assert.deepEqual([...env.computeReward([1, 2, 3, 4], [1.5, 2, 3, 2], 2)], [-0.5, -4]);
  assert.equal(refusal(() => env.computeReward([1, 2], [1], 1)).code, "MJENV_E_SIZE");
  assert.equal(refusal(() => env.computeReward([1, 2], [1, 2], 2)).code, "MJENV_E_SIZE");
  assert.equal(refusal(() => env.computeReward([1, 2], [1, 2], -1)).code, "MJENV_E_SIZE");
  assert.match(refusal(() => env.computeReward([1, 2], [10, 2], 1)).message, /the goal is out of reach/);
  env.free();
  withEnv("Hopper-v5", {}, (hopper) =>
    assert.equal(refusal(() => hopper.computeReward([1], [2])).message, "Hopper-v5 has no compute_reward"),
  );
});

test("the module can be given in several ways", async () => {
  const url = new URL("build/javascript/package/src/mjenv.wasm", root);
  const bytes = readFileSync(url);
  for (const wasm of [
    url,
    url.pathname,
    bytes,
    bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length),
    new WebAssembly.Module(bytes),
  ])
    assert.equal((await load({ wasm })).ids().length, 22);
  await assert.rejects(load({ wasm: "/nowhere.wasm" }), { code: "ENOENT" });
});

test("a program computes the outputs of steps and resets", () => {
  const own = { xml_file: "hopper.xml", frame_skip: 4, observations: 11, arrays: "qpos qvel", max_episode_steps: 30 };
  withEnv("Hopper-v5", { numEnvs: 3, seed: [1, 2, 3], history: 2, terminate_when_unhealthy: false }, (builtIn) =>
    withEnv("Batch-v0", { ...own, numEnvs: 3, history: 2 }, (env) => {
      const hopper = () => {
        const { qpos, qvel } = env.arrays;
        const row = (r) => [
          ...qpos.subarray(6 * r + 1, 6 * r + 6),
          ...Array.from(qvel.subarray(6 * r, 6 * r + 6), (v) => Math.min(Math.max(v, -10), 10)),
        ];
        return [0, 1, 2].flatMap(row);
      };
      const states = (array) => [0, 1, 2].flatMap((row) => [...builtIn.read(array, row)]);
      builtIn.reset();
      env.begin({ qpos: states("qpos"), qvel: states("qvel") });
      env.finish({ observations: hopper() });
      for (let step = 0; step < 30; ++step) {
        const actions = Array.from({ length: 9 }, (_, i) => ((7 * i + 3 * step) % 19) / 9 - 1);
        builtIn.step(actions);
        assert.deepEqual([...env.act(actions)], actions);
        env.advance(actions);
        assert.throws(() => env.advance(actions), { code: "MJENV_E_PENDING" });
        assert.throws(() => env.finish({ rewards: [1] }), { code: "MJENV_E_SIZE" });
        env.finish({ observations: hopper(), rewards: [1, 2, 3], terminated: [0, 0, 0] });
        assert.deepEqual([...env.observations], [...builtIn.observations]);
        assert.deepEqual([...env.rewards], [1, 2, 3]);
        assert.deepEqual([...env.truncated], Array(3).fill(step === 29 ? 1 : 0));
      }
      assert.throws(() => builtIn.finish(null), { code: "MJENV_E_TASK" });
      env.begin({ mask: [0, 1, 0] });
      env.finish(null);
    }),
  );
});
