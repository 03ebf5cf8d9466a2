// SPDX-License-Identifier: AGPL-3.0-or-later
// The report in a real browser: browser_test.mjs BIN SMALL_RUN [PICTURES]
// or of a page that is there: browser_test.mjs --page OUT_FOLDER [PICTURES]. Pictures of what was seen go to the folder PICTURES.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser, find_chromium } from "./browser.mjs";
import { make_case, run } from "./make_case.mjs";

const [bin, where, pictures] = process.argv.slice(2);
const chromium = find_chromium();
if (!chromium) {
  console.log("skipped: no chromium here (apt-get install chromium, or name one in SUPINE_CHROMIUM)");
  process.exit(77);
}
const scratch = mkdtempSync(join(tmpdir(), "supine_report_"));
const out = bin === "--page" ? resolve(where) : join(make_case(bin, where, join(scratch, "case")), "out");
if (bin !== "--page") run(bin, "report", join(scratch, "case"), "--force", "--quiet");
const url = pathToFileURL(join(out, "report.html")).href;
if (pictures) mkdirSync(pictures, { recursive: true });
const picture = async (page, name, how) => { if (pictures) await page.screenshot(join(pictures, name + ".png"), how); };

// What a page shows for a figure is the figure of the file, to the digits shown.
async function check_figures(page) {
  const shown = await page.evaluate(`[...document.querySelectorAll("[data-file]")].map((e) => ({ ...e.dataset, text: e.textContent }))`);
  assert.ok(shown.length > 20, `only ${shown.length} figures on the page`);
  for (const { file, path, digits, text } of shown) {
    const value = JSON.parse(path).reduce((v, key) => v[key], JSON.parse(readFileSync(join(out, file), "utf8")));
    const expected = digits === "e" ? value.toExponential(1) : value === null ? "–" : value.toFixed(digits);
    assert.equal(text.replace("−", "-").replace(/^\+/, ""), expected.replace(/^-(?=0(\.0*)?$)/, ""), `${file} ${path}`);
  }
}

// Every figure has its data, and every table of data a row for each that the files hold.
async function check_downloads(page) {
  const links = await page.evaluate(`[...document.querySelectorAll("figure")].map((f) => [f.id, f.querySelector("a.csv")?.href || null])`);
  for (const [id, href] of links) {
    if (id === "figure-round-trip" || id === "") continue;
    assert.match(href || "", /^data:text\/csv/, `${id} has no CSV`);
    assert.ok(decodeURIComponent(href).split("\n").length > 2, `${id}: empty CSV`);
  }
}

// Nothing wider than the window, no label of a chart on another, every picture named.
async function check_layout(page, width) {
  assert.ok(await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), `wider than ${width} px`);
  const overlaps = await page.evaluate(`[...document.querySelectorAll("figure svg, .scene svg")].flatMap((svg) => {
    const boxes = [...svg.querySelectorAll("text:not([transform])")].filter((t) => t.textContent.trim()).map((t) => [t.textContent, t.getBoundingClientRect()]);
    return boxes.flatMap(([a, p], i) => boxes.slice(i + 1).filter(([, q]) => p.right > q.left + 1 && q.right > p.left + 1 && p.bottom > q.top + 4 && q.bottom > p.top + 4)
      .map(([b]) => svg.closest("figure, .scene").id + ": " + a + " / " + b)); })`);
  assert.deepEqual(overlaps, [], "labels on each other");
  assert.equal(await page.evaluate(`[...document.querySelectorAll("figure > svg")].every((s) => s.getAttribute("aria-label"))`), true);
}

// The colours of the scene change when another model or shape is chosen.
async function check_view(page) {
  const seen = new Map(), errors = [];
  const look = async (name) => {
    await page.until("!supine.view3d.running || supine.view3d.morph % 1 === 0");
    await new Promise((resolve) => setTimeout(resolve, 300));
    const bytes = await page.screenshot(join(scratch, name + ".png"), { selector: ".scene" });
    for (const [other, known] of seen) assert.ok(!bytes.equals(known), `${name} looks like ${other}`);
    seen.set(name, bytes);
  };
  const rungs = await page.evaluate(`[...document.querySelectorAll('[data-choice^="Model"] button')].map((b) => b.dataset.id)`);
  assert.ok(rungs.length >= 2, "no models to choose from");
  for (const id of rungs) {
    await page.click(`[data-id="${id}"]`);
    await page.until(`document.querySelector('[data-id="${id}"]').getAttribute("aria-pressed") === "true"`);
    const told = await page.evaluate(`document.querySelector("[role=status] .figure").textContent`), folder = { given: "", calibrated: "calibrated/" }[id] ?? "ladder/" + id.slice(5) + "/";
    errors.push(JSON.parse(readFileSync(join(out, folder + "comparison.json"))).rms_mm);
    assert.equal(told, errors.at(-1).toFixed(2), `status of ${id}`);
    await look("model " + id);
  }
  for (const [at, words] of [[0, "prone"], [1, "undeformed"], [2, "supine"]]) {
    await page.click(`[data-morph="${at}"]`);
    await page.until(`supine.view3d.morph === ${at} && document.querySelector("[role=status]").textContent.includes(${JSON.stringify(words)})`);
    if (at < 2) await look("shape " + words);
  }
  await page.click('[data-id="region"]');
  await look("regions");
  await page.evaluate(`document.querySelector("select").value = "points"; document.querySelector("select").dispatchEvent(new Event("change"))`);
  await look("scan points");
  await page.evaluate(`document.querySelector(".scene").focus({ preventScroll: true })`);
  await page.press("ArrowLeft");
  await look("turned by keyboard");
  await page.press("2", "Digit2", "2");
  await look("from the outer side");
}

// The picture for the operating table: every region drawn, those under the skin with their depth.
async function check_table(page) {
  const { points } = JSON.parse(readFileSync(join(out, "targets/supine_landmarks.json")));
  const before = await page.screenshot(join(scratch, "before the table.png"), { selector: ".scene" });
  await page.click('[data-id="table"]');
  await page.until(`supine.view3d.morph === 2 && document.querySelectorAll(".over .shell").length === ${points.length}`);
  await new Promise((resolve) => setTimeout(resolve, 300));
  const after = await page.screenshot(join(scratch, "table.png"), { selector: ".scene" });
  assert.ok(!after.equals(before), "the table looks like what was there before");
  const words = await page.evaluate(`document.querySelector(".over").textContent`);
  for (const { name, nearest_skin } of points)
    assert.ok(words.includes(nearest_skin.mm > 2 ? `${name}, ${nearest_skin.mm.toFixed(0)} mm deep` : name), `${name} is not named: ${words}`);
  // Orthographic: the shadow of an ellipsoid is as long as its longest half axis at most, as short as its shortest at least.
  const scale = await page.evaluate(`document.querySelector(".scene").getBoundingClientRect().height / (2 * supine.view3d.scene.camera.getParallelScale())`);
  const drawn = await page.evaluate(`[...document.querySelectorAll(".over .shell")].map((e) => [e.rx.baseVal.value, e.ry.baseVal.value])`);
  points.forEach(({ name, half_axes_mm: [longest, , shortest] }, k) => {
    const [rx, ry] = drawn[k].map((r) => r / scale);
    assert.ok(rx <= longest * 1.001 && ry >= shortest * 0.999 && rx >= ry, `region of ${name}: ${rx}, ${ry} of ${longest} to ${shortest} mm`);
  });
}

// Slices: what scrolls, what the cross-hair links, what window and level do.
async function check_slices(page) {
  const state = () => page.evaluate(`({ at: supine.slice_view.at, size: supine.slice_view.volume.size, place: supine.slice_view.place(), step: supine.slice_view.volume.spacing_mm,
    told: document.querySelector("#slices-status").textContent })`);
  const seen = () => page.evaluate(`[...document.querySelectorAll(".slice canvas")].map((c) => c.getContext("2d").getImageData(0, 0, c.width, c.height).data.reduce((sum, v, i) => (sum * 31 + v * (i % 97)) % 1e9, 7))`);
  const crosses = () => page.evaluate(`[...document.querySelectorAll(".slice-over")].map((s) => [...s.querySelectorAll(".cross")].map((l) => l.outerHTML).join())`);
  const first = await state(), grey = await seen(), lines = await crosses();
  await page.evaluate(`document.querySelector('[data-plane="axial"]').focus({ preventScroll: true })`);
  for (let k = 0; k < 4; ++k) await page.press("ArrowUp");
  const scrolled = await state(), grey_then = await seen(), lines_then = await crosses();
  assert.deepEqual(scrolled.at, [first.at[0], first.at[1], Math.min(first.at[2] + 4, first.size[2] - 1)]);
  assert.deepEqual(grey_then.map((v, k) => v !== grey[k]), [true, false, false], "one slice changes, the others stay");
  assert.deepEqual(lines_then.map((v, k) => v !== lines[k]), [false, true, true], "the cross-hair of the others moves");
  await page.click('[data-plane="coronal"]');
  const clicked = await state();
  assert.deepEqual(clicked.at.map((i, axis) => (axis === 1 ? i === scrolled.at[1] : Math.abs(i - clicked.size[axis] / 2) <= 1)), [true, true, true], `a click in the middle of the coronal slice: ${clicked.at}`);
  const { points: [target] } = JSON.parse(readFileSync(join(out, "targets/supine_landmarks.json")));
  await page.click(`[data-target="${target.name}"]`);
  const there = await state();
  target.place_mm.forEach((x, axis) => assert.ok(Math.abs(there.place[axis] - x) <= there.step / 2 + 1e-3, `${target.name} lies at ${x}, not ${there.place[axis]}, along ${axis}`));
  assert.equal(await page.evaluate(`[...document.querySelectorAll(".slice-over")].every((s) => s.querySelector(".region"))`), true, "its region is in all three");
  const plain = await seen();
  for (const [key, value] of [["window", 40], ["level", 60]]) {
    await page.evaluate(`(() => { const s = document.querySelector('[data-key="${key}"]'); s.value = ${value}; s.dispatchEvent(new Event("input")); })()`);
    assert.notDeepEqual(await seen(), plain, `${key} changes nothing`);
  }
  assert.equal(await page.evaluate("[0, 40, 60, 80, 255].map((b) => supine.slice_view.shade(b)).join()"), "0,0,127.5,255,255");
}

async function check_facts(page) {
  const words = await page.evaluate("document.body.innerText");
  for (const fact of ["The supine scan lies 2.3 mm and 0.5° from where it was said to lie.", "361 points of the scans lie where the model's skin creases", "This scan could not show: creep."])
    assert.ok(words.includes(fact), `not said: ${fact}`);
}

const browser = await Browser.start(chromium);
try {
  const calm = { "prefers-reduced-motion": "reduce" };
  const page = await browser.open(url, { width: 1280, height: 900, media: { ...calm, "prefers-color-scheme": "light" } });
  await page.until(`performance.getEntriesByName("supine-first-picture").length > 0`);
  const busy = await page.busy(), first = await page.evaluate(`performance.getEntriesByName("supine-first-picture")[0].startTime / 1000`);
  console.log(`first picture: ${busy.toFixed(2)} s of processor time, ${first.toFixed(2)} s by the clock (software rendering)`);
  assert.ok(busy < 3, `the first picture takes ${busy} s`);
  await check_figures(page);
  if (bin !== "--page") await check_facts(page);
  await check_downloads(page);
  await check_layout(page, 1280);
  await picture(page, "wide", { whole: true });
  await picture(page, "view", { selector: "#view" });
  await check_view(page);
  if (existsSync(join(out, "targets/supine_landmarks.json"))) await check_table(page);
  if (await page.evaluate("Boolean(supine.slice_view)")) await check_slices(page);
  await picture(page, "table", { selector: "#view" });
  await picture(page, "slices", { selector: "#slices" });
  assert.equal(await page.evaluate("document.querySelectorAll('#page b[onload]').length"), 0, "a name became an element");
  await page.pdf(join(pictures || scratch, "print.pdf"));
  const dark = await browser.open(url, { width: 390, height: 844, media: { ...calm, "prefers-color-scheme": "dark" } });
  await dark.until(`performance.getEntriesByName("supine-first-picture").length > 0`);
  await check_layout(dark, 390);
  assert.notEqual(await dark.evaluate("getComputedStyle(document.body).backgroundColor"), await page.evaluate("getComputedStyle(document.body).backgroundColor"));
  await picture(dark, "narrow-dark", { whole: true });
  for (const seen of [page, dark]) {
    assert.deepEqual(seen.complaints, [], "errors in the console");
    assert.deepEqual(seen.requests, [], "the page asked the network");
  }
  console.log("the report holds in the browser");
} finally {
  await browser.close();
  rmSync(scratch, { recursive: true, force: true });
}
