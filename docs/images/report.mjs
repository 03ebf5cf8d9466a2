// SPDX-License-Identifier: AGPL-3.0-or-later
// Makes report.png, the answer and the 3-D view of the sample's report, with a Chromium:
//   make CASE=samples/ligament diagnose && make CASE=samples/ligament ladder report
//   node docs/images/report.mjs samples/ligament/out/report.html docs/images/report.png
import { writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { Browser, find_chromium } from "../../tests/pipeline/report/browser.mjs";

const [page_file, picture] = process.argv.slice(2);
const width = 1240;
const browser = await Browser.start(find_chromium());
const page = await browser.open("file://" + resolve(page_file), { width, media: { "prefers-color-scheme": "light" } });
await page.until("performance.getEntriesByName('supine-first-picture').length > 0");
// The model as given, in a picture that ends with the controls.
await page.evaluate("document.querySelector('.scene').style.height = '36rem'; dispatchEvent(new Event('resize'))");
await page.click('[data-id="given"]');
await page.evaluate("document.activeElement.blur(); scrollTo(0, 0)");
await new Promise((done) => setTimeout(done, 2000));
const height = await page.evaluate("document.querySelector('#view').getBoundingClientRect().bottom + scrollY");
const { data } = await page.send("Page.captureScreenshot", { format: "png", captureBeyondViewport: true, clip: { x: 0, y: 0, width, height, scale: 1 } });
writeFileSync(picture, Buffer.from(data, "base64"));
await browser.close();
