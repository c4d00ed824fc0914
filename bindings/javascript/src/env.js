// An environment of one or many rows.

import { Dtype, Role, Status, mjenv_batch, mjenv_field, mjenv_info, mjenv_space } from "./abi.js";
import { bytes, checkLength, doubles, flags, int64, integer, numbers } from "./arguments.js";
import { MjenvError } from "./errors.js";
import { describeOptions, optionValue, setOption, withOptions } from "./options.js";

/** @typedef {import("./library.js").Library} Library */
/** @typedef {import("./library.js").Argument} Argument */
/** @typedef {import("./options.js").OptionValue} OptionValue */
/** @typedef {number | bigint} Seed an integer from 0 on, of any size */
/** @typedef {ArrayLike<number | boolean>} Mask one element for each row: whether the call is for it */
/** @typedef {{ mask?: Mask | null }} Only the rows that a call is for; all if left out */
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

// `using` needs this symbol, also as compilers translate it for older engines, but some browsers lack it.
if (!Symbol.dispose) Object.defineProperty(Symbol, "dispose", { value: Symbol.for("Symbol.dispose") });

/** Instead of a row's number: all rows. */
export const ALL_ROWS = -1;

/** In `statuses`: the row's state diverged. */
export const DIVERGED = Status.DIVERGED;

/** The arrays that calls read and write, named as in mjenv_batch. */
const arrays = {
  obs: Float64Array,
  reward: Float64Array,
  terminated: Uint8Array,
  truncated: Uint8Array,
  status: Int32Array,
  info: Float64Array,
  was_reset: Uint8Array,
  reset_info: Float64Array,
  final_obs: Float64Array,
  final_info: Float64Array,
  arrays: Float64Array,
  action: Float64Array,
  mask: Uint8Array,
};

/** @param {Record<string, number>} table of abi.js @param {string} name in lower case @param {string} what */
function numberOf(table, name, what) {
  const value = table[String(name).toUpperCase()];
  if (value !== undefined) return value;
  const names = Object.keys(table).map((key) => `"${key.toLowerCase()}"`);
  throw new MjenvError("MJENV_E_NAME", `there is no ${what} "${name}"; there are ${names.join(", ")}`);
}

/** @template {Record<string, number>} Table @param {Table} table of abi.js @param {number} value */
function nameOf(table, value) {
  const found = Object.keys(table).find((key) => table[key] === value) ?? String(value);
  return /** @type {Lowercase<keyof Table & string>} */ (found.toLowerCase());
}

/** @param {readonly { count: number }[]} fields */
const sum = (fields) => fields.reduce((total, field) => total + field.count, 0);

/** @param {Float32Array | Float64Array} actions */
const typeOf = (actions) => (actions instanceof Float32Array ? Float32Array : Float64Array);

/** @param {Float32Array | Float64Array} actions */
const dtypeOf = (actions) => (actions instanceof Float32Array ? Dtype.FLOAT32 : Dtype.FLOAT64);

/** @param {readonly Field[]} fields @param {(field: Field) => Float64Array} make @returns {Fields} */
const byName = (fields, make) => Object.freeze(Object.fromEntries(fields.map((field) => [field.name, make(field)])));

/**
 * One or many rows of a robot; a row is one episode. Make it with `mjenv.make`, and `free` it after use: the garbage
 * collector does not know the library's memory.
 */
export class Env {
  #library;
  #handle = 0;
  /** The memory of the batch and of `arrays`. */
  #block = 0;
  /** @type {Record<string, { pointer: number; length: number }>} */
  #places = {};
  /** @type {Map<string, unknown>} */
  #views = new Map();
  /** @type {ArrayBufferLike | undefined} */
  #viewed;
  #fields;

  /** @param {Library} library @param {string} id @param {Settings} settings */
  constructor(library, id, { numEnvs = 1, seed, ...options }) {
    this.#library = library;
    const given = Object.entries(options).filter(([, value]) => value !== undefined);
    const values = given.map(([name, value]) => ({ name, value: optionValue(name, value) }));
    this.#handle = withOptions(library, id, (built) => {
      for (const { name, value } of values) setOption(library, built, name, value);
      return library.out("uint32", "mjenv_create", built, int64(numEnvs, "numEnvs"));
    });
    try {
      /** The id. */
      this.id = String(id);
      const info = library.filled(mjenv_info, "mjenv_info_of", this.#handle);
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
      this.#fields = {
        info: this.fields("info"),
        reset_info: this.fields("reset_info"),
        arrays: this.fields("arrays"),
        groups: this.fields("groups"),
      };
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

  /**
   * Calls a function of the library for this environment.
   *
   * @param {keyof import("./abi.js").Functions} name
   * @param {Argument[]} given see `Scratch.place`
   */
  #call(name, ...given) {
    this.#library.call(name, this.#open, ...given);
  }

  #allocate() {
    const rows = this.numEnvs;
    const [info, resetInfo, data] = [this.#fields.info, this.#fields.reset_info, this.#fields.arrays].map(sum);
    const final = this.options["autoreset_mode"] === "same_step" ? rows : 0;
    /** @type {Partial<Record<keyof typeof arrays, number>>} */
    const lengths = {
      obs: rows * this.observationSize,
      info: rows * info,
      reset_info: rows * resetInfo,
      final_obs: final * this.observationSize,
      final_info: final * info,
      arrays: rows * data,
      action: rows * this.actionSize,
    };
    let total = mjenv_batch.size;
    for (const [name, type] of Object.entries(arrays)) {
      const length = lengths[/** @type {keyof typeof arrays} */ (name)] ?? rows;
      this.#places[name] = { pointer: total, length };
      const bytes = type.BYTES_PER_ELEMENT * length;
      total += bytes + (-bytes & 7);
    }
    this.#block = this.#library.allocate(total);
    new Uint8Array(this.#library.buffer, this.#block, total).fill(0);
    for (const place of Object.values(this.#places)) place.pointer += this.#block;
    const { action, mask, ...written } = this.#places;
    const kept = Object.entries(written).filter(([name]) => final > 0 || !name.startsWith("final_"));
    this.#library.write(this.#block, mjenv_batch, {
      obs_dtype: Dtype.FLOAT64,
      rows,
      obs_count: this.observationSize,
      info_count: info,
      reset_info_count: resetInfo,
      arrays_count: data,
      ...Object.fromEntries(kept.map(([name, { pointer }]) => [name, pointer])),
    });
  }

  /** @param {number} role */
  #space(role) {
    const space = this.#library.filled(mjenv_space, "mjenv_space_of", this.#open, role);
    const bounds = (/** @type {number} */ pointer) => this.#library.array(Float64Array, pointer, space.count);
    return { low: bounds(space.low), high: bounds(space.high), shape: space.shape.slice(0, space.ndim) };
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

  /** @template {keyof typeof arrays} Name @param {Name} name @returns {InstanceType<(typeof arrays)[Name]>} */
  #view(name) {
    return this.#cached(name, () => {
      const { pointer, length } = this.#places[name];
      return /** @type {any} */ (new arrays[name](this.#library.buffer, pointer, length));
    });
  }

  /** @param {"info" | "reset_info" | "final_info" | "arrays"} name @param {readonly Field[]} fields */
  #record(name, fields) {
    return this.#cached(`${name} by field`, () => {
      const numbers = this.#view(name);
      const rows = this.numEnvs;
      return byName(numbers.length === 0 ? [] : fields, ({ offset, count }) =>
        numbers.subarray(offset * rows, (offset + count) * rows),
      );
    });
  }

  /**
   * The observations, row after row. This and the following are views of the library's memory: the next call writes
   * into them. Do not keep them, because they become empty when the memory grows; read the property again, or `slice`.
   */
  get observations() {
    return this.#view("obs");
  }

  /** The reward of each row. */
  get rewards() {
    return this.#view("reward");
  }

  /** 1 for each row whose episode has ended by the rules of the task. */
  get terminated() {
    return this.#view("terminated");
  }

  /** 1 for each row whose episode has ended by its time limit. */
  get truncated() {
    return this.#view("truncated");
  }

  /** For each row 0, DIVERGED, or the negative status of a row that failed. */
  get statuses() {
    return this.#view("status");
  }

  /** 1 for each row that the last call has reset. */
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
    return byName(this.#fields.groups, ({ offset, count }) => numbers.subarray(first + offset, first + offset + count));
  }

  /** The info of the last step. */
  get info() {
    return this.#record("info", this.#fields.info);
  }

  /** The info of the last reset. */
  get resetInfo() {
    return this.#record("reset_info", this.#fields.reset_info);
  }

  /**
   * With the option autoreset_mode "same_step": the last observations of episodes that a step has ended and reset;
   * otherwise empty.
   */
  get finalObservations() {
    return this.#view("final_obs");
  }

  /** The info that belongs to `finalObservations`. */
  get finalInfo() {
    return this.#record("final_info", this.#fields.info);
  }

  /** The arrays of mjData that the option "arrays" names. */
  get arrays() {
    return this.#record("arrays", this.#fields.arrays);
  }

  // ---- Random streams ----

  /**
   * Gives rows new random streams, as Gymnasium's `reset(seed=...)` does, without a reset.
   *
   * @param {Seeds} seed row i gets seed + i; an array has one for each row, or null for a row whose stream continues
   * @param {Only} [settings]
   */
  seed(seed, settings = {}) {
    const mask = this.#chosen("seed", settings);
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
    const isChosen = Uint8Array.from(seeds, (one, row) => (one !== null && (!mask || mask[row]) ? 1 : 0));
    const lists = seeds.map((one, row) => (isChosen[row] ? wordsOf(one ?? 0n) : []));
    const count = lists.reduce((most, { length }) => Math.max(most, length), 1);
    const words = new BigUint64Array(count * rows);
    lists.forEach((list, row) => words.set(list, row * count));
    this.#call("mjenv_seed", this.#place(isChosen), words);
  }

  /** Seeds the stream of `sampleActions`, as Gymnasium's `action_space.seed` does. @param {Seed} seed below 2^64 */
  seedActions(seed) {
    const value = integer(seed, "the seed");
    if (BigInt.asUintN(64, value) !== value)
      throw new MjenvError("MJENV_E_VALUE", `the seed is ${value}; it must be an integer from 0 on, below 2^64`);
    this.#call("mjenv_seed_actions", value);
  }

  /** Draws an action for each row, as Gymnasium's `action_space.sample` does. */
  sampleActions() {
    const { pointer, length } = this.#places.action;
    this.#call("mjenv_sample_actions", pointer, BigInt(length));
    return this.#library.array(Float32Array, pointer, length);
  }

  // ---- Episodes ----

  /**
   * Begins new episodes.
   *
   * @param {{ seed?: Seeds | null } & Only} [settings] see `seed`; the streams continue if no seed is given
   */
  reset({ seed, ...settings } = {}) {
    const mask = this.#chosen("reset", settings);
    if (seed !== undefined && seed !== null) this.seed(seed, { mask });
    this.#call("mjenv_reset", this.#place(mask), this.#block);
  }

  /**
   * Steps rows.
   *
   * @param {ArrayLike<number>} actions the actions, row after row. The library computes with the numbers of a
   *   Float32Array in float32, and with all others in float64, as NumPy does
   * @param {Only} [settings]
   */
  step(actions, settings = {}) {
    const given = numbers(actions, "actions");
    const mask = this.#rows("step", settings);
    const { buffer, byteOffset, length } = this.#view("action");
    // If there are too many or too few, the library says so, and does not read them.
    if (given.length === length) new (typeOf(given))(buffer, byteOffset, length).set(given);
    this.#call("mjenv_step", mask, byteOffset, BigInt(given.length), dtypeOf(given), this.#block);
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
    const library = this.#library;
    // If there are too many or too few actions, the library says so, and writes nothing.
    const isWhole = given.length === this.numEnvs * Number(wanted) * this.actionSize;
    const rows = isWhole ? this.numEnvs * Math.max(0, Number(wanted)) : 0;
    const count = rows * this.observationSize;
    return library.scope((scratch) => {
      const batch = scratch.allocate(mjenv_batch.size);
      const written = {
        obs: scratch.allocate(8 * count),
        reward: scratch.allocate(8 * rows),
        terminated: scratch.allocate(rows),
        truncated: scratch.allocate(rows),
      };
      const sizes = { obs_dtype: Dtype.FLOAT64, rows, obs_count: this.observationSize };
      library.write(batch, mjenv_batch, { ...sizes, ...written });
      this.#call("mjenv_rollout", given, dtypeOf(given), wanted, batch);
      return {
        observations: library.array(Float64Array, written.obs, count),
        rewards: library.array(Float64Array, written.reward, rows),
        terminated: library.array(Uint8Array, written.terminated, rows),
        truncated: library.array(Uint8Array, written.truncated, rows),
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
    // If they are too many or too few, the library says so, and writes nothing.
    const room = Number(pairs) <= from.length ? Math.max(0, Number(pairs)) : 0;
    return this.#library.scope((scratch) => {
      const rewards = scratch.allocate(8 * room);
      this.#call("mjenv_compute_reward", scratch.copy(from), to, rewards, pairs);
      return this.#library.array(Float64Array, rewards, room);
    });
  }

  /** Computes `observations` and `arrays` of the present states, for instance after `restore`. */
  observe() {
    this.#call("mjenv_observe", this.#block);
  }

  // ---- Resets and steps whose outputs the program computes ("Batch-v0") ----

  /**
   * Begins new episodes, and writes `arrays`. Then compute the observations and call `finish`.
   *
   * @param {{ qpos?: ArrayLike<number>; qvel?: ArrayLike<number> } & Only} [settings] the positions and velocities of all
   *   rows; the model's if left out
   */
  begin({ qpos, qvel, ...settings } = {}) {
    const [q, v] = [qpos && doubles(qpos, "positions"), qvel && doubles(qvel, "velocities")];
    this.#call("mjenv_begin", this.#rows("begin", settings), q, v, this.#block);
  }

  /**
   * The actions that the task sees in the next step: transformed, delayed and with noise. Changes nothing.
   *
   * @param {ArrayLike<number>} actions as for `step`
   * @param {Only} [settings] the numbers of other rows are 0
   * @returns {Float64Array | Float32Array}
   */
  act(actions, settings = {}) {
    const given = numbers(actions, "actions");
    const mask = this.#rows("act", settings);
    return this.#library.scope((scratch) => {
      const seen = scratch.copy(given.slice().fill(0));
      this.#call("mjenv_act", mask, given, dtypeOf(given), seen);
      given.set(new (typeOf(given))(this.#library.buffer, seen, given.length));
      return given;
    });
  }

  /**
   * Simulates a step, and writes `arrays` and `wasReset`. The rows of `wasReset` were not stepped: call `begin` for them.
   * Then compute the outputs and call `finish`.
   *
   * @param {ArrayLike<number>} actions as for `step`
   * @param {{ ctrl?: ArrayLike<number> } & Only} [settings] `ctrl`: what the program makes of the actions of all rows;
   *   the actions if left out
   */
  advance(actions, { ctrl, ...settings } = {}) {
    const [given, made] = [numbers(actions, "actions"), ctrl && doubles(ctrl, "ctrl")];
    this.#call("mjenv_advance", this.#rows("advance", settings), given, dtypeOf(given), made, this.#block);
  }

  /**
   * Ends the step or reset with what the program has computed, and writes the outputs. What is left out is 0.
   *
   * @param {Computed | null} computed null: gives the step up
   * @param {Only} [settings]
   */
  finish(computed, settings = {}) {
    const { observations, rewards, terminated, infos, resetInfos, ...unknown } = computed ?? {};
    refuseOthers(unknown, "finish");
    const sizes = {
      rows: this.numEnvs,
      obs_count: Math.floor((observations?.length ?? 0) / this.numEnvs),
      info_count: sum(this.#fields.info),
      reset_info_count: sum(this.#fields.reset_info),
    };
    /** @type {(values: ArrayLike<number> | undefined, each: number, what: string, copy?: typeof doubles | typeof bytes) => any} */
    const list = (values, each, what, copy = doubles) => {
      if (values) checkLength(values, each * this.numEnvs, `list of ${what}`, "are needed");
      return values && copy(values, what);
    };
    const lists = Object.entries({
      obs: list(observations, sizes.obs_count, "observations"),
      reward: list(rewards, 1, "rewards"),
      terminated: list(terminated, 1, "terminated", bytes),
      info: list(infos, sizes.info_count, "infos"),
      reset_info: list(resetInfos, sizes.reset_info_count, "resetInfos"),
    });
    const mask = this.#rows("finish", settings);
    this.#library.scope((scratch) => {
      const given = scratch.allocate(mjenv_batch.size);
      const placed = lists.map(([name, values]) => [name, values ? scratch.copy(values) : 0]);
      const batch = { obs_dtype: Dtype.FLOAT64, ...sizes, ...Object.fromEntries(placed) };
      this.#library.write(given, mjenv_batch, batch);
      this.#call("mjenv_finish", mask, computed ? given : 0, this.#block);
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
    return this.#library.sized(Uint8Array, "mjenv_snapshot", this.#open, int64(row, "the row"));
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
    this.#call("mjenv_restore", int64(row, "the row"), bytes(image, "bytes of the image"));
  }

  /** Copies a row to others. @param {number} from @param {Only} [settings] the rows to overwrite */
  copyRow(from, settings = {}) {
    const row = int64(from, "the row");
    this.#call("mjenv_copy_row", this.#rows("copyRow", settings), row);
  }

  /**
   * Reads an array of MuJoCo by its name there: "qpos", "geom_xpos", "body_mass", "nq", "opt.timestep".
   * `fields("data")` and `fields("model")` list them with their shapes.
   *
   * @param {string} name
   * @param {number} [row]
   */
  read(name, row = 0) {
    return this.#library.sized(Float64Array, "mjenv_read", this.#open, int64(row, "the row"), String(name));
  }

  /**
   * Writes an array of MuJoCo: "xfrc_applied", "body_mass", "opt.gravity". Values of the model stay after resets; a
   * reset clears the inputs of the data.
   *
   * @param {string} name
   * @param {ArrayLike<number>} values all elements of the array, which each row gets; or those of each row, row after
   *   row
   * @param {Only} [settings]
   */
  write(name, values, settings = {}) {
    const [array, given] = [String(name), doubles(values, "values")];
    this.#call("mjenv_write", this.#rows("write", settings), array, given);
  }

  /**
   * Sets the positions and velocities of a row, as Gymnasium's `set_state` does.
   *
   * @param {ArrayLike<number>} qpos
   * @param {ArrayLike<number>} qvel
   * @param {number} [row]
   */
  setState(qpos, qvel, row = 0) {
    this.#call("mjenv_set_state", int64(row, "the row"), doubles(qpos, "qpos"), doubles(qvel, "qvel"));
  }

  /**
   * Makes MuJoCo compute what it computes from masses, sizes and the like when it loads a model (mj_setConst). Reset
   * the rows or set their states afterwards.
   *
   * @param {Only} [settings]
   */
  setConstants(settings = {}) {
    this.#call("mjenv_set_constants", this.#rows("setConstants", settings));
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
    const library = this.#library;
    const number = numberOf(Role, role, "role");
    return Array.from({ length: Number(library.functions.mjenv_field_count(this.#open, number)) }, (_, index) => {
      const field = library.filled(mjenv_field, "mjenv_field_at", this.#open, number, BigInt(index));
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
    const [library, kind] = [this.#library, String(type)];
    const length = library.out("int64", "mjenv_object_count", this.#open, kind);
    return Array.from({ length }, (_, index) =>
      library.text(library.out("uint32", "mjenv_object_name", this.#open, kind, BigInt(index))),
    );
  }

  /** The index of the object of this type and name. @param {string} type @param {string} name */
  objectIndex(type, name) {
    return this.#library.out("int64", "mjenv_object_index", this.#open, String(type), String(name));
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
    this.#call("mjenv_randomize", text);
  }

  /** The document of all parts that are set, as JSON. */
  get randomization() {
    return this.#library.text(this.#library.out("uint32", "mjenv_randomization", this.#open));
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

  /** A copy of the mask that a caller has given. @param {string} method @param {Only} settings */
  #chosen(method, { mask, ...others }) {
    refuseOthers(others, method);
    return mask === undefined || mask === null ? undefined : flags(mask, this.numEnvs);
  }

  /**
   * Writes a mask where the library reads it, and returns its address; 0 if there is none.
   *
   * @param {Uint8Array | undefined} mask not in the library's memory
   */
  #place(mask) {
    if (!mask) return 0;
    this.#view("mask").set(mask);
    return this.#places.mask.pointer;
  }

  /** @param {string} method @param {Only} settings */
  #rows(method, settings) {
    return this.#place(this.#chosen(method, settings));
  }
}

/** The 64-bit words of a seed, the least significant first. @param {bigint} seed */
function wordsOf(seed) {
  const words = [];
  for (let rest = seed; rest > 0n; rest >>= 64n) words.push(BigInt.asUintN(64, rest));
  return words;
}

/** @param {object} others @param {string} method */
function refuseOthers(others, method) {
  const names = Object.keys(others);
  if (names.length > 0) throw new MjenvError("MJENV_E_NAME", `${method} has no setting "${names[0]}"`);
}
