// The constructor options of an id.

import { Kind, mjenv_option } from "./abi.js";
import { doubles, int64 } from "./arguments.js";
import { MjenvError } from "./errors.js";

/** @typedef {import("./library.js").Library} Library */
/** @typedef {boolean | number | string | readonly number[]} OptionValue */

const names = /** @type {const} */ ({
  [Kind.FLAG]: "flag",
  [Kind.INTEGER]: "integer",
  [Kind.REALS]: "reals",
  [Kind.STRING]: "string",
  [Kind.STRING_OR_INT]: "string or integer",
});

/**
 * What the library reports of an option.
 *
 * @typedef {object} Option
 * @property {string} name Gymnasium's name, where Gymnasium has the option
 * @property {(typeof names)[keyof typeof names]} type
 * @property {OptionValue} default of a flag a boolean; of several numbers an array
 * @property {number} min the lowest value of each number; -Infinity if there is none
 * @property {number} max the highest value of each number; Infinity if there is none
 * @property {number} count how many numbers a "reals" holds
 * @property {string[]} choices the valid texts; empty if there is no such list
 * @property {string} doc the meaning, in one line
 */

/**
 * Calls `use` with the options of an id, at their defaults.
 *
 * @template T
 * @param {Library} library
 * @param {string} id
 * @param {(options: number) => T} use
 */
export function withOptions(library, id, use) {
  const options = library.out("uint32", "mjenv_options_create", String(id));
  try {
    return use(options);
  } finally {
    library.functions.mjenv_options_destroy(options);
  }
}

/** @param {Library} library @param {number} options @returns {Option[]} */
export function describeOptions(library, options) {
  return Array.from({ length: Number(library.functions.mjenv_options_count(options)) }, (_, index) => {
    const found = library.filled(mjenv_option, "mjenv_options_at", options, BigInt(index));
    const name = library.text(found.name);
    const kind = /** @type {keyof typeof names} */ (found.kind);
    return {
      name,
      type: names[kind],
      default: valueOf(library, options, name, kind),
      min: found.low,
      max: found.high,
      count: found.count,
      choices: library.text(found.choices).split(" ").filter(Boolean),
      doc: library.text(found.doc),
    };
  });
}

/** @param {Library} library @param {number} options @param {string} name @param {number} kind @returns {OptionValue} */
function valueOf(library, options, name, kind) {
  if (kind === Kind.REALS) {
    const numbers = Array.from(library.sized(Float64Array, "mjenv_options_get_reals", options, name));
    return numbers.length === 1 ? numbers[0] : numbers;
  }
  const text = () => library.text(library.out("uint32", "mjenv_options_get_string", options, name));
  if (kind === Kind.STRING) return text();
  try {
    const value = library.out("int64", "mjenv_options_get_integer", options, name);
    return kind === Kind.FLAG ? value !== 0 : value;
  } catch (error) {
    if (kind === Kind.STRING_OR_INT && error instanceof MjenvError && error.code === "MJENV_E_TYPE") return text();
    throw error;
  }
}

/**
 * A copy of the value of an option that a caller has given.
 *
 * @param {string} name
 * @param {unknown} value
 * @returns {string | bigint | Float64Array}
 */
export function optionValue(name, value) {
  if (typeof value === "string") return value;
  if (typeof value === "boolean") return BigInt(value);
  if (typeof value === "bigint" || Number.isSafeInteger(value)) return int64(value, `option "${name}"`);
  if (typeof value === "number") return Float64Array.of(value);
  if (isNumbers(value)) return doubles(value, `numbers of option "${name}"`);
  throw new MjenvError(
    "MJENV_E_TYPE",
    `option "${name}" is ${value === null ? "null" : `of type ${typeof value}`}; give a boolean, a number, an array of numbers or a string`,
  );
}

/**
 * @param {Library} library
 * @param {number} options
 * @param {string} name
 * @param {string | bigint | Float64Array} value of `optionValue`
 */
export function setOption(library, options, name, value) {
  const kind = typeof value === "string" ? "string" : typeof value === "bigint" ? "integer" : "reals";
  library.call(`mjenv_options_set_${kind}`, options, name, value);
}

/** @param {unknown} value @returns {value is ArrayLike<number>} */
function isNumbers(value) {
  const list =
    ArrayBuffer.isView(value) && !(value instanceof DataView) ? Array.from(/** @type {any} */ (value)) : value;
  return Array.isArray(list) && list.every((element) => typeof element === "number");
}
