// SPDX-License-Identifier: AGPL-3.0-or-later
// Puts the page together.
"use strict";
(() => {
  const { data, el } = supine;
  const parts = [["answer", "Answer"], ["view", "Shapes"], ["targets", "Targets"], ["slices", "Slices"], ["ladder", "Ladder"], ["candidates", "Effects"], ["budget", "Error budget"], ["places", "Where"],
    ["parameters", "Parameters"], ["mesh", "Mesh"], ["provenance", "Provenance"]];

  const view = () => {
    const holder = el("div", { id: "view3d" });
    if (data.view3d) holder.append(el("div", { class: "gap" }, data.view3d));
    else if (!data.shapes || !data.shapes.states.length) holder.append(supine.gap(data.shapes ? "simulate" : "mesh", "No shapes to show yet."));
    return supine.section("view", "Shapes and distance to the scan", holder);
  };
  const page = document.getElementById("page");
  const draw = (name) => {
    // One part that cannot be drawn must not take the others with it.
    try { return name === "view" ? view() : supine[name](); } catch (error) {
      console.error(name, error);
      return supine.section(name, name, el("div", { class: "gap" }, `This part could not be drawn (${error.message}).`));
    }
  };
  page.replaceChildren(
    el("header", { class: "top" }, el("h1", {}, data.case.name), el("p", {}, `Supine report${supine.of_body(` · ${data.case.side} breast${data.case.side === "both" ? "s" : ""}`, "")}`)),
    el("nav", { "aria-label": "parts of the report" }, parts.map(([name, title]) => el("a", { href: "#" + name }, title))),
    ...parts.map(([name]) => draw(name)),
    el("footer", {}, `Supine ${data.version}${data.commit ? " (" + data.commit + ")" : ""}. Research software, not a medical device. Lengths in mm, coordinates ${supine.of_body("patient LPS", "as in the case")}.`));

  document.addEventListener("DOMContentLoaded", () => {
    const holder = document.getElementById("view3d");
    if (supine.start_view3d && data.shapes && data.shapes.states.length && !data.view3d) {
      try { supine.start_view3d(holder); } catch (error) {
        holder.replaceChildren(el("div", { class: "gap" }, `The 3-D view needs WebGL, which this browser does not give (${error.message}).`));
      }
    }
  });
})();
