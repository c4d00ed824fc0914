/** A slider for each actuator, and two keys that push it up and down. They add to what the policy does. */

import { element } from "./elements.js";
import type { Episode } from "./episode.js";

/** Pairs on three rows of the keyboard, by their place: the upper key pushes up. From the eleventh on with Shift. */
const KEYS = ["QA", "WS", "ED", "RF", "TG", "YH", "UJ", "IK", "OL"];

interface Actuator {
  slider: HTMLInputElement;
  mark: HTMLElement;
}

export class Actions {
  private actuators: Actuator[] = [];
  private episode: Episode | undefined;
  /** The actuators that keys push now, and whether up (1) or down (-1). */
  private readonly held = new Map<string, [actuator: number, sign: number]>();

  constructor(private readonly list: HTMLElement) {
    addEventListener("keydown", (event) => this.press(event));
    addEventListener("keyup", (event) => this.release(event.code));
    addEventListener("blur", () => this.releaseAll());
  }

  show(episode: Episode, names: string[]): void {
    this.episode = episode;
    this.held.clear();
    this.actuators = [];
    this.list.replaceChildren(...names.map((name, index) => this.row(name, index)));
    this.add();
  }

  /** Marks what the robot did in the last step. */
  mark(): void {
    const { episode } = this;
    if (!episode) return;
    const { actionLow: low, actionHigh: high } = episode.env;
    this.actuators.forEach(({ mark }, i) => {
      mark.style.left = `${(100 * (episode.action[i] - low[i])) / (high[i] - low[i])}%`;
    });
  }

  private row(name: string, index: number): HTMLElement {
    const { actionLow, actionHigh } = this.episode!.env;
    const [low, high] = [actionLow[index], actionHigh[index]].map((x) => Math.min(Math.max(x, -1e3), 1e3));
    const slider = element("input", { type: "range", min: String(low), max: String(high), step: "any", value: "0" });
    slider.id = `action-${index}`;
    slider.oninput = () => this.add();
    slider.ondblclick = () => {
      slider.value = "0";
      this.add();
    };
    const label = element("label", { htmlFor: slider.id, textContent: name });
    const keys = element("span", { className: "keys" });
    keys.append(...keysOf(index).map((key) => element("kbd", { textContent: key })));
    const mark = element("span", { className: "mark" });
    const track = element("div", { className: "track" });
    track.append(mark, slider);
    const row = element("div", { className: "actuator" });
    row.append(label, keys, track);
    this.actuators.push({ slider, mark });
    return row;
  }

  private press(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey || isWriting(event.target)) return;
    const pair = KEYS.findIndex((keys) => event.code === `Key${keys[0]}` || event.code === `Key${keys[1]}`);
    const actuator = pair + (event.shiftKey ? KEYS.length : 0);
    if (pair < 0 || actuator >= this.actuators.length) return;
    event.preventDefault();
    this.held.set(event.code, [actuator, event.code === `Key${KEYS[pair][0]}` ? 1 : -1]);
    this.add();
  }

  private release(code: string): void {
    if (this.held.delete(code)) this.add();
  }

  private releaseAll(): void {
    this.held.clear();
    this.add();
  }

  /** The sum of the sliders and the keys. */
  private add(): void {
    const { episode } = this;
    if (!episode) return;
    this.actuators.forEach(({ slider }, i) => (episode.added[i] = Number(slider.value)));
    for (const [actuator, sign] of this.held.values()) {
      const slider = this.actuators[actuator].slider;
      episode.added[actuator] += Number(sign > 0 ? slider.max : slider.min);
    }
  }
}

function keysOf(index: number): string[] {
  const pair = KEYS[index % KEYS.length];
  return index < 2 * KEYS.length ? Array.from(pair, (key) => (index < KEYS.length ? key : `⇧${key}`)) : [];
}

/** Whether the keys write into a field. */
export function isWriting(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return !["range", "checkbox"].includes(target.type);
  return target instanceof HTMLSelectElement;
}
