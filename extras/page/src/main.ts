/** The page: puts the robot, the buttons, the forms and the plots together. */

import "uplot/dist/uPlot.min.css";
import "../style.css";
import { load, MjenvError, type Mjenv, type Option } from "mjenv";
import wasm from "mjenv-play.wasm";
import { Actions, isWriting } from "./actions.js";
import { element, find } from "./elements.js";
import type { Episode } from "./episode.js";
import { format, isSeed, parse, type Shown } from "./link.js";
import { actuatorNames, observationNames } from "./names.js";
import { hasEffect, Options, type Texts } from "./options.js";
import { Play } from "./play.js";
import { Observation, Rewards } from "./plots.js";
import { Stage } from "./stage.js";

const FIRST = "Ant-v5";
/** ms between two drawings of the plots and the numbers. */
const PLOT = 100;

declare global {
  /** For the console of the browser: mjenvPlay.episode.env is the environment. */
  var mjenvPlay: Play | undefined;
}

class Page {
  private readonly robots = find("robot", HTMLSelectElement);
  private readonly seed = find("seed", HTMLInputElement);
  private readonly speed = find("speed", HTMLSelectElement);
  private readonly policy = find("policy", HTMLInputElement);
  private readonly message = find("message", HTMLElement);
  private readonly readout = find("readout", HTMLElement);
  private readonly pause = find("pause", HTMLButtonElement);
  private readonly restore = find("restore", HTMLButtonElement);
  private readonly options: Options;
  private readonly actions = new Actions(find("actions", HTMLElement));
  private readonly rewards = new Rewards(find("rewards", HTMLElement));
  private readonly observation = new Observation(find("observation", HTMLElement));
  private readonly stage = new Stage(find("picture", HTMLCanvasElement));
  private readonly shown: Shown = { robot: FIRST, seed: 0, policy: true, speed: 1, options: {} };
  private readonly play: Play;
  /** The options that each robot has. */
  private readonly common: Set<string>;
  private isPlotStale = true;

  constructor(private readonly mjenv: Mjenv) {
    this.play = new Play(mjenv, this.stage, this.shown, {
      built: (episode) => this.built(episode),
      jumped: (episode) => this.jumped(episode),
      stepped: (episode) => this.stepped(episode),
    });
    globalThis.mjenvPlay = this.play;
    this.options = new Options(
      find("options", HTMLElement),
      find("others", HTMLElement),
      find("problem", HTMLElement),
      (texts) => this.setOptions(texts),
    );
    this.common = this.listRobots();
    find("version", HTMLElement).textContent = `This is mjenv ${mjenv.version()}.`;
    this.listen();
    this.open();
  }

  /** Draws for ever. */
  run(): void {
    const frame = (now: number) => {
      this.play.frame(now);
      if (this.stage.draw() && !performance.getEntriesByName("first picture").length) performance.mark("first picture");
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    setInterval(() => this.plot(), PLOT);
  }

  private listRobots(): Set<string> {
    const ids = this.mjenv.ids().filter((id) => !id.endsWith("-v4"));
    this.robots.append(...ids.map((id) => element("option", { value: id, textContent: id })));
    const names = ids.map(
      (id) =>
        new Set(
          this.mjenv
            .options(id)
            .filter(hasEffect)
            .map(({ name }) => name),
        ),
    );
    return new Set([...names[0]].filter((name) => names.every((others) => others.has(name))));
  }

  /** Shows what the address says. */
  private open(): void {
    const { robot, ...others } = parse(location.hash);
    const ids = Array.from(this.robots.options, ({ value }) => value);
    const known = robot !== undefined && ids.includes(robot);
    if (robot !== undefined && !known) this.say(`There is no robot ${robot}.`);
    Object.assign(this.shown, { seed: 0, policy: true, speed: 1, ...others });
    this.shown.robot = known ? robot : ids.includes(FIRST) ? FIRST : ids[0];
    this.build();
  }

  private build(): void {
    const { robot, options } = this.shown;
    this.robots.value = robot;
    this.policy.checked = this.shown.policy;
    this.speed.value = String(this.shown.speed);
    const reported: Option[] = this.mjenv.options(robot).filter(hasEffect);
    this.options.show(reported, this.common, options);
    try {
      this.play.build(this.options.values(options));
    } catch (error) {
      this.fail(error);
      this.shown.options = {};
      this.options.show(reported, this.common, {});
      this.play.build({});
    }
  }

  private setOptions(texts: Texts): void {
    this.play.build(this.options.values(texts));
    this.shown.options = texts;
    this.remember();
  }

  private built(episode: Episode): void {
    const { env, fits } = episode;
    this.actions.show(episode, actuatorNames(env));
    this.rewards.begin(env);
    this.observation.begin(observationNames(env));
    this.policy.disabled = !fits;
    find("policy-note", HTMLElement).textContent = fits ? "" : reason(episode);
    this.restore.disabled = true;
  }

  private jumped(episode: Episode): void {
    this.rewards.clear();
    this.observation.clear();
    this.observation.add(episode.time, episode.env.observations);
    this.seed.value = String(this.shown.seed);
    this.say(episode.end ? ended(episode) : "");
    this.isPlotStale = true;
    this.remember();
  }

  private stepped(episode: Episode): void {
    this.rewards.add(episode);
    this.observation.add(episode.time, episode.env.observations);
    if (episode.end) this.say(ended(episode));
    this.isPlotStale = true;
  }

  private plot(): void {
    const { episode } = this.play;
    if (!episode || !this.isPlotStale) return;
    this.isPlotStale = false;
    const { time, steps, total } = episode;
    this.readout.textContent = `${time.toFixed(2)} s  ·  step ${steps}  ·  return ${total.toFixed(1)}`;
    this.actions.mark();
    for (const plot of [this.rewards, this.observation]) if (plot.isVisible) plot.draw();
  }

  /** Writes what is shown into the address. */
  private remember(): void {
    history.replaceState(null, "", format(this.shown));
  }

  private say(text: string): void {
    this.message.textContent = text;
  }

  private fail(error: unknown): void {
    this.say(error instanceof Error ? error.message : String(error));
    if (!(error instanceof MjenvError)) throw error;
  }

  private setPaused(isPaused: boolean): void {
    this.play.isPaused = isPaused;
    this.pause.textContent = isPaused ? "Play" : "Pause";
  }

  private reset(): void {
    const seed = Number(this.seed.value || "NaN");
    if (isSeed(seed)) this.play.reset(seed);
    else this.say("A seed is a whole number, 0 or more.");
  }

  private stepOnce(): void {
    this.setPaused(true);
    this.play.stepOnce();
  }

  private async copyLink(): Promise<void> {
    try {
      await navigator.clipboard.writeText(location.href);
      this.say("The link to this robot, its options and its seed is copied.");
    } catch {
      this.say("The address of this page is the link.");
    }
  }

  private listen(): void {
    const click = (id: string, act: () => void) => (find(id, HTMLButtonElement).onclick = act);
    click("pause", () => this.setPaused(!this.play.isPaused));
    click("step", () => this.stepOnce());
    click("reset", () => this.reset());
    click("save", () => {
      this.play.save();
      this.restore.disabled = false;
    });
    click("restore", () => this.play.restore());
    click("share", () => void this.copyLink());
    this.seed.onchange = () => this.reset();
    this.robots.onchange = () => {
      Object.assign(this.shown, { robot: this.robots.value, options: {} });
      this.build();
    };
    this.speed.onchange = () => {
      this.shown.speed = Number(this.speed.value);
      this.remember();
    };
    this.policy.onchange = () => {
      this.shown.policy = this.policy.checked;
      this.remember();
    };
    addEventListener("hashchange", () => this.open());
    addEventListener("keydown", (event) => this.press(event));
    document.addEventListener("toggle", () => (this.isPlotStale = true), { capture: true });
  }

  /** Keys of the player. Those of the actuators are in actions.ts. */
  private press(event: KeyboardEvent): void {
    const { target } = event;
    if (event.ctrlKey || event.altKey || event.metaKey || isWriting(target)) return;
    const isControl = target instanceof HTMLElement && target.closest("button, a, summary, input") !== null;
    if (event.key === " " && !isControl) this.setPaused(!this.play.isPaused);
    else if (event.key === ".") this.stepOnce();
    else if (event.key === "Backspace") this.reset();
    else return;
    event.preventDefault();
  }
}

/** Why no policy acts. */
function reason({ policy, env }: Episode): string {
  if (!policy) return "This robot has no policy, so only you act.";
  return `The policy needs ${policy.inputs} observed numbers, and there are ${env.observationSize}: only you act.`;
}

function ended({ end, steps }: Episode): string {
  return end === "terminated" ? `The episode ended after ${steps} steps.` : `The time is up: ${steps} steps.`;
}

async function main(): Promise<void> {
  try {
    new Page(await load({ wasm })).run();
  } catch (error) {
    find("message", HTMLElement).textContent = `The page cannot start: ${String(error)}`;
    throw error;
  }
}

void main();
