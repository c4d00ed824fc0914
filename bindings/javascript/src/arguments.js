// Checks and copies what callers pass. A caller may pass views of the library's memory, such as `env.terminated`. These
// become empty when that memory grows, as any allocation in it may cause. So callers' arrays are copied first.

import { MjenvError } from "./errors.js";

/** WebAssembly's addresses and sizes have 32 bits, and larger numbers would wrap. */
export const MAX_SIZE = 2 ** 32 - 1;

/** An integer of any size. @param {unknown} value @param {string} what */
export function integer(value, what) {
  if (typeof value === "bigint" || Number.isSafeInteger(value)) return BigInt(/** @type {number} */ (value));
  throw new MjenvError("MJENV_E_VALUE", `${what} is ${String(value)}, which is not an integer`);
}

/** An integer that C's int64_t holds. @param {unknown} value @param {string} what */
export function int64(value, what) {
  const given = integer(value, what);
  if (BigInt.asIntN(64, given) === given) return given;
  throw new MjenvError("MJENV_E_VALUE", `${what} is ${given}, which does not fit into 64 bits`);
}

/** @type {(values: ArrayLike<number>, what: string) => Float64Array} */
export const doubles = (values, what) => copied(Float64Array, values, what);

/** @type {(values: ArrayLike<number>, what: string) => Uint8Array} */
export const bytes = (values, what) => copied(Uint8Array, values, what);

/** @type {(values: ArrayLike<number>, what: string) => Float32Array | Float64Array} the first of a Float32Array */
export const numbers = (values, what) =>
  values instanceof Float32Array ? copied(Float32Array, values, what) : doubles(values, what);

/** A mask with a 1 for each chosen row. @param {ArrayLike<number | boolean>} mask @param {number} rows */
export function flags(mask, rows) {
  checkLength(mask, rows, "mask", "rows are there");
  return Uint8Array.from({ length: rows }, (_, row) => (mask[row] ? 1 : 0));
}

/** @param {ArrayLike<unknown>} values @param {number} length @param {string} what @param {string} wanted */
export function checkLength(values, length, what, wanted) {
  const given = lengthOf(values, what);
  if (given !== length)
    throw new MjenvError("MJENV_E_SIZE", `the ${what} has ${given} elements, but ${length} ${wanted}`);
}

/** @param {ArrayLike<unknown>} values @param {string} what */
function lengthOf(values, what) {
  const length = typeof values === "object" ? values?.length : undefined;
  if (typeof length !== "number") throw new MjenvError("MJENV_E_TYPE", `what was given as ${what} is no array`);
  return length;
}

/**
 * @template {Float64ArrayConstructor | Float32ArrayConstructor | Uint8ArrayConstructor} Type
 * @param {Type} type
 * @param {ArrayLike<number>} values
 * @param {string} what
 * @returns {InstanceType<Type>}
 */
function copied(type, values, what) {
  const length = lengthOf(values, what);
  if (!(length * type.BYTES_PER_ELEMENT <= MAX_SIZE))
    throw new MjenvError("MJENV_E_SIZE", `there are ${length} ${what}, more than the library's memory can hold`);
  try {
    return /** @type {InstanceType<Type>} */ (type.from(values));
  } catch (error) {
    if (error instanceof TypeError)
      throw new MjenvError("MJENV_E_TYPE", `the ${what} are no numbers: ${error.message}`);
    if (error instanceof RangeError)
      throw new MjenvError("MJENV_E_MEMORY", `there is no memory for ${length} ${what}: ${error.message}`);
    throw error;
  }
}
