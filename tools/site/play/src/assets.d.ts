/** What esbuild bundles that is no script. */
declare module "*.css";
declare module "mjenv-suite.wasm" {
  const bytes: Uint8Array<ArrayBuffer>;
  export default bytes;
}
