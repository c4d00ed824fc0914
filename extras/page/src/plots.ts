/** The last steps of an episode as curves: the terms of the reward, and the observation. */

import uPlot from "uplot";
import type { Env } from "mjenv";
import { element } from "./elements.js";
import type { Episode } from "./episode.js";

/** How many steps the plots show. */
const STEPS = 300;
const HEIGHT = 150;
const COLOURS = ["#0f9d8a", "#d9822b", "#5b7fd6", "#c2527a", "#7a9a3a", "#8d6cc9", "#a0765b", "#4aa3c7"];
/** Gymnasium's names for the terms of a reward. Other infos can be shown, too. */
const TERM = /^reward_|_penalty$/;

/** Curves over the simulated time. */
class Curves {
  private plot: uPlot | undefined;
  private data: number[][] = [];

  constructor(private readonly place: HTMLElement) {
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(place);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plot?.redraw());
  }

  begin(names: string[], isShown: (name: string) => boolean): void {
    this.plot?.destroy();
    this.data = [[], ...names.map(() => [])];
    const axis = {
      stroke: () => getComputedStyle(this.place).color,
      grid: { stroke: "#8888884d", width: 1 },
      ticks: { show: false },
      font: "11px system-ui, sans-serif",
    };
    const series = names.map((name, index) => ({
      label: name.replaceAll("_", " "),
      stroke: COLOURS[index % COLOURS.length],
      width: 1.5,
      show: isShown(name),
      value: (_: uPlot, y: number | null) => (y === null ? "" : y.toPrecision(3)),
    }));
    const time = { label: "time", value: (_: uPlot, x: number | null) => (x === null ? "" : `${x.toFixed(2)} s`) };
    const options: uPlot.Options = {
      ...this.size(),
      series: [time, ...series],
      scales: { x: { time: false } },
      axes: [
        { ...axis, size: 24 },
        { ...axis, size: 44 },
      ],
      cursor: { y: false, points: { size: 6 } },
      legend: { live: true },
    };
    this.plot = new uPlot(options, this.data as uPlot.AlignedData, this.place);
  }

  add(time: number, values: ArrayLike<number>): void {
    this.data.forEach((column, index) => {
      column.push(index === 0 ? time : values[index - 1]);
      if (column.length > STEPS) column.shift();
    });
  }

  clear(): void {
    for (const column of this.data) column.length = 0;
  }

  draw(): void {
    this.plot?.setData(this.data as uPlot.AlignedData);
  }

  private size(): { width: number; height: number } {
    return { width: Math.max(this.place.clientWidth, 100), height: HEIGHT };
  }
}

export class Rewards {
  private readonly curves: Curves;
  private names: string[] = [];

  constructor(private readonly place: HTMLElement) {
    this.curves = new Curves(place);
  }

  begin(env: Env): void {
    const infos = Object.keys(env.info);
    this.names = infos.filter((name) => TERM.test(name)).concat(infos.filter((name) => !TERM.test(name)));
    this.names = this.names.filter((name) => env.info[name].length === 1);
    this.curves.begin(["reward", ...this.names], (name) => name === "reward" || TERM.test(name));
    this.place.setAttribute("aria-label", `Curves of the reward and of its terms ${this.names.join(", ")}`);
  }

  add(episode: Episode): void {
    this.curves.add(episode.time, [episode.reward, ...this.names.map((name) => episode.env.info[name][0])]);
  }

  get isVisible(): boolean {
    return this.place.offsetParent !== null;
  }

  clear = () => this.curves.clear();
  draw = () => this.curves.draw();
}

/** All elements of the observation as a picture with a row for each, and one of them as a curve. */
export class Observation {
  private readonly curves: Curves;
  private readonly canvas = element("canvas", { tabIndex: 0 });
  private readonly curve = element("div", { className: "curves" });
  private readonly history: Float64Array[] = [];
  private readonly times: number[] = [];
  private names: string[] = [];
  private chosen = 0;

  constructor(place: HTMLElement) {
    this.curve.setAttribute("role", "img");
    this.canvas.className = "rows";
    this.canvas.setAttribute("role", "slider");
    place.append(this.canvas, this.curve);
    this.curves = new Curves(this.curve);
    this.canvas.onpointerdown = (event) => {
      const { top, height } = this.canvas.getBoundingClientRect();
      this.choose(Math.floor((this.names.length * (event.clientY - top)) / height));
    };
    this.canvas.onkeydown = (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
      if (!step) return;
      event.preventDefault();
      this.choose(this.chosen + step);
    };
  }

  get isVisible(): boolean {
    return this.canvas.offsetParent !== null;
  }

  begin(names: string[]): void {
    this.names = names;
    this.clear();
    this.canvas.width = STEPS;
    this.canvas.height = names.length;
    this.canvas.style.height = `${Math.min(Math.max(4 * names.length, 60), 180)}px`;
    this.canvas.setAttribute("aria-label", "Element of the observation");
    this.canvas.setAttribute("aria-valuemin", "0");
    this.canvas.setAttribute("aria-valuemax", String(names.length - 1));
    this.choose(0);
  }

  add(time: number, values: Float64Array): void {
    this.history.push(values.slice());
    this.times.push(time);
    if (this.history.length > STEPS) this.history.shift();
    if (this.times.length > STEPS) this.times.shift();
    this.curves.add(time, [values[this.chosen]]);
  }

  clear(): void {
    this.history.length = this.times.length = 0;
    this.curves.clear();
  }

  draw(): void {
    this.curves.draw();
    const pen = this.canvas.getContext("2d")!;
    const { width, height } = this.canvas;
    const picture = pen.createImageData(width, height);
    this.history.forEach((values, column) => {
      for (let row = 0; row < height; row++) {
        const size = Math.tanh(values[row]);
        picture.data.set(size > 0 ? [217, 130, 43] : [15, 157, 138], 4 * (row * width + column));
        picture.data[4 * (row * width + column) + 3] = 255 * Math.abs(size);
      }
    });
    pen.putImageData(picture, 0, 0);
    pen.fillStyle = getComputedStyle(this.canvas).color;
    pen.globalAlpha = 0.35;
    pen.fillRect(0, this.chosen, width, 1);
  }

  private choose(element: number): void {
    this.chosen = Math.min(Math.max(element, 0), this.names.length - 1);
    const name = this.names[this.chosen];
    this.canvas.setAttribute("aria-valuenow", String(this.chosen));
    this.canvas.setAttribute("aria-valuetext", name);
    this.curve.setAttribute("aria-label", `Curve of ${name}`);
    this.curves.begin([name], () => true);
    this.history.forEach((values, index) => this.curves.add(this.times[index], [values[this.chosen]]));
    this.draw();
  }
}
