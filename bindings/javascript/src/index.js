// Gymnasium's MuJoCo environments in WebAssembly, for Node.js and browsers.
//
//     import { load } from "mjenv";
//     const mjenv = await load();
//     const env = mjenv.make("Ant-v5", { ctrl_cost_weight: 0.1 });
//     env.reset({ seed: 42 });
//     env.step(env.sampleActions());
//     console.log(env.rewards[0], env.info.x_position[0]);
//     env.free();

import { mjenv_spec } from "./abi.js";
import { ALL_ROWS, DIVERGED, Env } from "./env.js";
import { MjenvError } from "./errors.js";
import { Library } from "./library.js";
import { describeOptions, withOptions } from "./options.js";

export { ALL_ROWS, DIVERGED, Env, MjenvError };

/** @typedef {import("./env.js").Field} Field */
/** @typedef {import("./env.js").Fields} Fields */
/** @typedef {import("./env.js").Mask} Mask */
/** @typedef {import("./env.js").Draws} Draws */
/** @typedef {import("./env.js").Seed} Seed */
/** @typedef {import("./env.js").Settings} Settings */
/** @typedef {import("./errors.js").ErrorCode} ErrorCode */
/** @typedef {import("./options.js").Option} Option */
/** @typedef {import("./options.js").OptionValue} OptionValue */

/** @typedef {URL | string | Uint8Array | ArrayBuffer | WebAssembly.Module} Wasm */

/**
 * What Gymnasium registers for an id, and its model.
 *
 * @typedef {object} Spec
 * @property {string} id
 * @property {string} robot the id without its version
 * @property {number} version
 * @property {number} maxEpisodeSteps the default of the option max_episode_steps
 * @property {number | null} rewardThreshold
 * @property {{ distance: number; elevation: number; lookat: number[]; trackbodyid: number }} camera Gymnasium's
 *   default_camera_config; NaN, and -2 as trackbodyid, where Gymnasium leaves the value to MuJoCo
 * @property {string} modelXml the MJCF text of the default model
 */

/** The library: one WebAssembly instance with a memory of its own. */
export class Mjenv {
  #library;

  /** @param {Library} library */
  constructor(library) {
    this.#library = library;
  }

  /** "major.minor.patch (MuJoCo 2.2.2, portable math)" */
  version() {
    return this.#library.text(this.#library.functions.mjenv_version());
  }

  /** All ids. */
  ids() {
    const { functions } = this.#library;
    return Array.from({ length: Number(functions.mjenv_id_count()) }, (_, index) =>
      this.#library.text(functions.mjenv_id_at(BigInt(index))),
    );
  }

  /** Describes an id. @param {string} id @returns {Spec} */
  spec(id) {
    const library = this.#library;
    const spec = library.filled(mjenv_spec, "mjenv_spec_of", String(id));
    return {
      id: library.text(spec.id),
      robot: library.text(spec.robot),
      version: spec.version,
      maxEpisodeSteps: spec.max_episode_steps,
      rewardThreshold: Number.isNaN(spec.reward_threshold) ? null : spec.reward_threshold,
      camera: {
        distance: spec.camera_distance,
        elevation: spec.camera_elevation,
        lookat: spec.camera_lookat,
        trackbodyid: spec.camera_trackbodyid,
      },
      modelXml: library.text(spec.model_xml),
    };
  }

  /** Describes the options that `make` takes for an id. @param {string} id @returns {Option[]} */
  options(id) {
    return withOptions(this.#library, id, (options) => describeOptions(this.#library, options));
  }

  /**
   * Makes an environment.
   *
   * @param {string} id
   * @param {Settings} [settings] how many rows, their seeds, and options by Gymnasium's names
   */
  make(id, settings = {}) {
    return new Env(this.#library, id, settings);
  }
}

/**
 * Loads the library. Each call makes an instance with a memory of its own.
 *
 * @param {object} [settings]
 * @param {Wasm} [settings.wasm] the module, or where it is; if left out, it is mjenv.wasm beside this file
 */
export async function load({ wasm = new URL("./mjenv.wasm", import.meta.url) } = {}) {
  return new Mjenv(await Library.of(await compile(wasm)));
}

/** @param {Wasm} wasm @returns {Promise<WebAssembly.Module>} */
async function compile(wasm) {
  if (wasm instanceof WebAssembly.Module) return wasm;
  if (wasm instanceof ArrayBuffer || ArrayBuffer.isView(wasm))
    return WebAssembly.compile(/** @type {BufferSource} */ (wasm));
  const inNode = typeof process === "object" && Boolean(process.versions?.node);
  const isFile = wasm instanceof URL ? wasm.protocol === "file:" : inNode && !/^[a-z][a-z+.-]+:/i.test(wasm);
  if (inNode && isFile) {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.compile(new Uint8Array(await readFile(wasm)));
  }
  const response = await fetch(wasm);
  if (!response.ok) throw new Error(`${wasm} cannot be fetched: ${response.status} ${response.statusText}`);
  // While it arrives, which needs the right type from the server.
  if (response.headers.get("content-type") === "application/wasm") return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}
