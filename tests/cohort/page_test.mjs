// SPDX-License-Identifier: AGPL-3.0-or-later
// page_test.mjs COHORT [PICTURES]: cohort.html of a hundred made patients, two of them set aside.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser, find_chromium } from "../pipeline/report/browser.mjs";

const [cohort, pictures] = process.argv.slice(2);
const chromium = find_chromium();
if (!chromium) {
  console.log("skipped: no chromium here (apt-get install chromium, or name one in SUPINE_CHROMIUM)");
  process.exit(77);
}
const figures = JSON.parse(readFileSync(join(cohort, "cohort.json"), "utf8"));
const browser = await Browser.start(chromium);
try {
  const page = await browser.open(pathToFileURL(join(resolve(cohort), "cohort.html")).href);
  await page.until(`document.querySelectorAll("#patients tr").length === 101`);
  const busy = await page.busy();
  assert.ok(busy < 2, `a hundred patients took the page ${busy} s of processor time`);

  // Every section has what the files hold.
  assert.equal(await page.evaluate(`document.querySelectorAll("#bodies figure").length`), 98);
  assert.equal(await page.evaluate(`document.querySelectorAll("#effects tr").length`), 1 + figures.effects.length);
  assert.equal(await page.evaluate(`document.querySelectorAll("#grid rect").length`), 98 * figures.effects.length);
  assert.equal(await page.evaluate(`document.querySelectorAll("#moduli figure").length`), figures.numbers.length);
  assert.match(await page.evaluate(`document.getElementById("failed").textContent`), /in no tissue <\/script><b>/);
  const shown = await page.evaluate(`[...document.querySelectorAll("#effects tr")].slice(1).map((r) => r.cells[1].textContent)`);
  assert.deepEqual(shown, figures.effects.map((e) => e.probability.toFixed(2)));

  // Worst first; a click on the head turns the order, another column sorts by it.
  const column = (index) => `[...document.querySelectorAll("#patients tr")].slice(1).map((r) => r.cells[${index}].textContent)`;
  const numbers = async (index) => (await page.evaluate(column(index))).filter((t) => t && t !== "–").map(Number);
  const descending = await numbers(5);
  assert.deepEqual(descending, [...descending].sort((a, b) => b - a));
  assert.equal(descending.length, 98);
  await page.click("#patients th:nth-child(6) button");
  assert.deepEqual(await numbers(5), [...descending].reverse());
  await page.click("#patients th:nth-child(1) button");
  const names = await page.evaluate(column(0));
  assert.deepEqual(names, [...names].sort());

  // The filter leaves those that hold the word.
  await page.evaluate(`(() => { const f = document.getElementById("filter"); f.value = "patient-01"; f.dispatchEvent(new Event("input")); })()`);
  assert.equal(await page.evaluate(`document.querySelectorAll("#patients tr").length`), 11);
  assert.equal(await page.evaluate(`document.getElementById("shown").textContent`), "10 of 100");

  // Each link leads to a report that is there.
  const links = await page.evaluate(`[...document.querySelectorAll("a")].map((a) => a.getAttribute("href"))`);
  assert.ok(links.length >= 98);
  for (const link of links) assert.ok(existsSync(join(cohort, link)), link);
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    await page.screenshot(join(pictures, "cohort.png"), { whole: true });
  }
  const narrow = await browser.open(pathToFileURL(join(resolve(cohort), "cohort.html")).href, { width: 400, height: 800 });
  assert.ok(await narrow.evaluate("document.documentElement.scrollWidth <= innerWidth"), "wider than a telephone");
  for (const one of [page, narrow]) {
    assert.deepEqual(one.complaints, []);
    assert.deepEqual(one.requests, [], "the page asks the network");
  }
  console.log(`a hundred patients: ${busy.toFixed(2)} s of processor time`);
} finally {
  await browser.close();
}
