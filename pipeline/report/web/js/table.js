// SPDX-License-Identifier: AGPL-3.0-or-later
// Tables, their CSV, and figures with the table behind them.
"use strict";
(() => {
  const { el, number } = supine;

  // columns: {title, key, digits (numbers), show (value, row) → text or element}
  const cell = (column, row) => {
    const value = row[column.key];
    if (column.show) return column.show(value, row);
    if (typeof value === "number") return number(value, column.digits === undefined ? 2 : column.digits);
    return value === null || value === undefined ? "–" : String(value);
  };
  const is_number = (column) => column.digits !== undefined || column.n;
  const table = (columns, rows, { chosen } = {}) =>
    el("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "table" }, el("table", {},
      el("thead", {}, el("tr", {}, columns.map((c) => el("th", { scope: "col", class: is_number(c) ? "n" : null }, c.title)))),
      el("tbody", {}, rows.map((row) => el("tr", { class: chosen && chosen(row) ? "chosen" : null },
        columns.map((c) => el("td", { class: is_number(c) ? "n" : null }, cell(c, row))))))));

  const quote = (value) => {
    const text = value === null || value === undefined ? "" : Array.isArray(value) ? value.join(" ") : String(value);
    return /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  const csv = (columns, rows) =>
    [columns.map((c) => quote(c.key)).join(","), ...rows.map((row) => columns.map((c) => quote(row[c.key])).join(","))].join("\n") + "\n";
  const csv_link = (name, text) =>
    el("a", { class: "csv", download: name + ".csv", href: "data:text/csv;charset=utf-8," + encodeURIComponent(text) }, "CSV");

  // columns and rows are the data behind the picture, at full precision in the CSV.
  const figure = (name, title, picture, { caption, columns, rows, text } = {}) =>
    el("figure", { id: "figure-" + name }, el("p", { class: "title" }, title), picture, caption ? el("figcaption", {}, caption) : "",
      el("div", { class: "under" }, columns ? el("details", {}, el("summary", {}, "Table"), table(columns, rows)) : "",
        csv_link(name, text || csv(columns, rows))));
  const table_figure = (name, title, columns, rows, { caption, chosen } = {}) =>
    el("figure", { id: "figure-" + name }, el("p", { class: "title" }, title), table(columns, rows, { chosen }),
      caption ? el("figcaption", {}, caption) : "", el("div", { class: "under" }, csv_link(name, csv(columns, rows))));

  const parse_csv = (text) => {
    const [head, ...lines] = text.trim().split(/\r?\n/).map((line) => line.split(","));
    return lines.map((line) => Object.fromEntries(head.map((key, i) => [key, line[i] === "" ? null : isNaN(line[i]) ? line[i] : +line[i]])));
  };

  Object.assign(supine, { table, csv, csv_link, figure, table_figure, parse_csv });
})();
