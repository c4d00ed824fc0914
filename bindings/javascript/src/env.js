// An environment of one or many rows.

import { Dtype, Role, Status, mjenv_batch, mjenv_field, mjenv_info, mjenv_space } from "./abi.js";
import { bytes, checkLength, doubles, flags, int64, integer, numbers } from "./arguments.js";
import { MjenvError } from "./errors.js";
import { describeOptions, optionValue, setOption, withOptions } from "./options.js";

/** @typedef {import("./library.js").Library} Library */
/** @typedef {import("./library.js").Scratch} Scratch */
/** @typedef {import("./options.js").OptionValue} OptionValue */
/** @typedef {number | bigint} Seed an integer from 0 on, of any size */
/** @typedef {ArrayLike<number | boolean>} Mask one element for each row: whether the call is for it */
/** @typedef {Seed | readonly (Seed | null)[]} Seeds row i gets seed + i; an array has one for each row, or null */
/** @typedef {{ numEnvs?: number; seed?: Seeds; [option: string]: unknown }} Settings */
/** @typedef {Lowercase<keyof typeof Role>} RoleName */
/** @typedef {Readonly<Record<string, Float64Array>>} Fields for each field its numbers: those of row 0, row 1, ... */

/**
 * A part of an observation, an action or an info, or an array of MuJoCo.
 *
 * @typedef {object} Field
 * @property {string} name
 * @property {string} doc the meaning, with its unit; "" if there is none
 * @property {number[]} shape empty for a number
 * @property {number} offset where it begins among the numbers of its role
 * @property {number} count how many numbers it has
 * @property {Lowercase<keyof typeof Dtype>} dtype the type that the values have in Gymnasium
 */

/**
 * Draws, noise, delays and pushes, as docs/randomisation.md describes them: `{ noise: { action: 0.1 } }`. A part that is
 * left out stays, and null removes it.
 *
 * @typedef {object} Draws
 * @property {Record<string, object> | null} [randomize]
 * @property {{ action?: number | number[], observation?: number | number[] } | null} [noise]
 * @property {object | null} [delay]
 * @property {object | readonly object[] | null} [push]
 */

/** @typedef {Float64ArrayConstructor | Float32ArrayConstructor | Uint8ArrayConstructor | Int32ArrayConstructor} View */

// `using` needs this symbol, also as compilers translate it for older engines, but some browsers lack it.
if (!Symbol.dispose) Object.defineProperty(Symbol, "dispose", { value: Symbol.for("Symbol.dispose") });

/** Instead of a row's number: all rows. */
export const ALL_ROWS = -1;

/** In `statuses`: the row's state diverged. */
export const DIVERGED = Status.DIVERGED;

/**
 * @param {Record<string, number>} table of abi.js
 * @param {string} name in lower case
 * @param {string} what
 */
function numberOf(table, name, what) {
  const value = table[String(name).toUpperCase()];
  if (value !== undefined) return value;
  const names = Object.keys(table).map((key) => `"${key.toLowerCase()}"`);
  throw new MjenvError("MJENV_E_NAME", `there is no ${what} "${name}"; there are ${names.join(", ")}`);
}

/**
 * @template {Record<string, number>} Table
 * @param {Table} table of abi.js
 * @param {number} value
 */
function nameOf(table, value) {
  const found = Object.keys(table).find((key) => table[key] === value) ?? String(value);
  return /** @type {Lowercase<keyof Table & string>} */ (found.toLowerCase());
}

/** @param {readonly { count: number }[]} fields */
const sum = (fields) => fields.reduce((total, field) => total + field.count, 0);

/**
 * What the program has computed for all rows, one row after the other: the task's own observations, without time and
 * history; infos field by field, as `fields("info")` lists them.
 *
 * @typedef {object} Computed
 * @property {ArrayLike<number>} [observations]
 * @property {ArrayLike<number>} [rewards]
 * @property {ArrayLike<number>} [terminated] 0 or 1
 * @property {ArrayLike<number>} [infos]
 * @property {ArrayLike<number>} [resetInfos]
 */

/**
 * One or many rows of a robot; a row is one episode. Make it with `mjenv.make`, and `free` it after use: the garbage
 * collector does not know the library's memory.
 */
export class Env {
  #library;
  #handle = 0;
  /** The memory of the batch and of the arrays to which it points. */
  #block = 0;
  #actions = 0;
  #mask = 0;
  /** @type {Map<string, { type: View; pointer: number; length: number }>} */
  #places = new Map();
  /** @type {Map<string, unknown>} */
  #views = new Map();
  /** @type {ArrayBufferLike | undefined} */
  #viewed;
  /** @type {readonly Field[]} */
  #infoFields;
  /** @type {readonly Field[]} */
  #resetInfoFields;
  /** @type {readonly Field[]} */
  #arrayFields;
  /** @type {readonly Field[]} */
  #groupFields;

  /**
   * @param {Library} library
   * @param {string} id
   * @param {Settings} settings
   */
  constructor(library, id, { numEnvs = 1, seed, ...options }) {
    this.#library = library;
    const given = Object.entries(options).filter(([, value]) => value !== undefined);
    const values = given.map(([name, value]) => ({ name, value: optionValue(name, value) }));
    this.#handle = withOptions(library, id, (built) => {
      for (const { name, value } of values) setOption(library, built, name, value);
      return library.scope((scratch) => {
        const created = scratch.allocate(4);
        library.check(library.functions.mjenv_create(built, int64(numEnvs, "numEnvs"), created));
        return library.number(created, "uint32");
      });
    });
    try {
      /** The id. */
      this.id = String(id);
      const info = library.filled(mjenv_info, (pointer) => library.functions.mjenv_info_of(this.#handle, pointer));
      /** How many rows there are. */
      this.numEnvs = info.rows;
      const described = describeOptions(library, library.functions.mjenv_options_of(this.#handle));
      /** The options with which the environment was built. */
      this.options = Object.freeze(Object.fromEntries(described.map((option) => [option.name, option.default])));
      const observation = this.#space(Role.OBSERVATION);
      const action = this.#space(Role.ACTION);
      /** How many numbers the observation of a row has. */
      this.observationSize = observation.low.length;
      /** The length of each of its dimensions: two if the option `history` stacks whole observations, else one. */
      this.observationShape = observation.shape;
      /** The observation's bounds; infinite where it has none. */
      this.observationLow = observation.low;
      this.observationHigh = observation.high;
      /** How many actuators there are. */
      this.actionSize = action.low.length;
      /** The bounds of each actuator. */
      this.actionLow = action.low;
      this.actionHigh = action.high;
      /** How many times a step calls mj_step. */
      this.frameSkip = info.frame_skip;
      /** How many seconds an mj_step takes. */
      this.timestep = this.read("opt.timestep")[0];
      /** How many seconds a step takes. */
      this.dt = this.timestep * this.frameSkip;
      this.#infoFields = this.fields("info");
      this.#resetInfoFields = this.fields("reset_info");
      this.#arrayFields = this.fields("arrays");
      this.#groupFields = this.fields("groups");
      this.#allocate();
      if (seed !== undefined && seed !== null) this.seed(seed);
    } catch (error) {
      this.free();
      throw error;
    }
  }

  /**
   * How lanes compute each stage of a step: "lanes", "row by row: WHY", "lanes; row by row: WHAT" or "absent". Empty if
   * the library has no lanes.
   *
   * @returns {Record<string, string>}
   */
  laneStages() {
    const text = this.#library.functions.mjenv_lane_stages_of(this.#open);
    if (text === 0) this.#library.check(Status.E_BUSY);
    const lines = this.#library.text(text).split("\n").filter(Boolean);
    return Object.fromEntries(lines.map((line) => line.split(/: (.*)/, 2)));
  }

  /** The handle of the open environment. */
  get #open() {
    if (this.#handle === 0) throw new MjenvError("MJENV_E_ARGUMENT", `this environment (${this.id}) was freed`);
    return this.#handle;
  }

  #allocate() {
    const rows = this.numEnvs;
    const info = sum(this.#infoFields);
    const resetInfo = sum(this.#resetInfoFields);
    const arrays = sum(this.#arrayFields);
    const keepsFinal = this.options["autoreset_mode"] === "same_step" ? 1 : 0;
    /** @type {[string, View, number][]} */
    const wanted = [
      ["obs", Float64Array, rows * this.observationSize],
      ["reward", Float64Array, rows],
      ["terminated", Uint8Array, rows],
      ["truncated", Uint8Array, rows],
      ["status", Int32Array, rows],
      ["info", Float64Array, rows * info],
      ["was_reset", Uint8Array, rows],
      ["reset_info", Float64Array, rows * resetInfo],
      ["final_obs", Float64Array, keepsFinal * rows * this.observationSize],
      ["final_info", Float64Array, keepsFinal * rows * info],
      ["arrays", Float64Array, rows * arrays],
      ["action", Float64Array, rows * this.actionSize],
      ["mask", Uint8Array, rows],
    ];
    const up = (/** @type {number} */ bytes) => bytes + (-bytes & 7);
    const total = wanted.reduce((bytes, [, type, length]) => bytes + up(type.BYTES_PER_ELEMENT * length), 0);
    this.#block = this.#library.allocate(mjenv_batch.size + total);
    new Uint8Array(this.#library.buffer, this.#block, mjenv_batch.size + total).fill(0);
    let pointer = this.#block + mjenv_batch.size;
    for (const [name, type, length] of wanted) {
      this.#places.set(name, { type, pointer, length });
      pointer += up(type.BYTES_PER_ELEMENT * length);
    }
    const at = (/** @type {string} */ name) => this.#places.get(name)?.pointer ?? 0;
    this.#actions = at("action");
    this.#mask = at("mask");
    this.#library.write(this.#block, mjenv_batch, {
      obs_dtype: Dtype.FLOAT64,
      rows,
      obs_count: this.observationSize,
      info_count: info,
      reset_info_count: resetInfo,
      arrays_count: arrays,
      obs: at("obs"),
      reward: at("reward"),
      terminated: at("terminated"),
      truncated: at("truncated"),
      status: at("status"),
      info: at("info"),
      was_reset: at("was_reset"),
      reset_info: at("reset_info"),
      final_obs: keepsFinal && at("final_obs"),
      final_info: keepsFinal && at("final_info"),
      arrays: at("arrays"),
    });
  }

  /** @param {number} role */
  #space(role) {
    const library = this.#library;
    const space = library.filled(mjenv_space, (pointer) => library.functions.mjenv_space_of(this.#open, role, pointer));
    return {
      low: library.doubles(space.low, space.count),
      high: library.doubles(space.high, space.count),
      shape: space.shape.slice(0, space.ndim),
    };
  }

  // ---- The outputs of the last call ----

  /**
   * The result of `make` for a name, which is cached until the memory grows.
   *
   * @template T
   * @param {string} name
   * @param {() => T} make
   * @returns {T}
   */
  #cached(name, make) {
    void this.#open;
    if (this.#viewed !== this.#library.buffer) {
      this.#viewed = this.#library.buffer;
      this.#views.clear();
    }
    if (!this.#views.has(name)) this.#views.set(name, make());
    return /** @type {T} */ (this.#views.get(name));
  }

  /**
   * @template T
   * @param {string} name
   * @returns {T}
   */
  #view(name) {
    return this.#cached(name, () => {
      const place = this.#places.get(name);
      if (!place) throw new Error(name);
      return /** @type {T} */ (new place.type(this.#library.buffer, place.pointer, place.length));
    });
  }

  /**
   * @param {string} name
   * @param {readonly Field[]} fields
   * @returns {Fields}
   */
  #record(name, fields) {
    return this.#cached(`${name} by field`, () => {
      const numbers = /** @type {Float64Array} */ (this.#view(name));
      const rows = this.numEnvs;
      const present = numbers.length === 0 ? [] : fields;
      return Object.freeze(
        Object.fromEntries(
          present.map(({ name: field, offset, count }) => [
            field,
            numbers.subarray(offset * rows, (offset + count) * rows),
          ]),
        ),
      );
    });
  }

  /**
   * The observations, row after row. This and the following are views of the library's memory: the next call writes
   * into them. Do not keep them, because they become empty when the memory grows; read the property again, or `slice`.
   *
   * @returns {Float64Array}
   */
  get observations() {
    return this.#view("obs");
  }

  /**
   * The reward of each row.
   *
   * @returns {Float64Array}
   */
  get rewards() {
    return this.#view("reward");
  }

  /**
   * 1 for each row whose episode has ended by the rules of the task.
   *
   * @returns {Uint8Array}
   */
  get terminated() {
    return this.#view("terminated");
  }

  /**
   * 1 for each row whose episode has ended by its time limit.
   *
   * @returns {Uint8Array}
   */
  get truncated() {
    return this.#view("truncated");
  }

  /**
   * For each row 0, DIVERGED, or the negative status of a row that failed.
   *
   * @returns {Int32Array}
   */
  get statuses() {
    return this.#view("status");
  }

  /**
   * 1 for each row that the last call has reset.
   *
   * @returns {Uint8Array}
   */
  get wasReset() {
    return this.#view("was_reset");
  }

  /**
   * The observation of a row by group: the task's groups of terms, and the terms without a group. Empty unless the
   * observation is a Gymnasium Dict (the option "observation").
   *
   * @param {number} [row]
   * @returns {Fields} views, as of `observations`
   */
  groups(row = 0) {
    if (!Number.isInteger(row) || row < 0 || row >= this.numEnvs)
      throw new MjenvError("MJENV_E_VALUE", `row ${String(row)} is outside 0..${this.numEnvs - 1}`);
    const first = row * this.observationSize;
    const numbers = this.observations;
    return Object.freeze(
      Object.fromEntries(
        this.#groupFields.map(({ name, offset, count }) => [
          name,
          numbers.subarray(first + offset, first + offset + count),
        ]),
      ),
    );
  }

  /** The info of the last step. */
  get info() {
    return this.#record("info", this.#infoFields);
  }

  /** The info of the last reset. */
  get resetInfo() {
    return this.#record("reset_info", this.#resetInfoFields);
  }

  /**
   * With the option autoreset_mode "same_step": the last observations of episodes that a step has ended and reset;
   * otherwise empty.
   *
   * @returns {Float64Array}
   */
  get finalObservations() {
    return this.#view("final_obs");
  }

  /** The info that belongs to `finalObservations`. */
  get finalInfo() {
    return this.#record("final_info", this.#infoFields);
  }

  /** The arrays of mjData that the option "arrays" names. */
  get arrays() {
    return this.#record("arrays", this.#arrayFields);
  }

  // ---- Random streams ----

  /**
   * Gives rows new random streams, as Gymnasium's `reset(seed=...)` does, without a reset.
   *
   * @param {Seeds} seed row i gets seed + i; an array has one for each row, or null for a row whose stream continues
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows; all if left out
   */
  seed(seed, { mask, ...others } = {}) {
    refuseOthers(others, "seed");
    this.#seed(seed, this.#chosen(mask));
  }

  /**
   * @param {Seeds} seed
   * @param {Uint8Array} [mask] not in the library's memory
   */
  #seed(seed, mask) {
    const rows = this.numEnvs;
    /** @type {(bigint | null)[]} */
    let seeds;
    if (typeof seed === "number" || typeof seed === "bigint") {
      const first = integer(seed, "the seed");
      seeds = Array.from({ length: rows }, (_, row) => first + BigInt(row));
    } else if (Array.isArray(seed)) {
      checkLength(seed, rows, "list of seeds", "rows are there");
      seeds = Array.from(seed, (one) => (one === null ? null : integer(one, "a seed")));
    } else {
      throw new MjenvError("MJENV_E_TYPE", "a seed is a number, a bigint or an array of them");
    }
    const negative = seeds.find((one) => one !== null && one < 0n);
    if (negative !== undefined)
      throw new MjenvError("MJENV_E_VALUE", `a seed is ${negative}; it must be an integer from 0 on`);
    const library = this.#library;
    const handle = this.#open;
    const isChosen = Uint8Array.from(seeds, (one, row) => (one !== null && (!mask || mask[row]) ? 1 : 0));
    const lists = seeds.map((one, row) => (one !== null && isChosen[row] ? wordsOf(one) : []));
    const count = lists.reduce((most, { length }) => Math.max(most, length), 1);
    library.scope((scratch) => {
      const pointer = scratch.allocate(8 * count * rows);
      const words = new BigUint64Array(library.buffer, pointer, count * rows).fill(0n);
      lists.forEach((list, row) => words.set(list, row * count));
      library.check(library.functions.mjenv_seed(handle, this.#place(isChosen), pointer, BigInt(words.length)));
    });
  }

  /**
   * Seeds the stream of `sampleActions`, as Gymnasium's `action_space.seed` does.
   *
   * @param {Seed} seed below 2^64
   */
  seedActions(seed) {
    const value = integer(seed, "the seed");
    if (BigInt.asUintN(64, value) !== value)
      throw new MjenvError("MJENV_E_VALUE", `the seed is ${value}; it must be an integer from 0 on, below 2^64`);
    this.#library.check(this.#library.functions.mjenv_seed_actions(this.#open, value));
  }

  /** Draws an action for each row, as Gymnasium's `action_space.sample` does. */
  sampleActions() {
    const count = this.numEnvs * this.actionSize;
    this.#library.check(this.#library.functions.mjenv_sample_actions(this.#open, this.#actions, BigInt(count)));
    return new Float32Array(this.#library.buffer, this.#actions, count).slice();
  }

  // ---- Episodes ----

  /**
   * Begins new episodes.
   *
   * @param {object} [settings]
   * @param {Seeds} [settings.seed] see `seed`; the streams continue if left out
   * @param {Mask} [settings.mask] the rows to reset; all if left out
   */
  reset({ seed, mask, ...others } = {}) {
    refuseOthers(others, "reset");
    const chosen = this.#chosen(mask);
    if (seed !== undefined && seed !== null) this.#seed(seed, chosen);
    this.#library.check(this.#library.functions.mjenv_reset(this.#open, this.#place(chosen), this.#block));
  }

  /**
   * Steps rows.
   *
   * @param {ArrayLike<number>} actions the actions, row after row. The library computes with the numbers of a
   *   Float32Array in float32, and with all others in float64, as NumPy does
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows to step; all if left out
   */
  step(actions, { mask, ...others } = {}) {
    refuseOthers(others, "step");
    const chosen = this.#chosen(mask);
    const given = numbers(actions, "actions");
    const { dtype, type } = dtypeOf(given);
    const handle = this.#open;
    const { buffer, functions } = this.#library;
    // If there are too many or too few, the library says so, and does not read them.
    if (given.length === this.numEnvs * this.actionSize) new type(buffer, this.#actions, given.length).set(given);
    const mine = this.#place(chosen);
    const count = BigInt(given.length);
    this.#library.check(functions.mjenv_step(handle, mine, this.#actions, count, dtype, this.#block));
  }

  /**
   * Plays many actions in each row, from its present state on, without resets.
   *
   * @param {ArrayLike<number>} actions for row after row, for step after step. As for `step`, a Float32Array is float32
   * @param {number} steps how many actions each row has
   * @returns {{ observations: Float64Array; rewards: Float64Array; terminated: Uint8Array; truncated: Uint8Array }} for
   *   row after row, for step after step
   */
  rollout(actions, steps) {
    const given = numbers(actions, "actions");
    const wanted = int64(steps, "steps");
    const handle = this.#open;
    const library = this.#library;
    const { dtype } = dtypeOf(given);
    const count = given.length;
    // If there are too many or too few actions, the library says so, and writes nothing.
    const isWhole = count === this.numEnvs * Number(wanted) * this.actionSize;
    const rows = isWhole ? this.numEnvs * Math.max(0, Number(wanted)) : 0;
    return library.scope((scratch) => {
      const copy = scratch.copy(given);
      const batch = scratch.allocate(mjenv_batch.size);
      const obs = scratch.allocate(8 * rows * this.observationSize);
      const reward = scratch.allocate(8 * rows);
      const terminated = scratch.allocate(rows);
      const truncated = scratch.allocate(rows);
      library.write(batch, mjenv_batch, {
        obs_dtype: Dtype.FLOAT64,
        rows,
        obs_count: this.observationSize,
        obs,
        reward,
        terminated,
        truncated,
      });
      library.check(library.functions.mjenv_rollout(handle, copy, BigInt(count), dtype, wanted, batch));
      return {
        observations: library.doubles(obs, rows * this.observationSize),
        rewards: library.doubles(reward, rows),
        terminated: new Uint8Array(library.buffer, terminated, rows).slice(),
        truncated: new Uint8Array(library.buffer, truncated, rows).slice(),
      };
    });
  }

  /**
   * Computes the rewards of pairs of goals by the task's compute_reward, for hindsight experience replay.
   *
   * @param {ArrayLike<number>} achieved one goal after the other
   * @param {ArrayLike<number>} desired
   * @param {number} [count] how many pairs there are; as many as rows if left out
   * @returns {Float64Array} the reward of each pair
   */
  computeReward(achieved, desired, count = this.numEnvs) {
    const [from, to] = [doubles(achieved, "achieved goals"), doubles(desired, "desired goals")];
    checkLength(to, from.length, "list of desired goals", "are in the list of achieved goals");
    const pairs = int64(count, "count");
    const handle = this.#open;
    const library = this.#library;
    // If they are too many or too few, the library says so, and writes nothing.
    const room = Number(pairs) <= from.length ? Math.max(0, Number(pairs)) : 0;
    return library.scope((scratch) => {
      const [mine, wanted] = [scratch.copy(from), scratch.copy(to)];
      const rewards = scratch.allocate(8 * room);
      const length = BigInt(from.length);
      library.check(library.functions.mjenv_compute_reward(handle, mine, wanted, length, rewards, pairs));
      return library.doubles(rewards, room);
    });
  }

  /** Computes `observations` and `arrays` of the present states, for instance after `restore`. */
  observe() {
    this.#library.check(this.#library.functions.mjenv_observe(this.#open, this.#block));
  }

  // ---- Resets and steps whose outputs the program computes ("Batch-v0") ----

  /**
   * Begins new episodes, and writes `arrays`. Then compute the observations and call `finish`.
   *
   * @param {object} [settings]
   * @param {ArrayLike<number>} [settings.qpos] the positions of all rows; the model's if left out
   * @param {ArrayLike<number>} [settings.qvel] the velocities of all rows
   * @param {Mask} [settings.mask] the rows; all if left out
   */
  begin({ qpos, qvel, mask, ...others } = {}) {
    refuseOthers(others, "begin");
    const chosen = this.#chosen(mask);
    const handle = this.#open;
    this.#library.scope((scratch) => {
      const [q, v] = [optional(scratch, qpos, "positions"), optional(scratch, qvel, "velocities")];
      const { mjenv_begin } = this.#library.functions;
      this.#library.check(
        mjenv_begin(handle, this.#place(chosen), q.pointer, q.count, v.pointer, v.count, this.#block),
      );
    });
  }

  /**
   * The actions that the task sees in the next step: transformed, delayed and with noise. Changes nothing.
   *
   * @param {ArrayLike<number>} actions as for `step`
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows; the numbers of others are 0
   * @returns {Float64Array | Float32Array}
   */
  act(actions, { mask, ...others } = {}) {
    refuseOthers(others, "act");
    const chosen = this.#chosen(mask);
    const given = numbers(actions, "actions");
    const { dtype, type } = dtypeOf(given);
    const handle = this.#open;
    const library = this.#library;
    return library.scope((scratch) => {
      const [action, seen] = [scratch.copy(given), scratch.copy(new type(given.length))];
      const count = BigInt(given.length);
      library.check(library.functions.mjenv_act(handle, this.#place(chosen), action, count, dtype, seen));
      return new type(library.buffer, seen, given.length).slice();
    });
  }

  /**
   * Simulates a step, and writes `arrays` and `wasReset`. The rows of `wasReset` were not stepped: call `begin` for them.
   * Then compute the outputs and call `finish`.
   *
   * @param {ArrayLike<number>} actions as for `step`
   * @param {object} [settings]
   * @param {ArrayLike<number>} [settings.ctrl] what the program makes of the actions of all rows; the actions if left out
   * @param {Mask} [settings.mask] the rows; all if left out
   */
  advance(actions, { ctrl, mask, ...others } = {}) {
    refuseOthers(others, "advance");
    const chosen = this.#chosen(mask);
    const given = numbers(actions, "actions");
    const { dtype } = dtypeOf(given);
    const handle = this.#open;
    const library = this.#library;
    library.scope((scratch) => {
      const [action, made] = [scratch.copy(given), optional(scratch, ctrl, "ctrl")];
      const [mine, count] = [this.#place(chosen), BigInt(given.length)];
      const { mjenv_advance } = library.functions;
      library.check(mjenv_advance(handle, mine, action, count, dtype, made.pointer, made.count, this.#block));
    });
  }

  /**
   * Ends the step or reset with what the program has computed, and writes the outputs. What is left out is 0.
   *
   * @param {Computed | null} computed null: gives the step up
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows; all if left out
   */
  finish(computed, { mask, ...others } = {}) {
    refuseOthers(others, "finish");
    const { observations, rewards, terminated, infos, resetInfos, ...unknown } = computed ?? {};
    refuseOthers(unknown, "finish");
    const chosen = this.#chosen(mask);
    const handle = this.#open;
    const library = this.#library;
    const [info, resetInfo] = [sum(this.#infoFields), sum(this.#resetInfoFields)];
    library.scope((scratch) => {
      /** @type {(values: ArrayLike<number> | undefined, what: string, each: number) => number} */
      const place = (values, what, each) => {
        const { pointer, count } = optional(scratch, values, what);
        if (values && Number(count) !== each * this.numEnvs)
          throw new MjenvError("MJENV_E_SIZE", `${what}: ${count} numbers, not ${each * this.numEnvs}`);
        return pointer;
      };
      const obsCount = observations ? observations.length / this.numEnvs : 0;
      const given = scratch.allocate(mjenv_batch.size);
      library.write(given, mjenv_batch, {
        obs_dtype: Dtype.FLOAT64,
        rows: this.numEnvs,
        obs_count: Math.floor(obsCount),
        info_count: info,
        reset_info_count: resetInfo,
        obs: place(observations, "observations", Math.floor(obsCount)),
        reward: place(rewards, "rewards", 1),
        terminated: terminated ? scratch.copy(Uint8Array.from(terminated)) : 0,
        info: place(infos, "infos", info),
        reset_info: place(resetInfos, "resetInfos", resetInfo),
      });
      if (terminated && terminated.length !== this.numEnvs)
        throw new MjenvError("MJENV_E_SIZE", `terminated: ${terminated.length} numbers, not ${this.numEnvs}`);
      const { mjenv_finish } = library.functions;
      library.check(mjenv_finish(handle, this.#place(chosen), computed ? given : 0, this.#block));
    });
  }

  // ---- State ----

  /**
   * Saves a row, or with ALL_ROWS all of them: state, random stream, step count and own values.
   *
   * @param {number} [row]
   * @returns {Uint8Array} the library's image, the same bytes as in other languages
   */
  snapshot(row = 0) {
    const handle = this.#open;
    const { functions } = this.#library;
    const number = int64(row, "the row");
    return this.#library.scope((scratch) => {
      const size = scratch.allocate(8);
      this.#library.check(functions.mjenv_snapshot(handle, number, 0, 0n, size));
      const bytes = this.#library.number(size, "int64");
      const image = scratch.allocate(bytes);
      this.#library.check(functions.mjenv_snapshot(handle, number, image, BigInt(bytes), size));
      return new Uint8Array(this.#library.buffer, image, bytes).slice();
    });
  }

  /**
   * Sets a row, or with ALL_ROWS all of them, to what `snapshot` has saved. `observations` stay as they are: see
   * `observe`.
   *
   * @param {Uint8Array} image
   * @param {number} [row]
   */
  restore(image, row = 0) {
    if (!(image instanceof Uint8Array)) throw new MjenvError("MJENV_E_TYPE", "an image is a Uint8Array");
    const given = bytes(image, "bytes of the image");
    const number = int64(row, "the row");
    const handle = this.#open;
    this.#library.scope((scratch) => {
      const copy = scratch.copy(given);
      this.#library.check(this.#library.functions.mjenv_restore(handle, number, copy, BigInt(given.length)));
    });
  }

  /**
   * Copies a row to others.
   *
   * @param {number} from
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows to overwrite; all if left out
   */
  copyRow(from, { mask, ...others } = {}) {
    refuseOthers(others, "copyRow");
    const chosen = this.#chosen(mask);
    const number = int64(from, "the row");
    this.#library.check(this.#library.functions.mjenv_copy_row(this.#open, this.#place(chosen), number));
  }

  /**
   * Reads an array of MuJoCo by its name there: "qpos", "geom_xpos", "body_mass", "nq", "opt.timestep".
   * `fields("data")` and `fields("model")` list them with their shapes.
   *
   * @param {string} name
   * @param {number} [row]
   */
  read(name, row = 0) {
    const handle = this.#open;
    const { functions } = this.#library;
    const number = int64(row, "the row");
    return this.#library.scope((scratch) => {
      const array = scratch.text(String(name));
      const size = scratch.allocate(8);
      this.#library.check(functions.mjenv_read(handle, number, array, 0, 0n, size));
      const count = this.#library.number(size, "int64");
      const values = scratch.allocate(8 * count);
      this.#library.check(functions.mjenv_read(handle, number, array, values, BigInt(count), size));
      return this.#library.doubles(values, count);
    });
  }

  /**
   * Writes an array of MuJoCo: "xfrc_applied", "body_mass", "opt.gravity". Values of the model stay after resets; a
   * reset clears the inputs of the data.
   *
   * @param {string} name
   * @param {ArrayLike<number>} values all elements of the array, which each row gets; or those of each row, row after
   *   row
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows to write; all if left out
   */
  write(name, values, { mask, ...others } = {}) {
    refuseOthers(others, "write");
    const chosen = this.#chosen(mask);
    const given = doubles(values, "values");
    const handle = this.#open;
    this.#library.scope((scratch) => {
      const array = scratch.text(String(name));
      const copy = scratch.copy(given);
      const mine = this.#place(chosen);
      this.#library.check(this.#library.functions.mjenv_write(handle, mine, array, copy, BigInt(given.length)));
    });
  }

  /**
   * Sets the positions and velocities of a row, as Gymnasium's `set_state` does.
   *
   * @param {ArrayLike<number>} qpos
   * @param {ArrayLike<number>} qvel
   * @param {number} [row]
   */
  setState(qpos, qvel, row = 0) {
    const [positions, velocities] = [doubles(qpos, "qpos"), doubles(qvel, "qvel")];
    const [nq, nv] = [BigInt(positions.length), BigInt(velocities.length)];
    const number = int64(row, "the row");
    const handle = this.#open;
    this.#library.scope((scratch) => {
      const [at, moving] = [scratch.copy(positions), scratch.copy(velocities)];
      this.#library.check(this.#library.functions.mjenv_set_state(handle, number, at, nq, moving, nv));
    });
  }

  /**
   * Makes MuJoCo compute what it computes from masses, sizes and the like when it loads a model (mj_setConst). Reset
   * the rows or set their states afterwards.
   *
   * @param {object} [settings]
   * @param {Mask} [settings.mask] the rows; all if left out
   */
  setConstants({ mask, ...others } = {}) {
    refuseOthers(others, "setConstants");
    const chosen = this.#chosen(mask);
    this.#library.check(this.#library.functions.mjenv_set_constants(this.#open, this.#place(chosen)));
  }

  // ---- Description ----

  /**
   * Describes what a role consists of: "observation", "action", "info", "reset_info", "reward", "structure", "data" and
   * "model" (what `read` reads), "arrays", and "groups": the keys of an observation that is a Gymnasium Dict.
   *
   * @param {RoleName} role
   * @returns {Field[]}
   */
  fields(role) {
    const handle = this.#open;
    const library = this.#library;
    const number = numberOf(Role, role, "role");
    return Array.from({ length: Number(library.functions.mjenv_field_count(handle, number)) }, (_, index) => {
      const field = library.filled(mjenv_field, (pointer) =>
        library.functions.mjenv_field_at(handle, number, BigInt(index), pointer),
      );
      return {
        name: library.text(field.name),
        doc: library.text(field.doc),
        shape: field.shape.slice(0, field.ndim),
        offset: field.offset,
        count: field.count,
        dtype: nameOf(Dtype, field.dtype),
      };
    });
  }

  /**
   * The names of the model's objects of a type by its name in MJCF: "body", "joint", "mesh", "key" and so on. The error
   * for another name lists all. An object without a name has "".
   *
   * @param {string} type
   * @returns {string[]}
   */
  objectNames(type) {
    const handle = this.#open;
    const library = this.#library;
    return library.scope((scratch) => {
      const kind = scratch.text(String(type));
      const to = scratch.allocate(8);
      library.check(library.functions.mjenv_object_count(handle, kind, to));
      return Array.from({ length: library.number(to, "int64") }, (_, index) => {
        library.check(library.functions.mjenv_object_name(handle, kind, BigInt(index), to));
        return library.text(library.number(to, "uint32"));
      });
    });
  }

  /**
   * The index of the object of this type and name.
   *
   * @param {string} type
   * @param {string} name
   */
  objectIndex(type, name) {
    const handle = this.#open;
    const library = this.#library;
    return library.scope((scratch) => {
      const to = scratch.allocate(8);
      const [kind, wanted] = [scratch.text(String(type)), scratch.text(String(name))];
      library.check(library.functions.mjenv_object_index(handle, kind, wanted, to));
      return library.number(to, "int64");
    });
  }

  // ---- Randomisation ----

  /**
   * Replaces parts of the draws, noise, delays and pushes from each row's next reset on.
   *
   * @param {Draws | string | null} document an object, or its JSON; null removes all parts
   */
  randomize(document) {
    // JSON has no typed arrays, and would say null for numbers that it does not have. As texts they are refused.
    const plain = (/** @type {string} */ _name, /** @type {unknown} */ value) => {
      if (ArrayBuffer.isView(value)) return Array.from(/** @type {any} */ (value));
      const isNumber = typeof value === "bigint" || (typeof value === "number" && !Number.isFinite(value));
      return isNumber ? String(value) : value;
    };
    const text = typeof document === "string" ? document : document ? JSON.stringify(document, plain) : "";
    const handle = this.#open;
    this.#library.scope((scratch) =>
      this.#library.check(this.#library.functions.mjenv_randomize(handle, scratch.text(text))),
    );
  }

  /** The document of all parts that are set, as JSON. */
  get randomization() {
    const library = this.#library;
    return library.scope((scratch) => {
      const to = scratch.allocate(4);
      library.check(library.functions.mjenv_randomization(this.#open, to));
      return library.text(library.number(to, "uint32"));
    });
  }

  // ---- End ----

  /** Frees the environment. Freeing it again does nothing; any other use of it throws an error. */
  free() {
    this.#library.functions.mjenv_destroy(this.#handle);
    if (this.#block !== 0) this.#library.free(this.#block);
    this.#handle = this.#block = 0;
    this.#views.clear();
  }

  /** `using env = mjenv.make(...)` frees it at the end of the block. */
  [Symbol.dispose]() {
    this.free();
  }

  /**
   * A copy of a mask that a caller has given.
   *
   * @param {Mask | null | undefined} mask
   */
  #chosen(mask) {
    return mask === undefined || mask === null ? undefined : flags(mask, this.numEnvs);
  }

  /**
   * Writes a mask where the library reads it, and returns its address; 0 if there is none.
   *
   * @param {Uint8Array | undefined} mask not in the library's memory
   */
  #place(mask) {
    if (!mask) return 0;
    /** @type {Uint8Array} */ (this.#view("mask")).set(mask);
    return this.#mask;
  }
}

/**
 * The 64-bit words of a seed, the least significant first.
 *
 * @param {bigint} seed
 */
function wordsOf(seed) {
  const words = [];
  for (let rest = seed; rest > 0n; rest >>= 64n) words.push(BigInt.asUintN(64, rest));
  return words;
}

/** @param {Float32Array | Float64Array} actions */
function dtypeOf(actions) {
  return actions instanceof Float32Array
    ? { dtype: Dtype.FLOAT32, type: Float32Array }
    : { dtype: Dtype.FLOAT64, type: Float64Array };
}

/**
 * A copy of numbers that may be left out, and how many they are.
 *
 * @param {import("./library.js").Scratch} scratch
 * @param {ArrayLike<number> | undefined} values
 * @param {string} what
 */
function optional(scratch, values, what) {
  if (!values) return { pointer: 0, count: 0n };
  const given = doubles(values, what);
  return { pointer: scratch.copy(given), count: BigInt(given.length) };
}

/**
 * @param {object} others
 * @param {string} method
 */
function refuseOthers(others, method) {
  const names = Object.keys(others);
  if (names.length > 0) throw new MjenvError("MJENV_E_NAME", `${method} has no setting "${names[0]}"`);
}
