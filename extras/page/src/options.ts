/** A form of the options that the library reports: sliders, checkboxes and lists, each with what it says of them. */

import type { Option } from "mjenv";
import { element } from "./elements.js";

/** The text of each option that differs from its default. */
export type Texts = Record<string, string>;

/**
 * Options that change nothing on this page: there is one row on one thread, the plots read what they show, visitors have
 * no models of their own, the module computes in the same way on each CPU, and the page draws its own colours.
 */
const WITHOUT_EFFECT = new Set([
  "num_threads",
  "lanes",
  "cpu_affinity",
  "arrays",
  "max_contacts",
  "xml_string",
  "trust_xml",
  "norm",
  "visualize_reward",
]);

export const hasEffect = ({ name }: Option) => !WITHOUT_EFFECT.has(name);

/** How many times the default the slider of an option without bounds goes to. */
const REACH = 4;
const STEPS = 200;

/** What the library does not take as a text: the value for make(). */
export function value(option: Option, text: string): unknown {
  switch (option.type) {
    case "flag":
      return text === "1";
    case "reals": {
      const list = text.split(",").map(number);
      return option.count === 1 ? list[0] : list;
    }
    case "integer":
      return number(text);
    case "string or integer":
      return /^\d+$/.test(text) ? Number(text) : text;
    default:
      return text;
  }
}

export function textOf(value: unknown): string {
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value === "object") return Array.from(value as Iterable<number>, format).join(",");
  return typeof value === "number" ? format(value) : String(value ?? "");
}

const number = (text: string) => Number(text.trim().replace(/^([+-]?)inf(inity)?$/i, "$1Infinity") || "NaN");
const format = (x: number) => String(x).replace("Infinity", "inf");

export class Options {
  private texts: Texts = {};
  private options: Option[] = [];
  private timer = 0;

  /** `changed` builds the environment anew; what it throws is shown. */
  constructor(
    private readonly own: HTMLElement,
    private readonly others: HTMLElement,
    private readonly problem: HTMLElement,
    private readonly changed: (texts: Texts) => void,
  ) {}

  /** Shows the options of a robot; those that each robot has come last. */
  show(options: Option[], common: Set<string>, texts: Texts): void {
    this.options = options;
    this.texts = { ...texts };
    const fields = (isCommon: boolean) =>
      options.filter(({ name }) => common.has(name) === isCommon).map((option) => this.field(option));
    this.own.replaceChildren(...fields(false));
    this.others.replaceChildren(...fields(true));
    this.problem.textContent = "";
  }

  /** The values that differ from their defaults, for make(). */
  values(texts: Texts): Record<string, unknown> {
    const values: Record<string, unknown> = {};
    for (const option of this.options)
      if (option.name in texts) values[option.name] = value(option, texts[option.name]);
    return values;
  }

  private set(option: Option, text: string): void {
    if (text === textOf(option.default)) delete this.texts[option.name];
    else this.texts[option.name] = text;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      try {
        this.changed({ ...this.texts });
        this.problem.textContent = "";
      } catch (error) {
        this.problem.textContent = error instanceof Error ? error.message : String(error);
      }
    }, 150);
  }

  private field(option: Option): HTMLElement {
    const text = this.texts[option.name] ?? textOf(option.default);
    const field = element("div", { className: "option" });
    const id = `option-${option.name}`;
    const label = element("label", { htmlFor: id, textContent: option.name.replaceAll("_", " ") });
    const doc = element("p", { className: "doc", id: `${id}-doc`, textContent: describe(option) });
    const back = element("button", { type: "button", className: "plain", textContent: "Default" });
    back.setAttribute("aria-label", `Default of ${option.name}`);
    const set = (text: string) => {
      this.set(option, text);
      back.hidden = text === textOf(option.default);
    };
    back.hidden = !(option.name in this.texts);
    back.onclick = () => {
      set(textOf(option.default));
      field.replaceWith(this.field(option));
    };
    const head = element("div", { className: "head" });
    head.append(label, back);
    field.append(head, ...inputs(option, text, id, set), doc);
    for (const input of field.querySelectorAll("input, select")) input.setAttribute("aria-describedby", doc.id);
    return field;
  }
}

function describe({ doc, min, max, type }: Option): string {
  const bounds = [min > -Infinity && `at least ${min}`, max < Infinity && `at most ${max}`].filter(Boolean);
  const hasBounds = (type === "integer" || type === "reals") && bounds.length > 0;
  return `${doc[0].toUpperCase()}${doc.slice(1)}${hasBounds ? ` (${bounds.join(", ")})` : ""}`;
}

function inputs(option: Option, text: string, id: string, set: (text: string) => void): HTMLElement[] {
  if (option.type === "flag") {
    const box = element("input", { type: "checkbox", id, checked: text === "1" });
    box.onchange = () => set(box.checked ? "1" : "0");
    return [box];
  }
  if (option.choices.length) {
    const list = element("select", { id });
    list.append(
      ...option.choices.map((choice) => element("option", { textContent: choice, selected: choice === text })),
    );
    list.onchange = () => set(list.value);
    return [list];
  }
  if (option.type === "reals" || option.type === "integer") return sliders(option, text, id, set);
  const line = element("input", { id });
  line.value = text;
  line.spellcheck = false;
  line.onchange = () => set(line.value);
  return [line];
}

/** A slider and a text for each number. */
function sliders(option: Option, text: string, id: string, set: (text: string) => void): HTMLElement[] {
  const defaults = textOf(option.default).split(",").map(number);
  const words = text.split(",");
  return words.map((word, index) => {
    const name = words.length > 1 ? `${option.name}, ${index === 0 ? "low" : "high"}` : option.name;
    const [low, high] = reach(option, defaults[index]);
    const slider = element("input", { type: "range", min: String(low), max: String(high) });
    slider.step = option.type === "integer" ? "1" : String((high - low) / STEPS);
    slider.value = word.replace("inf", "1e308");
    slider.id = index === 0 ? id : `${id}-${index}`;
    slider.setAttribute("aria-label", name);
    const line = element("input", { inputMode: "decimal", className: "number", value: word });
    line.setAttribute("aria-label", `${name}, as a number`);
    const change = (to: string) => {
      words[index] = to;
      set(words.join(","));
    };
    slider.oninput = () => change((line.value = String(Number(Number(slider.value).toPrecision(4)))));
    line.onchange = () => {
      slider.value = line.value;
      change(line.value);
    };
    const row = element("div", { className: "slider" });
    row.append(slider, line);
    return row;
  });
}

/** From where to where the slider goes: within the bounds, and as far as makes sense where there are none. */
function reach({ min, max, type }: Option, usual: number): [number, number] {
  const far = Number.isFinite(usual) && usual !== 0 ? REACH * Math.abs(usual) : 1;
  const low = usual < 0 ? -far : Math.max(min, usual === 0 && type === "reals" ? -far : 0);
  return [Math.max(low, min), Math.min(far, max)];
}
