// The WebAssembly module: what it asks of its host, its memory, and calls whose failures are exceptions.

import { MAX_SIZE } from "./arguments.js";
import { MjenvError } from "./errors.js";

/** @typedef {import("./abi.js").Functions} Functions */
/** @typedef {import("./abi.js").Member} Member */
/** @typedef {import("./errors.js").ErrorCode} ErrorCode */
/** @typedef {Float64Array | Float32Array | BigUint64Array | Uint8Array} List not in the library's memory */
/** @typedef {string | number | bigint | List | undefined} Argument */
/**
 * @typedef {Functions & {
 *   memory: WebAssembly.Memory;
 *   malloc(bytes: number): number;
 *   free(pointer: number): void;
 *   _initialize(): void;
 *   mjenv_register_own_tasks?: () => number;
 * }} Exports
 */

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** Reads and writes a number of each type at an address. */
const access = {
  uint8: { bytes: 1, get: "getUint8", set: "setUint8" },
  int32: { bytes: 4, get: "getInt32", set: "setInt32" },
  uint32: { bytes: 4, get: "getUint32", set: "setUint32" },
  int64: { bytes: 8, get: "getBigInt64", set: "setBigInt64" },
  uint64: { bytes: 8, get: "getBigUint64", set: "setBigUint64" },
  float32: { bytes: 4, get: "getFloat32", set: "setFloat32" },
  float64: { bytes: 8, get: "getFloat64", set: "setFloat64" },
};

/** WASI's "bad file descriptor": there are no files. */
const noFile = () => 8;

/**
 * What the module imports: the time, random bytes, and a variable of its own code for longjmp.
 *
 * @param {() => WebAssembly.Memory} memory
 */
function imports(memory) {
  let held = 0;
  return {
    env: {
      /** @param {number} pointer @param {number} bytes */
      getentropy(pointer, bytes) {
        globalThis.crypto.getRandomValues(new Uint8Array(memory().buffer, pointer >>> 0, bytes));
        return 0;
      },
      emscripten_notify_memory_growth() {},
      /** @param {number} value */
      setTempRet0(value) {
        held = value;
      },
      getTempRet0: () => held,
      __syscall_dup3: () => -8,
    },
    wasi_snapshot_preview1: {
      /** @param {number} clock @param {bigint} precision @param {number} pointer */
      clock_time_get(clock, precision, pointer) {
        const milliseconds = clock === 0 ? Date.now() : performance.now();
        new DataView(memory().buffer).setBigUint64(pointer >>> 0, BigInt(Math.round(milliseconds * 1e6)), true);
        return 0;
      },
      /** @param {number} status */
      proc_exit(status) {
        throw new Error(`the library has ended itself with status ${status}, which is a bug`);
      },
      /** @param {number} count @param {number} bytes */
      environ_sizes_get(count, bytes) {
        const view = new DataView(memory().buffer);
        view.setUint32(count >>> 0, 0, true);
        view.setUint32(bytes >>> 0, 0, true);
        return 0;
      },
      environ_get: () => 0,
      fd_read: noFile,
      fd_write: noFile,
      fd_seek: noFile,
      fd_close: noFile,
    },
  };
}

export class Library {
  /** @param {WebAssembly.Module} module */
  static async of(module) {
    // Node.js 18 has it under another name.
    if (!globalThis.crypto) {
      const { webcrypto } = await import("node:crypto");
      Object.defineProperty(globalThis, "crypto", { value: webcrypto, configurable: true });
    }
    /** @type {Exports} */
    let functions;
    const instance = await WebAssembly.instantiate(
      module,
      imports(() => functions.memory),
    );
    functions = /** @type {any} */ (instance.exports);
    functions._initialize();
    const library = new Library(functions);
    // There if the module was built with tasks (MJENV_TASK_SOURCES).
    if (functions.mjenv_register_own_tasks) library.check(functions.mjenv_register_own_tasks());
    return library;
  }

  /** @type {DataView} */
  #view = new DataView(new ArrayBuffer(0));

  /** @param {Exports} functions */
  constructor(functions) {
    this.functions = functions;
  }

  /** The library's memory. When it grows, this is another object, and views of the old one are empty. */
  get buffer() {
    return this.functions.memory.buffer;
  }

  get #memory() {
    if (this.#view.buffer !== this.buffer) this.#view = new DataView(this.buffer);
    return this.#view;
  }

  /** Throws unless the status is OK. @param {number} status what a function returned */
  check(status) {
    if (status === 0) return;
    const code = /** @type {ErrorCode} */ (this.text(this.functions.mjenv_status_name(status)));
    throw new MjenvError(code, this.text(this.functions.mjenv_last_error()));
  }

  // ---- Calls ----

  /**
   * Calls a function that returns a status.
   *
   * @param {keyof Functions} name
   * @param {Argument[]} given see `Scratch.place`
   */
  call(name, ...given) {
    this.scope((scratch) => {
      const placed = given.flatMap((value) => scratch.place(value));
      this.check(/** @type {(...placed: (number | bigint)[]) => number} */ (this.functions[name])(...placed));
    });
  }

  /**
   * The number that a function writes to the address in its last argument.
   *
   * @param {"int64" | "uint32"} type
   * @param {keyof Functions} name
   * @param {Argument[]} given
   */
  out(type, name, ...given) {
    return this.scope((scratch) => {
      const to = scratch.allocate(8);
      this.call(name, ...given, to);
      return this.number(to, type);
    });
  }

  /**
   * What a function writes that is first asked for the number of elements. Its last arguments are an array, how many
   * elements fit, and where it writes their number.
   *
   * @template {Float64Array | Uint8Array} Values
   * @param {{ new (buffer: ArrayBufferLike, pointer: number, count: number): Values; BYTES_PER_ELEMENT: number }} type
   * @param {keyof Functions} name
   * @param {Argument[]} given
   */
  sized(type, name, ...given) {
    const count = this.out("int64", name, ...given, 0, 0n);
    return this.scope((scratch) => {
      const to = scratch.allocate(type.BYTES_PER_ELEMENT * count);
      this.out("int64", name, ...given, to, BigInt(count));
      return this.array(type, to, count);
    });
  }

  /**
   * Reads a struct that a function fills, which is its last argument.
   *
   * @template {Record<string, Member>} Members
   * @param {{ size: number; members: Members }} struct of abi.js
   * @param {keyof Functions} name
   * @param {Argument[]} given
   */
  filled(struct, name, ...given) {
    return this.scope((scratch) => {
      const pointer = scratch.allocate(struct.size);
      this.write(pointer, struct);
      this.call(name, ...given, pointer);
      return this.read(pointer, struct);
    });
  }

  // ---- Memory ----

  /** Memory that belongs to the caller until `free`. @param {number} bytes */
  allocate(bytes) {
    const pointer = bytes <= MAX_SIZE ? this.functions.malloc(Math.max(bytes, 1)) >>> 0 : 0;
    if (pointer === 0) throw new MjenvError("MJENV_E_MEMORY", `there is no memory for ${bytes} bytes`);
    return pointer;
  }

  /** @param {number} pointer */
  free(pointer) {
    this.functions.free(pointer);
  }

  /**
   * Calls `body` with memory for it, which is freed when `body` returns or throws.
   *
   * @template T
   * @param {(scratch: Scratch) => T} body
   */
  scope(body) {
    const scratch = new Scratch(this);
    try {
      return body(scratch);
    } finally {
      scratch.free();
    }
  }

  /** The text at an address, or "" if it is null. @param {number} pointer */
  text(pointer) {
    if (pointer === 0) return "";
    const bytes = new Uint8Array(this.buffer);
    return decoder.decode(bytes.subarray(pointer >>> 0, bytes.indexOf(0, pointer >>> 0)));
  }

  /**
   * A copy of an array.
   *
   * @template {Float64Array | Float32Array | Uint8Array} Values
   * @param {new (buffer: ArrayBufferLike, pointer: number, count: number) => Values} type
   * @param {number} pointer
   * @param {number} count
   */
  array(type, pointer, count) {
    return /** @type {Values} */ (new type(this.buffer, pointer >>> 0, count).slice());
  }

  /** The number at an address. @param {number} pointer @param {import("./abi.js").Scalar} type */
  number(pointer, type) {
    return Number(this.#memory[/** @type {"getInt32"} */ (access[type].get)](pointer >>> 0, true));
  }

  /**
   * Makes a struct whose other members are 0.
   *
   * @template {Record<string, Member>} Members
   * @param {number} pointer
   * @param {{ size: number; members: Members }} struct of abi.js
   * @param {{ [name in keyof Members]?: number | bigint | ArrayLike<number> }} values integers, where the member is one
   */
  write(pointer, struct, values = {}) {
    new Uint8Array(this.buffer, pointer, struct.size).fill(0);
    for (const [name, value] of Object.entries({ struct_size: struct.size, ...values })) {
      const { offset, type } = struct.members[name];
      const elements = /** @type {(number | bigint)[]} */ (typeof value === "object" ? Array.from(value) : [value]);
      const { bytes, get, set } = access[type];
      elements.forEach((element, index) => {
        const given = type === "int64" || type === "uint64" ? BigInt(element) : Number(element);
        const at = pointer + offset + index * bytes;
        this.#memory[/** @type {"setInt32"} */ (set)](at, /** @type {number} */ (given), true);
        // What a type cannot hold would wrap.
        const held = this.#memory[/** @type {"getInt32"} */ (get)](at, true);
        if (!type.startsWith("float") && held !== given)
          throw new MjenvError("MJENV_E_VALUE", `${name} is ${element}, which does not fit into ${type}`);
      });
    }
  }

  /**
   * Reads a struct: numbers, and arrays of numbers.
   *
   * @template {Record<string, Member>} Members
   * @param {number} pointer
   * @param {{ size: number; members: Members }} struct of abi.js
   * @returns {{ [name in keyof Members]: Members[name]["length"] extends 0 ? number : number[] }}
   */
  read(pointer, struct) {
    /** @type {any} */
    const values = {};
    for (const [name, { offset, type, length }] of Object.entries(struct.members)) {
      const at = (/** @type {number} */ index) => this.number(pointer + offset + index * access[type].bytes, type);
      values[name] = length === 0 ? at(0) : Array.from({ length }, (_, index) => at(index));
    }
    return values;
  }
}

/** Memory for one call. */
export class Scratch {
  #library;
  /** @type {number[]} */
  #pointers = [];

  /** @param {Library} library */
  constructor(library) {
    this.#library = library;
  }

  /** @param {number} bytes */
  allocate(bytes) {
    const pointer = this.#library.allocate(bytes);
    this.#pointers.push(pointer);
    return pointer;
  }

  /**
   * C's arguments for a value: a text's address; an array's and its length, and null and 0 for one that is left out; a
   * number as it is.
   *
   * @param {Argument} value
   * @returns {(number | bigint)[]}
   */
  place(value) {
    if (value === undefined) return [0, 0n];
    if (typeof value === "string") return [this.text(value)];
    return typeof value === "object" ? [this.copy(value), BigInt(value.length)] : [value];
  }

  /** @param {string} text */
  text(text) {
    // C's text would end there.
    if (text.includes("\0")) throw new MjenvError("MJENV_E_VALUE", `${JSON.stringify(text)} contains a NUL character`);
    return this.copy(encoder.encode(`${text}\0`));
  }

  /** A copy of an array that is not in the library's memory. @param {List} values */
  copy(values) {
    const pointer = this.allocate(values.byteLength);
    const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
    new Uint8Array(this.#library.buffer, pointer, values.byteLength).set(bytes);
    return pointer;
  }

  free() {
    for (const pointer of this.#pointers) this.#library.free(pointer);
  }
}
