// Plays three seeded episodes of each id.
//
//     node episodes.js [--norm plain|fused] MODULE ID...
//
// MODULE is the package's index.js. Prints ID, steps, return, steps per second and a checksum over every bit of every
// output, separated by tabs.

import { pathToFileURL } from "node:url";

const EPISODES = 3;
const SEED = 42;

/** An FNV-1a hash of 64-bit words, in two halves of 32 bits, because JavaScript multiplies BigInts slowly. */
class Checksum {
  high = 0xcbf29ce4;
  low = 0x84222325;

  word(high, low) {
    // Multiplies by 0x100000001b3, that is 2^40 + 0x1b3.
    const [h, l] = [(this.high ^ high) >>> 0, (this.low ^ low) >>> 0];
    const product = l * 0x1b3;
    this.low = product >>> 0;
    this.high = (Math.imul(h, 0x1b3) + Math.floor(product / 2 ** 32) + (l << 8)) >>> 0;
  }

  numbers(numbers) {
    const words = new Uint32Array(numbers.buffer, numbers.byteOffset, 2 * numbers.length);
    for (let i = 0; i < words.length; i += 2) this.word(words[i + 1], words[i]);
  }

  toString() {
    return [this.high, this.low].map((half) => half.toString(16).padStart(8, "0")).join("");
  }
}

/** Plays episodes of a one-row environment. */
export function play(env) {
  const checksum = new Checksum();
  let [steps, total] = [0, 0];
  env.seedActions(SEED);
  for (let episode = 0; episode < EPISODES; ++episode) {
    env.reset(episode === 0 ? { seed: SEED } : {});
    checksum.numbers(env.observations);
    for (const values of Object.values(env.resetInfo)) checksum.numbers(values);
    do {
      env.step(env.sampleActions());
      checksum.numbers(env.observations);
      checksum.numbers(env.rewards);
      checksum.word(0, env.terminated[0]);
      checksum.word(0, env.truncated[0]);
      for (const values of Object.values(env.info)) checksum.numbers(values);
      total += env.rewards[0];
      ++steps;
    } while (!env.terminated[0] && !env.truncated[0]);
  }
  return { steps, total, checksum: checksum.toString() };
}

async function main(module, norm, ids) {
  const { load } = await import(pathToFileURL(module));
  const mjenv = await load();
  for (const id of ids) {
    const env = mjenv.make(id, { norm });
    const start = performance.now();
    const { steps, total, checksum } = play(env);
    const rate = (1000 * steps) / (performance.now() - start);
    console.log([id, steps, total, rate.toFixed(0), checksum].join("\t"));
    env.free();
  }
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const given = process.argv.slice(2);
  const norm = given[0] === "--norm" ? given.splice(0, 2)[1] : "auto";
  if (given.length < 2) {
    console.error("usage: node episodes.js [--norm plain|fused] MODULE ID...");
    process.exit(2);
  }
  await main(given[0], norm, given.slice(1));
}
