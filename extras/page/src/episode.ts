/** One episode of an environment, with the action that was last taken and the sum of the rewards. */

import type { Env } from "mjenv";
import type { Policy } from "./policy.js";

export type End = "terminated" | "truncated" | undefined;

/** What a snapshot of the row does not hold. */
interface Count {
  steps: number;
  total: number;
  end: End;
}

export interface Saved extends Count {
  image: Uint8Array;
}

export class Episode {
  steps = 0;
  total = 0;
  end: End;
  /** What the robot did in the last step. */
  readonly action: Float32Array;
  /** What the keys and sliders add to the policy's action. */
  readonly added: Float32Array;

  constructor(
    readonly env: Env,
    public policy?: Policy,
  ) {
    this.action = new Float32Array(env.actionSize);
    this.added = new Float32Array(env.actionSize);
  }

  get reward(): number {
    return this.env.rewards[0];
  }

  /** Simulated seconds. */
  get time(): number {
    return this.steps * this.env.dt;
  }

  /** Whether the policy was trained on observations and actions like the environment's. */
  get fits(): boolean {
    return this.policy?.inputs === this.env.observationSize && this.policy.outputs === this.env.actionSize;
  }

  reset(seed: number): void {
    this.env.reset({ seed });
    this.count({ steps: 0, total: 0, end: undefined });
  }

  step(usesPolicy: boolean): void {
    if (usesPolicy && this.fits) this.policy?.act(this.env.observations, this.action);
    else this.action.fill(0);
    const { actionLow, actionHigh } = this.env;
    this.added.forEach((more, i) => {
      this.action[i] = Math.min(Math.max(this.action[i] + more, actionLow[i]), actionHigh[i]);
    });
    this.env.step(this.action);
    this.steps += 1;
    this.total += this.reward;
    if (this.env.terminated[0]) this.end = "terminated";
    else if (this.env.truncated[0]) this.end = "truncated";
  }

  save(): Saved {
    const { steps, total, end } = this;
    return { image: this.env.snapshot(), steps, total, end };
  }

  restore(saved: Saved): void {
    this.env.restore(saved.image);
    this.env.observe();
    this.count(saved);
  }

  private count({ steps, total, end }: Count): void {
    Object.assign(this, { steps, total, end });
    this.action.fill(0);
  }
}
