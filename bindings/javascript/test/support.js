// What the tests share. They test the package that bindings/javascript/build makes.

import { readFileSync } from "node:fs";

export const root = new URL("../../../", import.meta.url);
const { load, MjenvError, ALL_ROWS, DIVERGED, Env } = await import(
  new URL("build/javascript/package/src/index.js", root)
);
export { load, MjenvError, ALL_ROWS, DIVERGED, Env };

export const mjenv = await load();

/** Calls `use` with an environment, and frees it. */
export function withEnv(id, settings, use) {
  const env = mjenv.make(id, settings);
  try {
    return use(env);
  } finally {
    env.free();
  }
}

/** The recorded episodes of a folder, on a CPU with FMA, which portable math gives everywhere. */
export function expectedEpisodes(folder = "tests/golden") {
  const text = readFileSync(new URL(`${folder}/fma/episodes.txt`, root), "utf8");
  const lines = text.split("\n").filter((line) => line && !line.startsWith("#"));
  return lines.map((line) => {
    const [id, norm, steps, total, checksum] = line.split(" ");
    return { id, norm, steps: Number(steps), total: hexadecimal(total), checksum };
  });
}

/** The number that C's %a writes. */
export function hexadecimal(text) {
  const [, sign, whole, fraction, exponent] = /^(-?)0x(\d)\.?([0-9a-f]*)p([+-]\d+)$/.exec(text);
  const digits = Number(BigInt(`0x${whole}${fraction}`));
  return (sign ? -1 : 1) * digits * 2 ** (Number(exponent) - 4 * fraction.length);
}

/** The error of a call that must fail. */
export function refusal(call) {
  try {
    call();
  } catch (error) {
    if (error instanceof MjenvError) return error;
    throw error;
  }
  throw new Error("the call was not refused");
}
