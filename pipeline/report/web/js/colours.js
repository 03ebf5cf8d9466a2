// SPDX-License-Identifier: AGPL-3.0-or-later
// Colours that stay apart for every kind of colour vision: ColorBrewer's RdBu for signed distance, Okabe and Ito's for names.
"use strict";
(() => {
  const stops = [[33, 102, 172], [67, 147, 195], [146, 197, 222], [209, 229, 240], [247, 247, 247],
    [253, 219, 199], [244, 165, 130], [214, 96, 77], [178, 24, 43]];
  // t from −1 (blue: the scan lies inside the model) to 1 (red: outside).
  const diverging = (t) => {
    const at = Math.min(Math.max((t + 1) / 2, 0), 1) * (stops.length - 1);
    const k = Math.min(Math.floor(at), stops.length - 2), share = at - k;
    return stops[k].map((c, i) => Math.round(c + share * (stops[k + 1][i] - c)));
  };
  const css = (rgb) => `rgb(${rgb.join(",")})`;
  const not_measured = [168, 172, 178];
  const region = { 1: [supine.of_body("inner side, on the muscle", "on a support"), [86, 180, 233]], 2: ["skin", [231, 190, 158]], 3: ["ligament ring", [0, 158, 115]],
    4: ["cut", [120, 120, 120]] };
  const organ = { gland: [204, 121, 167], tumour: [213, 60, 0], nipple: [160, 82, 45], vessel: [86, 60, 180] };

  // Legend of signed distance, limit in mm.
  const legend = (limit) => {
    const { node, text, ticks } = supine.svg;
    const steps = 60, x = (t) => 20 + ((t + 1) / 2) * 360;
    const bars = Array.from({ length: steps }, (_, i) => {
      const t = -1 + (2 * (i + 0.5)) / steps;
      return node("rect", { x: x(t) - 3.2, y: 20, width: 6.4, height: 14, fill: css(diverging(t)) });
    });
    const list = ticks(-limit, limit, 4);
    const digits = supine.svg.digits_of(list);
    return supine.svg.picture(400, 56, `Colours: signed distance from −${limit} to +${limit} mm`, bars,
      list.map((v) => [node("line", { x1: x(v / limit), x2: x(v / limit), y1: 34, y2: 38, class: "axis" }),
        text(x(v / limit), 52, supine.signed(v, digits), "small middle")]),
      text(20, 13, "◀ scan inside the model", "small"), text(380, 13, "scan outside ▶", "small end"), text(200, 13, "mm", "small middle soft"));
  };
  supine.colours = { diverging, css, not_measured, region, organ, legend };
})();
