// A local server for the page, and Debian's Chromium, which looks at it.
import { chromium } from "playwright-core";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css" };
// Draws without a graphics card, and asks nothing of the network.
const ARGUMENTS = [
  "--no-sandbox",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

/** ms; a page without a graphics card is slow where other programs use the processors, too. */
const TIMEOUT = 240_000;

/** Serves a folder on this machine; gives its address. */
export async function serve(folder) {
  const server = createServer(async (request, response) => {
    const path = normalize(new URL(request.url, "http://localhost").pathname);
    try {
      const content = await readFile(join(folder, path));
      response.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" }).end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}

export const launch = () => chromium.launch({ executablePath: "/usr/bin/chromium", args: ARGUMENTS });

/**
 * A tab, and the lists of what must stay empty: errors, and requests to other places than `address`.
 * Every tab has its own storage; `settings` are Playwright's for a context.
 */
export async function open(browser, address, settings = {}) {
  const context = await browser.newContext({ viewport: { width: 720, height: 480 }, ...settings });
  context.setDefaultTimeout(TIMEOUT);
  const page = await context.newPage();
  const errors = [];
  const strangers = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type()) && !isDriver(message.text())) errors.push(message.text());
  });
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("request", (request) => {
    if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) strangers.push(request.url());
  });
  return { page, errors, strangers };
}

/** Drawing without a graphics card is slow where pixels are read back, as for a screenshot: the driver says so. */
const isDriver = (text) => text.includes("GPU stall due to ReadPixels");

/** Goes to an address and waits for the first picture; says after how many seconds it came. */
export async function show(page, url) {
  await page.goto(url);
  await page.waitForFunction(() => performance.getEntriesByName("first picture").length > 0);
  return page.evaluate(() => performance.getEntriesByName("first picture")[0].startTime / 1000);
}
