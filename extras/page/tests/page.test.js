// The page in a real browser. Environment variables: PAGE names the folder with the built page, SCREENSHOTS one for
// pictures.
import assert from "node:assert/strict";
import { mkdir, readdir } from "node:fs/promises";
import { join, resolve } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { launch, open, serve, show } from "./browser.js";

const FOLDER = resolve(process.env.PAGE);
const SCREENSHOTS = resolve(process.env.SCREENSHOTS);
/**
 * All of Gymnasium's, and the quadruped of examples/tasks. Those that can fall, or lose the pole, end their episode when
 * they do.
 */
const ROBOTS = [
  "Ant-v5",
  "HalfCheetah-v5",
  "Hopper-v5",
  "Humanoid-v5",
  "HumanoidStandup-v5",
  "InvertedDoublePendulum-v5",
  "InvertedPendulum-v5",
  "Pusher-v5",
  "QuadrupedVelocity-v0",
  "Reacher-v5",
  "Swimmer-v5",
  "Walker2d-v5",
];
/** Of dm_control's suite: how many tasks there are, and those with a policy. */
const TASKS = 46;
const PLAYED = (await readdir(new URL("../../curricula/policies/dm_control", import.meta.url))).map(
  (name) => `dm_control/${name.replace(".txt", "")}`,
);
const SECONDS = 5;

let server, browser;

before(async () => {
  await mkdir(SCREENSHOTS, { recursive: true });
  server = await serve(FOLDER);
  browser = await launch();
});

after(async () => {
  await browser.close();
  server.close();
});

const url = (hash) => `${server.address}/index.html${hash}`;

/** Runs a test with a tab of its own, in which nothing may fail and nothing may be asked of other hosts. */
function pageTest(name, hash, settings, body) {
  test(name, async () => {
    const { page, errors, strangers } = await open(browser, server.address, settings);
    try {
      await body(page, await show(page, url(hash)));
      assert.deepEqual(errors, []);
      assert.deepEqual(strangers, []);
    } finally {
      await page.context().close();
    }
  });
}

/** What the simulation is at. */
const state = (page) =>
  page.evaluate(() => {
    const { episode } = mjenvPlay;
    const { env, steps, total, end } = episode;
    return { steps, total, end, qpos: [...env.read("qpos")], qvel: [...env.read("qvel")], action: [...episode.action] };
  });

async function pause(page) {
  await page.getByRole("button", { name: "Pause" }).click();
  await page.getByRole("button", { name: "Play" }).waitFor();
}

async function step(page, times = 1) {
  for (let i = 0; i < times; i++) await page.getByRole("button", { name: "Step" }).click();
  return state(page);
}

async function reset(page, seed) {
  await page.getByLabel("Seed").fill(String(seed));
  await page.getByRole("button", { name: "Reset", exact: true }).click();
  return state(page);
}

const hasPolicy = (page) => page.waitForFunction(() => mjenvPlay.episode.fits);

pageTest("each robot moves and stays up", `#robot=${ROBOTS[0]}&speed=4`, {}, async (page, seconds) => {
  console.log(`the first picture comes ${seconds.toFixed(2)} s after the navigation`);
  const listed = await page.getByLabel("Robot", { exact: true }).locator("option").allTextContents();
  assert.deepEqual(listed.slice(0, ROBOTS.length), ROBOTS);
  assert.equal(listed.filter((id) => id.startsWith("dm_control/")).length, TASKS);
  assert.equal(listed.length, ROBOTS.length + TASKS);
  assert.ok(PLAYED.length > 0);
  for (const robot of [...ROBOTS, ...PLAYED]) {
    await page.getByLabel("Robot", { exact: true }).selectOption(robot);
    await hasPolicy(page);
    // Paused: the short episodes are over before a slow machine has read how they began.
    await pause(page);
    const start = await reset(page, 0);
    await page.getByRole("button", { name: "Play" }).click();
    // Read at once: the next episode, of another seed, begins while a slow machine takes the picture.
    const reached = await page.waitForFunction((seconds) => {
      const { env, time, steps, end } = mjenvPlay.episode;
      return (time >= seconds || end) && { steps, end, qpos: [...env.read("qpos")] };
    }, SECONDS);
    const { steps, end, qpos } = await reached.jsonValue();
    await page.screenshot({ path: join(SCREENSHOTS, `${robot.replace("/", "-")}.png`) });
    assert.notEqual(end, "terminated", `${robot} after ${steps} steps`);
    assert.notDeepEqual(qpos, start.qpos, robot);
  }
});

pageTest("a slider changes the episode", "#robot=Hopper-v5&seed=1", {}, async (page) => {
  await pause(page);
  await hasPolicy(page);
  await reset(page, 1);
  const before = await step(page, 5);
  const slider = page.getByLabel("forward_reward_weight", { exact: true });
  await slider.focus();
  await page.keyboard.press("PageUp");
  await page.waitForFunction(() => location.hash.includes("set.forward_reward_weight="));
  assert.equal(await page.getByLabel("forward_reward_weight, as a number").inputValue(), await slider.inputValue());
  await page.waitForFunction(() => mjenvPlay.episode.steps === 0);
  const after = await step(page, 5);
  assert.deepEqual(after.qpos, before.qpos);
  assert.ok(after.total > before.total);

  await page.getByLabel("reset_noise_scale, as a number").fill("0.02");
  await page.keyboard.press("Tab");
  await page.waitForFunction(() => mjenvPlay.episode.steps === 0);
  assert.notDeepEqual((await step(page, 5)).qpos, before.qpos);
});

for (const command of [0.3, 0.7])
  pageTest(
    `the quadruped walks at the commanded ${command} m/s`,
    `#robot=QuadrupedVelocity-v0&set.command_forward=${command},${command}&set.command_left=0,0&set.command_turn=0,0`,
    {},
    async (page) => {
      await pause(page);
      await hasPolicy(page);
      await reset(page, 0);
      const speeds = await page.evaluate((seconds) => {
        const { env } = mjenvPlay.episode;
        return Array.from({ length: Math.round(seconds / env.dt) }, () => {
          mjenvPlay.stepOnce();
          return env.info.forward[0];
        });
      }, SECONDS);
      const walking = speeds.slice(speeds.length / 5); // it starts from standing
      const mean = walking.reduce((sum, speed) => sum + speed, 0) / walking.length;
      assert.ok(Math.abs(mean - command) < 0.1, `${mean} m/s`);
      assert.equal((await state(page)).end, undefined);
    },
  );

pageTest("policies have all activations of the text format", "#robot=InvertedPendulum-v5", {}, async (page) => {
  await hasPolicy(page);
  const activations = {
    identity: (x) => x,
    relu: (x) => Math.max(x, 0),
    tanh: Math.tanh,
    elu: (x) => (x > 0 ? x : Math.expm1(x)),
  };
  for (const [name, activation] of Object.entries(activations)) {
    const text = `mjenv-policy 2
id InvertedPendulum-v5
about {"options": {}}
input qpos 2
mean 0 0
scale 1 1
clip 10
low -3 -3
high 3 3
layer 2 2 ${name}
bias 0.5 -0.5
weights 1 0
weights 0 1
`;
    const action = await page.evaluate((text) => {
      const action = new Float32Array(2);
      mjenvPlay.episode.policy.constructor.parse(text).act([1, -1], action);
      return [...action];
    }, text);
    assert.deepEqual(
      action,
      [1.5, -1.5].map((x) => Math.fround(activation(x))),
      name,
    );
  }
});

pageTest("the library says what is wrong with an option", "#robot=Hopper-v5", {}, async (page) => {
  await page.getByText("Options of every robot").click();
  await page.getByLabel("frame_skip, as a number").fill("0");
  await page.keyboard.press("Tab");
  await page.getByRole("alert").filter({ hasText: "frame_skip" }).waitFor();
  const { steps } = await state(page);
  await page.waitForFunction((steps) => mjenvPlay.episode.steps > steps, steps);
});

pageTest("options without effect are not offered", "#robot=Hopper-v5&set.num_threads=4", {}, async (page) => {
  await page.getByText("Options of every robot").click();
  await page.getByLabel("frame_skip, as a number").waitFor();
  for (const name of [
    "num_threads",
    "lanes",
    "cpu_affinity",
    "arrays",
    "max_contacts",
    "xml_string",
    "trust_xml",
    "norm",
  ])
    assert.equal(await page.locator(`#option-${name}`).count(), 0, name);
  assert.equal(await page.locator("#message").textContent(), "");
});

pageTest("save and restore give the same steps", "#robot=Hopper-v5", {}, async (page) => {
  await pause(page);
  await hasPolicy(page);
  await step(page, 3);
  await page.getByRole("button", { name: "Save" }).click();
  const first = await step(page, 4);
  await page.getByRole("button", { name: "Restore" }).click();
  assert.deepEqual(await step(page, 4), first);
});

pageTest("a seed repeats its episode", "#robot=Ant-v5", {}, async (page) => {
  await pause(page);
  const first = await reset(page, 7);
  const other = await reset(page, 8);
  assert.notDeepEqual(other.qpos, first.qpos);
  assert.deepEqual(await reset(page, 7), first);
});

pageTest(
  "a link holds robot, options, seed, speed and policy",
  "#robot=Hopper-v5&policy=off&speed=0.5",
  {},
  async (page) => {
    await pause(page);
    await page.getByLabel("reset_noise_scale, as a number").fill("0.03");
    await page.keyboard.press("Tab");
    await page.waitForFunction(() => location.hash.includes("reset_noise_scale"));
    const start = await reset(page, 13);
    const link = page.url();

    await page.goto("about:blank");
    await show(page, link);
    await pause(page);
    assert.deepEqual(await reset(page, 13), start);
    assert.equal(await page.getByLabel("Robot", { exact: true }).inputValue(), "Hopper-v5");
    assert.equal(await page.getByLabel("reset_noise_scale, as a number").inputValue(), "0.03");
    assert.equal(await page.getByLabel("A trained policy acts").isChecked(), false);
    assert.equal(await page.getByLabel("Speed").inputValue(), "0.5");
    assert.equal(page.url(), link);

    // Another link in the same tab
    await page.evaluate(() => (location.hash = "#robot=Swimmer-v5&seed=2"));
    await page.waitForFunction(() => mjenvPlay.episode.env.id === "Swimmer-v5");
    assert.equal(await page.getByLabel("Seed").inputValue(), "2");
  },
);

pageTest("keys act, pause and step", "#robot=HalfCheetah-v5&policy=off", {}, async (page) => {
  await page.keyboard.press("Space");
  await page.getByRole("button", { name: "Play" }).waitFor();
  const { steps } = await state(page);
  await page.keyboard.press(".");
  assert.equal((await state(page)).steps, steps + 1);
  assert.deepEqual((await state(page)).action, [0, 0, 0, 0, 0, 0]);
  await page.keyboard.down("q");
  await page.keyboard.down("s");
  await page.keyboard.press(".");
  assert.deepEqual((await state(page)).action, [1, -1, 0, 0, 0, 0]);
  await page.keyboard.up("q");
  await page.keyboard.up("s");
  await page.keyboard.press(".");
  assert.deepEqual((await state(page)).action, [0, 0, 0, 0, 0, 0]);
  // Letters that are written into a field are none of these keys.
  await page.getByLabel("Seed").focus();
  await page.keyboard.down("q");
  assert.equal((await step(page)).action[0], 0);
  await page.keyboard.up("q");
});

pageTest("keys add to the policy", "#robot=HalfCheetah-v5", {}, async (page) => {
  await pause(page);
  await hasPolicy(page);
  await reset(page, 5);
  const { action: alone } = await step(page);
  await reset(page, 5);
  await page.keyboard.down("q");
  const { action: together } = await step(page);
  assert.deepEqual(together, [Math.fround(Math.min(alone[0] + 1, 1)), ...alone.slice(1)]);
});

/** Where a body is on the screen. */
const place = (page, body) =>
  page.evaluate((body) => {
    const { stage, robot } = mjenvPlay;
    const mesh = robot.group.children.find(({ userData }) => userData.body === body);
    const { x, y } = mesh.position.clone().project(stage.camera);
    const { left, top, width, height } = stage.canvas.getBoundingClientRect();
    return [left + (width * (x + 1)) / 2, top + (height * (1 - y)) / 2];
  }, body);

pageTest("dragging a body pulls it", "#robot=Swimmer-v5&policy=off", {}, async (page) => {
  const forces = () => page.evaluate(() => [...mjenvPlay.episode.env.read("xfrc_applied")]);
  const camera = () => page.evaluate(() => mjenvPlay.stage.camera.position.toArray());
  await pause(page);
  await reset(page, 1);
  const free = await step(page, 10);
  await reset(page, 1);
  const [x, y] = await place(page, 1);
  const from = await camera();
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 60, y - 40, { steps: 4 });
  const moved = (await camera()).map((x, i) => x - from[i]);
  assert.ok(Math.hypot(...moved) < 1e-9, "the camera turns"); // OrbitControls rounds in each picture
  await page.keyboard.press(".");
  assert.notDeepEqual((await forces()).slice(6, 9), [0, 0, 0]);
  for (let i = 0; i < 9; i++) await page.keyboard.press(".");
  const pulled = await state(page);
  assert.ok(Math.hypot(pulled.qpos[0] - free.qpos[0], pulled.qpos[1] - free.qpos[1]) > 0.01);
  await page.screenshot({ path: join(SCREENSHOTS, "pull.png") });
  await page.mouse.up();
  await page.keyboard.press(".");
  assert.ok((await forces()).every((force) => force === 0));
});

pageTest("dragging beside the robot turns the camera, the wheel zooms", "#robot=Reacher-v5", {}, async (page) => {
  await pause(page);
  const camera = () => page.evaluate(() => mjenvPlay.stage.camera.position.toArray());
  const distance = () => page.evaluate(() => mjenvPlay.stage.controls.getDistance());
  const [from, far] = [await camera(), await distance()];
  await page.mouse.move(30, 120);
  await page.mouse.down();
  await page.mouse.move(90, 150, { steps: 3 });
  await page.mouse.up();
  assert.notDeepEqual(await camera(), from);
  await page.mouse.wheel(0, -300);
  await page.waitForFunction((far) => mjenvPlay.stage.controls.getDistance() < 0.95 * far, far);
});

test("the speed slows the time down", async () => {
  const { page } = await open(browser, server.address);
  try {
    await page.clock.install({ time: 0 });
    await page.goto(url("#robot=Reacher-v5"));
    await page.waitForFunction(() => globalThis.mjenvPlay?.episode);
    await pause(page);
    await page.clock.pauseAt(3_600_000);
    for (const speed of [1, 0.25]) {
      await page.getByLabel("Speed").selectOption(String(speed));
      await reset(page, 0);
      await page.getByRole("button", { name: "Play" }).click();
      await page.clock.runFor(800);
      await page.getByRole("button", { name: "Pause" }).click();
      const { time, dt } = await page.evaluate(() => ({ time: mjenvPlay.episode.time, dt: mjenvPlay.episode.env.dt }));
      // The clock runs in frames of 16 ms.
      assert.ok(Math.abs(time - 0.8 * speed) <= dt + 0.05 * speed, `${time} s at speed ${speed}`);
    }
  } finally {
    await page.context().close();
  }
});

for (const [colorScheme, robot] of [
  ["light", "Humanoid-v5"],
  ["dark", "QuadrupedVelocity-v0"],
])
  pageTest(
    `a phone, ${colorScheme}`,
    `#robot=${robot}`,
    { viewport: { width: 360, height: 640 }, hasTouch: true, colorScheme },
    async (page) => {
      await hasPolicy(page);
      await pause(page);
      await page.evaluate(() => document.querySelectorAll("details").forEach((part) => (part.open = true)));
      const widths = await page.evaluate(() => {
        const { scrollWidth, clientWidth } = document.documentElement;
        const wide = [...document.querySelectorAll("body *")].filter(
          (e) => e.getBoundingClientRect().right > clientWidth + 1,
        );
        return { scrollWidth, clientWidth, wide: wide.map((e) => e.outerHTML.slice(0, 80)) };
      });
      assert.deepEqual(widths, { scrollWidth: 360, clientWidth: 360, wide: [] });
      await page.screenshot({ path: join(SCREENSHOTS, `phone-${colorScheme}.png`), fullPage: true });
      const back = await page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number));
      const scene = await page.evaluate(() => mjenvPlay.stage.scene.background.getHexString());
      const isDark = colorScheme === "dark";
      assert.equal(
        back.every((part) => part < 60),
        isDark,
        `${back}`,
      );
      assert.equal(parseInt(scene, 16) < 0x808080, isDark, scene);
    },
  );

pageTest("every control has a name and can be reached by the keyboard", "#robot=Humanoid-v5", {}, async (page) => {
  const stops = [];
  for (let i = 0; i < 4; i++) {
    await page.keyboard.press("Tab");
    stops.push(await page.evaluate(() => document.activeElement.id || document.activeElement.tagName));
  }
  assert.deepEqual(stops, ["A", "robot", "share", "pause"]);
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "Play" }).waitFor();
  const nameless = await page.evaluate(() =>
    [...document.querySelectorAll("button, select, input, textarea, canvas")]
      .filter((e) => !e.closest('[role="img"][aria-label]'))
      .filter((e) => !e.labels?.length && !e.getAttribute("aria-label") && !e.textContent.trim())
      .map((e) => e.outerHTML),
  );
  assert.deepEqual(nameless, []);
});

test("the page works when it is opened from a folder", async () => {
  const folder = pathToFileURL(FOLDER).href;
  const { page, errors, strangers } = await open(browser, folder);
  try {
    await show(page, `${folder}/index.html#robot=Hopper-v5`);
    await hasPolicy(page);
    assert.deepEqual(errors, []);
    assert.deepEqual(strangers, []);
  } finally {
    await page.context().close();
  }
});
