// SPDX-License-Identifier: AGPL-3.0-or-later
// Makes targets.png, the picture for the operating table of a computed breast with a grey MRI (docs/data.md), with a Chromium:
//   make CASE=null-1 compare && build/bin/supine-targets null-1 null-1/out/mesh.vtu --points lesion.csv -o null-1/out/targets
//   build/bin/supine-warp null-1 null-1/mri.nrrd --no-transform && make CASE=null-1 report
//   node docs/images/targets.mjs null-1/out/report.html docs/images/targets.png
// with the point lesion,-14,-34,12 in lesion.csv.
import { resolve } from "node:path";
import { Browser, find_chromium } from "../../tests/pipeline/report/browser.mjs";

const [page_file, picture] = process.argv.slice(2);
const browser = await Browser.start(find_chromium());
const page = await browser.open("file://" + resolve(page_file), { width: 1000, height: 1000, media: { "prefers-reduced-motion": "reduce", "prefers-color-scheme": "light" } });
await page.until("performance.getEntriesByName('supine-first-picture').length > 0");
await page.click('[data-id="table"]');
await page.until("document.querySelectorAll('.over .shell').length > 0");
// The body and the slices alone, under each other.
await page.evaluate(`(() => {
  document.querySelector("#view").append(document.querySelector(".slices"));
  [...document.querySelectorAll("#view > h2, #view [role=status], .panel, .legend")].forEach((e) => e.remove());
  document.querySelector(".view").style.display = "block";
  document.querySelector(".scene").style.height = "21rem";
  supine.view3d.scene.resize();
  supine.view3d.view("feet");
})()`);
await new Promise((done) => setTimeout(done, 1000));
await page.screenshot(picture, { selector: "#view" });
await browser.close();
