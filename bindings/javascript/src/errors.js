import { Status } from "./abi.js";

/** @typedef {`MJENV_${Extract<keyof typeof Status, `E_${string}`>}`} ErrorCode the name of a status in mjenv.h */

/** What the library refuses or fails at. The message is the library's, and names the cause. */
export class MjenvError extends Error {
  /** @param {ErrorCode} code @param {string} message */
  constructor(code, message) {
    super(message);
    this.name = "MjenvError";
    /** Which kind of error, "MJENV_E_VALUE" for instance. */
    this.code = code;
    /** The same as the number that the C function returned. */
    this.status = Status[/** @type {keyof typeof Status} */ (code.slice("MJENV_".length))];
  }
}
