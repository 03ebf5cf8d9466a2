// SPDX-License-Identifier: AGPL-3.0-or-later
// A headless Chromium driven over its debugging pipe (Chrome DevTools Protocol): no other package is needed.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

// The name of a Chromium there is, or null.
export function find_chromium() {
  const names = [process.env.SUPINE_CHROMIUM, "chromium", "chromium-browser", "google-chrome"].filter(Boolean);
  return names.find((name) => spawnSync(name, ["--version"], { stdio: "ignore" }).status === 0) || null;
}

export class Browser {
  static async start(name) {
    const browser = new Browser();
    browser.profile = mkdtempSync(join(tmpdir(), "supine_browser_"));
    // In a container there is no user namespace to build the sandbox in; the page is ours and asks no network.
    const options = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
      "--hide-scrollbars", "--no-first-run", "--remote-debugging-pipe", "--user-data-dir=" + browser.profile];
    browser.process = spawn(name, options, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    browser.waiting = new Map();
    browser.listeners = [];
    browser.count = 0;
    browser.read();
    return browser;
  }

  read() {
    let rest = "";
    this.process.stdio[4].setEncoding("utf8").on("data", (piece) => {
      const parts = (rest + piece).split("\0");
      rest = parts.pop();
      for (const part of parts) this.receive(JSON.parse(part));
    });
    this.process.on("exit", () => this.waiting.forEach(({ reject }) => reject(new Error("the browser ended"))));
  }

  receive(message) {
    if (!message.id) return this.listeners.forEach((listener) => listener(message));
    const { resolve, reject } = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (message.error) reject(new Error(message.error.message));
    else resolve(message.result);
  }

  send(method, params = {}, session = undefined) {
    const id = ++this.count;
    this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId: session }) + "\0");
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  // Opens a page of the given size; `media` as in {"prefers-color-scheme": "dark"}.
  async open(url, { width = 1280, height = 900, media = {} } = {}) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId, targetId);
    for (const domain of ["Page", "Runtime", "Network", "Log"]) await page.send(domain + ".enable");
    await page.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 500 });
    await page.send("Emulation.setEmulatedMedia", { features: Object.entries(media).map(([name, value]) => ({ name, value })) });
    await page.send("Performance.enable", { timeDomain: "threadTicks" });
    const loaded = page.once("Page.loadEventFired");
    await page.send("Page.navigate", { url });
    await loaded;
    return page;
  }

  async close() {
    const ended = new Promise((resolve) => this.process.once("exit", resolve));
    this.send("Browser.close").catch(() => {});
    await Promise.race([ended, new Promise((resolve) => setTimeout(resolve, 5000))]);
    this.process.kill("SIGKILL");
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  }
}

class Page {
  constructor(browser, session, target) {
    Object.assign(this, { browser, session, target, complaints: [], requests: [] });
    browser.listeners.push((message) => message.sessionId === session && this.note(message));
  }

  // Whatever a developer would see in red, and whatever is asked from outside.
  note({ method, params }) {
    if (method === "Runtime.exceptionThrown") this.complaints.push(params.exceptionDetails.exception?.description || params.exceptionDetails.text);
    if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type))
      this.complaints.push(params.args.map((a) => a.value || a.description).join(" "));
    if (method === "Log.entryAdded" && params.entry.level === "error") this.complaints.push(params.entry.text);
    if (method === "Network.requestWillBeSent" && !/^(file|data|blob|about):/.test(params.request.url)) this.requests.push(params.request.url);
  }

  send(method, params) { return this.browser.send(method, params, this.session); }

  once(method) {
    return new Promise((resolve) => this.browser.listeners.push((m) => m.sessionId === this.session && m.method === method && resolve(m.params)));
  }

  // Value of a JavaScript expression in the page.
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description || exceptionDetails.text}`);
    return result.value;
  }

  // Processor time of the page's own thread so far, seconds: the same on a busy machine as on an idle one.
  async busy() {
    const { metrics } = await this.send("Performance.getMetrics", {});
    return metrics.find((m) => m.name === "TaskDuration").value;
  }

  // Waits until the expression is true.
  async until(expression, seconds = 20) {
    for (const end = Date.now() + 1000 * seconds; ; ) {
      if (await this.evaluate(expression)) return;
      if (Date.now() > end) throw new Error(`after ${seconds} s still not: ${expression}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }

  // A click of the mouse in the middle of the element.
  async click(selector) {
    const place = await this.evaluate(`(() => { const e = document.querySelector(${JSON.stringify(selector)}); if (!e) return null;
      e.scrollIntoView({ block: "center", behavior: "instant" }); const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()`);
    if (!place) throw new Error(`nothing to click at ${selector}`);
    const [x, y] = place;
    for (const type of ["mousePressed", "mouseReleased"]) await this.send("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
  }

  async press(key, code = key, text = undefined) {
    await this.send("Input.dispatchKeyEvent", { type: text ? "keyDown" : "rawKeyDown", key, code, text, windowsVirtualKeyCode: key_codes[key] || 0 });
    await this.send("Input.dispatchKeyEvent", { type: "keyUp", key, code, windowsVirtualKeyCode: key_codes[key] || 0 });
  }

  // A picture of the whole page, of an element, or of what is seen.
  async screenshot(file, { selector = null, whole = false } = {}) {
    const clip = selector
      ? await this.evaluate(`(() => { const r = document.querySelector(${JSON.stringify(selector)}).getBoundingClientRect();
          return { x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height, scale: 1 }; })()`)
      : whole ? await this.evaluate("({ x: 0, y: 0, width: innerWidth, height: document.documentElement.scrollHeight, scale: 1 })") : undefined;
    const { data } = await this.send("Page.captureScreenshot", { format: "png", clip, captureBeyondViewport: Boolean(clip) });
    writeFileSync(file, Buffer.from(data, "base64"));
    return Buffer.from(data, "base64");
  }

  async pdf(file) {
    const { data } = await this.send("Page.printToPDF", { printBackground: true, preferCSSPageSize: true });
    writeFileSync(file, Buffer.from(data, "base64"));
  }
}

const key_codes = { Tab: 9, Enter: 13, ArrowLeft: 37, ArrowUp: 38, ArrowRight: 39, ArrowDown: 40, Home: 36, End: 35, " ": 32 };
