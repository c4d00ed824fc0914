/** The address of the page holds what it shows: #robot=Ant-v5&seed=3&set.ctrl_cost_weight=0.1 */

export interface Shown {
  robot: string;
  seed: number;
  /** False: only the keys and the sliders act. */
  policy: boolean;
  speed: number;
  /** The options that differ from their defaults, as the texts of the form. */
  options: Record<string, string>;
}

// An option of a task may be called "seed", so the options have a prefix.
const OPTION = "set.";

export function format(shown: Shown): string {
  const words = new URLSearchParams({ robot: shown.robot, seed: String(shown.seed) });
  if (!shown.policy) words.set("policy", "off");
  if (shown.speed !== 1) words.set("speed", String(shown.speed));
  for (const [name, text] of Object.entries(shown.options)) words.set(OPTION + name, text);
  return `#${words}`;
}

/** Reads an address. What it lacks, or what is no number there, is left out. */
export function parse(hash: string): Partial<Shown> & Pick<Shown, "options"> {
  const words = new URLSearchParams(hash.replace(/^#/, ""));
  const shown: Partial<Shown> & Pick<Shown, "options"> = { options: {} };
  const robot = words.get("robot");
  const seed = Number(words.get("seed") ?? NaN);
  const speed = Number(words.get("speed") ?? NaN);
  if (robot) shown.robot = robot;
  if (isSeed(seed)) shown.seed = seed;
  if (speed > 0 && speed <= 16) shown.speed = speed;
  if (words.has("policy")) shown.policy = words.get("policy") !== "off";
  for (const [name, text] of words) if (name.startsWith(OPTION)) shown.options[name.slice(OPTION.length)] = text;
  return shown;
}

export const isSeed = (seed: number) => Number.isSafeInteger(seed) && seed >= 0;
