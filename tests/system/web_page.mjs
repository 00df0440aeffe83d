// A browser that a test steers: one JSON object a line in ({"do": ...}), one a line out. Debian's Chromium, headless, WebGL in software.
import { createRequire } from "node:module";
import { createInterface } from "node:readline";

const require = createRequire(new URL("../../clients/web/package.json", import.meta.url));
const { chromium } = require("playwright-core");

const WAIT_MS = 40000;
const browser = await chromium.launch({
  executablePath: "/usr/bin/chromium",
  headless: true,
  args: [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
  ],
});
const context = await browser.newContext({ viewport: { width: 1100, height: 720 }, ignoreHTTPSErrors: true });
const page = await context.newPage();
page.setDefaultTimeout(WAIT_MS);
const problems = [];
page.on("pageerror", (error) => problems.push(error.message));
// Answers of 4xx and connections that break are told by the browser as well; those the page itself has to tell.
page.on("console", (message) => {
  if (message.type() === "error" && !message.text().startsWith("Failed to load resource")) problems.push(message.text());
});
const foreign = new Set();
page.on("request", (request) => {
  const { protocol, hostname } = new URL(request.url());
  if (!["blob:", "data:"].includes(protocol) && !["127.0.0.1", "localhost"].includes(hostname)) foreign.add(request.url());
});

const actions = {
  go: async ({ url }) => (await page.goto(url))?.status() ?? 0,
  url: () => page.url(),
  data: () => page.evaluate(() => ({ ...document.getElementById("view").dataset })),
  text: ({ of }) => page.textContent(of),
  click: ({ of }) => page.click(of),
  fill: ({ of, text }) => page.fill(of, text),
  press: ({ key }) => page.keyboard.press(key),
  files: ({ of, files }) => page.setInputFiles(of, files),
  shown: ({ of }) => page.isVisible(of),
  /** Until an element's text holds `text`; its text then. */
  says: async ({ of, text }) => {
    const wait = page.waitForFunction(([selector, wanted]) => document.querySelector(selector)?.textContent.includes(wanted), [of, text]);
    await wait.catch(async (error) => {
      throw new Error(`${error.message} It says "${await page.textContent(of)}"; the robot "${await page.textContent("#robot-state")}: ${await page.textContent("#robot-detail")}"`);
    });
    return page.textContent(of);
  },
  hides: ({ of }) => page.waitForSelector(of, { state: "hidden" }).then(() => true),
  /** Until a figure of the picture is larger than `than`. */
  grows: async ({ name, than }) => {
    await page.waitForFunction(([key, least]) => Number(document.getElementById("view").dataset[key]) > least, [name, than]);
    return page.evaluate((key) => Number(document.getElementById("view").dataset[key]), name);
  },
  /** An object of the picture by so many pixels. */
  drag: async ({ object, right, down }) => {
    const place = await page.evaluate((name) => document.getElementById("view").dataset[`handle_${name}`], object);
    const box = await page.locator("#view").boundingBox();
    const [x, y] = place.split(",").map(Number);
    await page.mouse.move(box.x + x, box.y + y);
    await page.mouse.down();
    for (let i = 1; i <= 8; ++i) await page.mouse.move(box.x + x + (right * i) / 8, box.y + y + (down * i) / 8);
    await page.mouse.up();
  },
  values: ({ of }) => page.$$eval(of, (inputs) => inputs.map((input) => Number(input.value))),
  slide: ({ of, to }) => page.$eval(of, (input, value) => { input.value = value; input.dispatchEvent(new Event("input")); }, String(to)),
  /** A request as the page's own scripts could make it; its status. */
  fetch: ({ path, headers }) => page.evaluate(async ([where, fields]) => (await fetch(where, { method: "POST", headers: fields, body: "{}" })).status, [path, headers]),
  focused: () => page.evaluate(() => document.activeElement?.id ?? ""),
  theme: () => page.evaluate(() => document.documentElement.dataset.theme),
  size: ({ width, height }) => page.setViewportSize({ width, height }).then(() => true),
  /** Whether an element lies within the window, whole. */
  inWindow: ({ of }) => page.$eval(of, (element) => {
    const box = element.getBoundingClientRect();
    return box.width > 0 && box.left >= 0 && box.top >= 0 && box.right <= innerWidth && box.bottom <= innerHeight;
  }),
  /** By how many pixels the page is wider than the window. */
  overhang: () => page.evaluate(() => document.documentElement.scrollWidth - innerWidth),
  toEnd: () => page.evaluate(() => scrollTo(0, document.documentElement.scrollHeight)).then(() => true),
  enabled: ({ of }) => page.isEnabled(of),
  screenshot: ({ file }) => page.screenshot({ path: file }).then(() => true),
  problems: () => ({ problems, foreign: [...foreign] }),
};

for await (const line of createInterface({ input: process.stdin })) {
  const request = JSON.parse(line);
  let answer;
  try {
    answer = { answer: (await actions[request.do](request)) ?? null };
  } catch (error) {
    answer = { error: error.message };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
await browser.close();
