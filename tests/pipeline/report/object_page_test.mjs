// SPDX-License-Identifier: AGPL-3.0-or-later
// The report of a body that is no breast speaks of no breast: object_page_test.mjs OUT_FOLDER [PICTURES]
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser, find_chromium } from "./browser.mjs";

const [out, pictures] = process.argv.slice(2);
const browser = await Browser.start(find_chromium());
try {
  const page = await browser.open(pathToFileURL(join(resolve(out), "report.html")).href, { width: 1280, height: 900, media: { "prefers-reduced-motion": "reduce" } });
  await page.until(`performance.getEntriesByName("supine-first-picture").length > 0`);
  // Files keep their names (docs/bodies.md), so what lists files and commands is left out.
  const said = await page.evaluate(`(() => { const body = document.body.cloneNode(true);
    body.querySelectorAll("script, style, code, #provenance, option[value$='.vtp']").forEach((e) => e.remove());
    const labels = [...body.querySelectorAll("[aria-label]")].map((e) => e.getAttribute("aria-label"));
    return [body.textContent, ...labels].join("\\n"); })()`);
  assert.ok(said.length > 2000, "the page is empty");
  const words = said.match(/.{0,40}\b(breasts?|nipple|quadrants?|muscle|gland|patient'?s?|lateral|medial|prone|inner side|outer side|breath|chest|none breast)\b.{0,40}/gi);
  assert.equal(words, null, `words of a breast: ${words}`);
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    await page.screenshot(join(pictures, "object.png"), { whole: true });
    await page.screenshot(join(pictures, "view.png"), { selector: "#view" });
  }
  assert.deepEqual(page.complaints, [], "errors in the console");
  console.log("the report of an object speaks of no breast");
} finally {
  await browser.close();
}
