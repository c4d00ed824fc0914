/** What esbuild bundles that is no script. */
declare module "*.css";
declare module "mjenv-play.wasm" {
  const bytes: Uint8Array<ArrayBuffer>;
  export default bytes;
}
