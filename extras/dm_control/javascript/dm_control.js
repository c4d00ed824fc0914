/** Where the module with dm_control's suite is: `await load({ wasm })` of the package "mjenv" has its ids, too. */
export const wasm = new URL("./mjenv-dm_control.wasm", import.meta.url);
