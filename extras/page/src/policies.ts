/** The policies beside the page. Each is a script: a page that is opened from a folder may read no other files. */

import { Policy } from "./policy.js";

/** The ids with a policy: written by build.js. */
declare const POLICIES: string[];

declare global {
  /** Where the scripts leave their policy, as text, by the id of its environment. */
  var mjenvPolicies: Record<string, string | undefined>;
}

globalThis.mjenvPolicies = {};

export async function loadPolicy(id: string): Promise<Policy | undefined> {
  if (!POLICIES.includes(id)) return undefined;
  await new Promise<void>((done, fail) => {
    const script = document.createElement("script");
    script.src = `policies/${id}.js`;
    script.onload = () => done();
    script.onerror = () => fail(new Error(`cannot load the policy ${script.src}`));
    document.head.append(script);
  });
  const text = globalThis.mjenvPolicies[id];
  return text === undefined ? undefined : Policy.parse(text);
}
