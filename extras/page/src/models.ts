/** The models of tasks whose model is a file beside their source. A page has no files, so it passes the text. */

import type { Mjenv } from "mjenv";

/** The texts, by the tasks' names of the files, such as "./quadruped.xml": written by build.js. */
declare const MODELS: Record<string, string | undefined>;

/** The option with the model of an id, if the page has it. */
export function modelOption(mjenv: Mjenv, id: string): { xml_string?: string } {
  const file = mjenv.options(id).find(({ name }) => name === "xml_file")?.default;
  const text = MODELS[String(file)];
  return text === undefined ? {} : { xml_string: text };
}
