/** Plays episodes of the chosen robot: the page without its buttons. */

import * as THREE from "three";
import type { Env, Mjenv } from "mjenv";
import { VIEWS, type View } from "./cameras.js";
import { Episode, type Saved } from "./episode.js";
import type { Shown } from "./link.js";
import { modelOption } from "./models.js";
import { loadPolicy } from "./policies.js";
import { Pull } from "./pull.js";
import { Robot } from "./robot.js";
import type { Stage } from "./stage.js";

/** Computing takes at most this share of a second of drawing; slow machines then show the robot in slow motion. */
const BUSY = 0.04; // s for each picture
/** How long an episode that has ended stays on the screen, s. */
const REST = 1.2;

export interface Listener {
  /** Another environment. */
  built(episode: Episode): void;
  /** The state was set: by a reset or by a restore. */
  jumped(episode: Episode): void;
  stepped(episode: Episode): void;
}

export class Play {
  isPaused = false;
  readonly pull: Pull;
  episode: Episode | undefined;
  private robot: Robot | undefined;
  private isWaitingForPolicy = false;
  private saved: Saved | undefined;
  /** Simulated seconds that the clock is ahead of the last step. */
  private ahead = 0;
  private resting = 0;
  private last = 0;
  /** The robot's centre of mass before the last step, after it, and where it is shown. */
  private readonly centres = [new THREE.Vector3(), new THREE.Vector3()];
  private readonly centre = new THREE.Vector3();

  constructor(
    private readonly mjenv: Mjenv,
    private readonly stage: Stage,
    readonly shown: Shown,
    private readonly listener: Listener,
  ) {
    this.pull = new Pull(stage, () => this.robot);
  }

  /** Builds the environment of `shown`. If the library refuses the options, the one before stays. */
  build(options: Record<string, unknown>): void {
    const { robot: id } = this.shown;
    const model = "xml_file" in options ? {} : modelOption(this.mjenv, id);
    const env = this.mjenv.make(id, { ...model, ...options });
    const before = this.episode;
    const isSame = before?.env.id === id;
    this.pull.end();
    this.robot?.free();
    before?.env.free();
    this.episode = new Episode(env, isSame ? before.policy : undefined);
    this.saved = undefined;
    this.episode.reset(this.shown.seed);
    this.robot = new Robot(env);
    this.stage.scene.add(this.robot.group);
    this.jumpCentre();
    if (!isSame) this.look();
    this.listener.built(this.episode);
    this.jump();
    this.isWaitingForPolicy = !this.episode.policy;
    if (this.isWaitingForPolicy) void this.learn(this.episode);
  }

  /** The policy comes after the first picture, and the robot waits for it. */
  private async learn(episode: Episode): Promise<void> {
    const { id } = episode.env;
    const policy = await loadPolicy(id).finally(() => {
      if (this.episode?.env.id === id) this.isWaitingForPolicy = false;
    });
    if (this.episode?.env.id !== id || !policy) return;
    this.episode.policy = policy;
    this.listener.built(this.episode);
  }

  reset(seed: number): void {
    this.shown.seed = seed;
    this.episode?.reset(seed);
    this.jump();
  }

  save(): void {
    this.saved = this.episode?.save();
  }

  restore(): void {
    if (!this.saved) return;
    this.episode?.restore(this.saved);
    this.jump();
  }

  step(): void {
    const { episode } = this;
    if (!episode || episode.end) return;
    this.pull.apply(episode.env, this.robot!);
    episode.step(this.shown.policy);
    this.robot!.step();
    this.centres.reverse();
    this.readCentre();
    this.listener.stepped(episode);
  }

  /** A single step, shown at once. */
  stepOnce(): void {
    this.isPaused = true;
    this.ahead = 0;
    this.step();
    this.show(1, 0.1);
  }

  /** Called before each picture. `now` is in milliseconds. */
  frame(now: number): void {
    const elapsed = Math.min((now - this.last) / 1000, 0.25);
    this.last = now;
    const { episode } = this;
    if (episode && !this.isPaused && !this.isWaitingForPolicy) {
      if (episode.end) this.rest(elapsed);
      else this.run(episode, elapsed);
    }
    this.stage.controls.update();
  }

  private run(episode: Episode, elapsed: number): void {
    const { dt } = episode.env;
    const until = performance.now() + 1000 * BUSY;
    this.ahead += elapsed * this.shown.speed;
    while (this.ahead >= dt && !episode.end) {
      this.ahead -= dt;
      this.step();
      if (performance.now() > until) this.ahead = Math.min(this.ahead, dt);
    }
    this.show(episode.end ? 1 : this.ahead / dt, elapsed);
  }

  /** The next episode follows, with the next seed. */
  private rest(elapsed: number): void {
    this.resting += elapsed;
    if (this.resting > REST) this.reset(this.shown.seed + 1);
  }

  private show(between: number, elapsed: number): void {
    this.robot!.show(Math.min(between, 1));
    this.pull.show();
    this.centre.lerpVectors(this.centres[0], this.centres[1], Math.min(between, 1));
    this.stage.follow(this.centre, elapsed);
    this.stage.changed();
  }

  private jump(): void {
    this.ahead = this.resting = 0;
    this.robot!.jump();
    this.jumpCentre();
    this.stage.jump(this.centre);
    this.listener.jumped(this.episode!);
  }

  private look(): void {
    const { env } = this.episode!;
    const view = VIEWS[env.id.replace(/-v\d+$/, "")] ?? viewOf(env);
    this.stage.look(view, this.centre, this.robot!.floor ?? this.robot!.lowest() - 0.1 * view.distance);
  }

  /** The centre of mass of the first body with all that hangs on it. */
  private readCentre(): void {
    this.centres[1].fromArray(this.episode!.env.read("subtree_com"), 3);
  }

  private jumpCentre(): void {
    this.readCentre();
    this.centres[0].copy(this.centres[1]);
    this.centre.copy(this.centres[1]);
  }
}

/** A view for the robot of a task that this page does not know: it follows robots that can leave. */
function viewOf(env: Env): View {
  const [free, slide] = [0, 2]; // mjtJoint
  const types = env.read("jnt_type");
  const limited = env.read("jnt_limited");
  const [x, y, z] = env.read("stat.center");
  return {
    distance: 2.5 * env.read("stat.extent")[0],
    azimuth: 70,
    elevation: -20,
    lookat: [x, y, z],
    follows: types.some((type, joint) => type === free || (type === slide && !limited[joint])),
  };
}
