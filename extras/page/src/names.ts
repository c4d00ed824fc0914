/** What the actuators and the elements of the observation are called. */

import type { Env } from "mjenv";

export const actuatorNames = (env: Env): string[] => env.fields("action").map(({ name }) => name);

export const observationNames = (env: Env): string[] =>
  env
    .fields("observation")
    .flatMap(({ name, count }) => Array.from({ length: count }, (_, i) => (count === 1 ? name : `${name}[${i}]`)));
