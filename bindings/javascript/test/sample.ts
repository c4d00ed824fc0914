// A program in TypeScript, which tsc checks against the package's declarations. It does not run.

import { ALL_ROWS, DIVERGED, load, MjenvError, type Env, type ErrorCode, type Option, type Spec } from "mjenv";

const mjenv = await load({ wasm: new URL("https://example.org/mjenv.wasm") });
const ids: string[] = mjenv.ids();
const spec: Spec = mjenv.spec(ids[0]);
const options: Option[] = mjenv.options(spec.id);
const bounds: [number, number][] = options.map(({ min, max }) => [min, max]);

using env: Env = mjenv.make("Ant-v5", { numEnvs: 2, seed: [1n, null], ctrl_cost_weight: 0.1 });
env.reset({ seed: 1, mask: [true, false] });
env.step(env.sampleActions());
env.step([0.5, 0.5], { mask: Uint8Array.of(1, 0) });
const rewards: Float64Array = env.rewards;
const flags: Uint8Array = env.truncated;
const speed: Float64Array = env.info["x_velocity"];
const image: Uint8Array = env.snapshot(ALL_ROWS);
env.restore(image, ALL_ROWS);
env.write("xfrc_applied", env.read("xfrc_applied"));
env.write("opt.gravity", [0, 0, -5], { mask: [true, false] });
env.setConstants({ mask: Uint8Array.of(1, 0) });
env.copyRow(0);
const stages: Record<string, string> = env.laneStages();
const hindsight: Float64Array = env.computeReward([1, 2], Float64Array.of(1, 3), 2);
env.seed(3, { mask: [0, 1] });
const diverged: boolean = env.statuses[0] === DIVERGED;
const shapes: number[][] = env.fields("model").map((field) => field.shape);
env.randomize({ randomize: { geom_friction: { low: 0.5, high: 1 } }, noise: { action: 0.1 }, push: null });
env.randomize('{"noise": null}');
try {
  env.free();
} catch (error) {
  if (error instanceof MjenvError && error.code === "MJENV_E_VALUE") console.log(error.status, error.message);
}
const code: ErrorCode = "MJENV_E_NAME";

// @ts-expect-error: there is no such role
env.fields("observations");
// @ts-expect-error: a seed is no text
env.reset({ seed: "1" });
// @ts-expect-error: what the library writes is not set from outside
env.rewards = rewards;
// @ts-expect-error: there is no such code
const wrong: ErrorCode = "MJENV_E_VALUES";
// @ts-expect-error: it is no error
const none: ErrorCode = "MJENV_OK";
// @ts-expect-error: the rows are given as a mask
env.write("qpos", 0, [0]);

console.log(bounds, flags, speed, hindsight, shapes, diverged, code, wrong, none);
