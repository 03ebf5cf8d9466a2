// SPDX-License-Identifier: AGPL-3.0-or-later
// Where every figure came from and how to make it again.
"use strict";
(() => {
  const { data, el, section, command } = supine;

  const steps = () => data.stages.filter((s) => s.file).map((s) => el("div", {}, el("h3", {}, s.name), s.command ? command("build/bin/" + s.command) : ""));
  const files = () => {
    const rows = Object.entries(data.figures).filter(([, f]) => f.provenance).map(([file, f]) => ({ file, tool: f.provenance.tool, version: f.provenance.version,
      commit: f.provenance.commit || "", seed: f.provenance.seed === undefined ? null : f.provenance.seed, inputs: f.provenance.inputs || [], warnings: f.warnings || [] }));
    const short = (inputs) => el("details", {}, el("summary", {}, inputs.length + (inputs.length === 1 ? " file" : " files")), inputs.map((i) => el("div", { class: "break" }, `${i.file} `, el("code", { class: "soft" }, (i.sha256 || "").slice(0, 16)))));
    const flat = rows.map((r) => ({ ...r, input_hashes: r.inputs.map((i) => `${i.file}=${i.sha256}`) }));
    const warned = rows.flatMap((r) => r.warnings.map((w) => el("div", { class: "warning" }, `${r.file}: ${w}`)));
    return [warned, supine.figure("provenance", "Files", supine.table([{ title: "file", key: "file" }, { title: "tool", key: "tool" }, { title: "version", key: "version" }, { title: "commit", key: "commit" },
      { title: "seed", key: "seed", show: (v) => (v === null ? "–" : String(v)) }, { title: "made from (SHA-256)", key: "inputs", show: short }], rows),
    { text: supine.csv([{ key: "file" }, { key: "tool" }, { key: "version" }, { key: "commit" }, { key: "seed" }, { key: "input_hashes" }], flat) })];
  };
  const models = () => Object.entries(data.texts).filter(([name]) => name.endsWith(".toml")).map(([name, content]) =>
    el("details", {}, el("summary", {}, name.replace(/^case\//, "")  + (name.startsWith("case/") ? " (as given)" : "")), el("pre", { class: "scroll", tabindex: 0 }, content)));

  supine.provenance = () => section("provenance", "How it was made",
    el("p", {}, "In the folder of the program; each step reads what the one before wrote."), steps(), files(), el("h3", {}, "Case and models"), models());
})();
