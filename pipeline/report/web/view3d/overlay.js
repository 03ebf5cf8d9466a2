// SPDX-License-Identifier: AGPL-3.0-or-later
// What is written over the picture: names with leaders, landmarks, the direction of gravity.
const { node, text } = supine.svg;

// Room that names take on either side of a picture, pixels.
export const side_room = (width) => (width < 620 ? 10 : 175);

export class Overlay {
  constructor(holder) {
    this.svg = node("svg", { class: "over", "aria-hidden": "true" });
    holder.append(this.svg);
  }

  // labels: {at: [x, y], text}; landmarks: {name, predicted: [x, y] or null, measured: [x, y] or null}; gravity: [dx, dy];
  // targets: {name, at: [x, y], far: the ends of the half axes from there, skin: [x, y] or null, depth}
  draw(width, height, labels, landmarks, gravity, targets = []) {
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const placed = place(labels, width, height);
    this.svg.replaceChildren(...targets.flatMap(region), ...landmarks.flatMap(mark), ...placed.flatMap(({ at, box, above, text: words }) => {
      const left = box.x + box.width / 2 < at[0];
      const edge = above ? [box.x + box.width / 2, box.y + box.height] : [left ? box.x + box.width + 3 : box.x - 3, box.y + box.height / 2];
      return [node("path", { class: "leader", d: `M${edge}L${at}` }), node("circle", { class: "predicted", cx: at[0], cy: at[1], r: 2.5 }),
        text(box.x, box.y + 13, words, "strong")];
    }), ...arrow(gravity, height));
  }
}

// The outline of an ellipsoid seen from far away: with the ends of its half axes as columns of M it is { M Mᵀ }^½ of a circle.
function region({ name, at, far, skin, depth }) {
  const a = far.reduce((sum, f) => sum + f[0] * f[0], 0), b = far.reduce((sum, f) => sum + f[0] * f[1], 0), c = far.reduce((sum, f) => sum + f[1] * f[1], 0);
  const middle = (a + c) / 2, spread = Math.hypot((a - c) / 2, b), turn = (0.5 * Math.atan2(2 * b, a - c) * 180) / Math.PI;
  const nodes = [node("ellipse", { class: "shell", cx: at[0], cy: at[1], rx: Math.sqrt(middle + spread), ry: Math.sqrt(Math.max(middle - spread, 0)), transform: `rotate(${turn} ${at[0]} ${at[1]})` })];
  const inside = skin && depth > 2;
  if (inside) nodes.push(node("line", { class: "depth", x1: at[0], y1: at[1], x2: skin[0], y2: skin[1] }), node("circle", { class: "predicted", cx: skin[0], cy: skin[1], r: 3 }));
  nodes.push(text(at[0] + 10, at[1] + 4, inside ? `${name}, ${depth.toFixed(0)} mm deep` : name, "strong"));
  return nodes;
}

function mark({ name, predicted, measured }) {
  const nodes = [];
  if (predicted && measured) nodes.push(node("line", { class: "gap-line", x1: predicted[0], y1: predicted[1], x2: measured[0], y2: measured[1] }));
  if (measured) nodes.push(...["halo", "measured"].map((cls) => node("circle", { class: cls, cx: measured[0], cy: measured[1], r: 6.5 })));
  if (predicted) nodes.push(node("circle", { class: "predicted", cx: predicted[0], cy: predicted[1], r: 4 }));
  const at = predicted || measured;
  if (at) nodes.push(text(at[0] + 10, at[1] + 15, name, "small"));
  return nodes;
}

// Names stand beside the body, in a column per side, none on another.
function place(labels, width, height) {
  const line = 19, size_of = (label) => 7.6 * label.text.length + 4;
  // Where there is no room beside it they stand above.
  if (width < 620) return labels.map((label, i) => {
    const size = size_of(label), x = Math.min(Math.max(label.at[0] - size / 2, 8), width - size - 8);
    return { ...label, above: true, box: { x, y: 8 + line * i, width: size, height: line } };
  });
  const columns = { left: [], right: [] };
  for (const label of labels) columns[label.at[0] < width / 2 ? "left" : "right"].push(label);
  return Object.entries(columns).flatMap(([side, list]) => {
    list.sort((a, b) => a.at[1] - b.at[1]);
    let below = 8;
    const boxes = list.map((label) => {
      const size = size_of(label), y = Math.max(below, label.at[1] - line / 2);
      below = y + line;
      return { ...label, box: { x: side === "left" ? 10 : width - size - 10, y, width: size, height: line } };
    });
    const over = boxes.length ? Math.max(0, boxes[boxes.length - 1].box.y + line - (height - 8)) : 0;
    boxes.forEach((b) => { b.box.y -= over; });
    return boxes;
  });
}

function arrow(direction, height) {
  if (!direction) return [];
  const [dx, dy] = direction;
  const size = Math.hypot(dx, dy), x = 34, y = height - 44;
  if (size < 0.2) return [node("circle", { class: "measured", cx: x, cy: y, r: 6 }), node("circle", { class: "predicted", cx: x, cy: y, r: 2 }), text(x + 14, y + 5, "gravity, along the view", "small")];
  const [ux, uy] = [dx / size, dy / size], tip = [x + 22 * dx, y + 22 * dy], tail = [x - 22 * dx, y - 22 * dy];
  const wing = (s) => [tip[0] - 8 * ux - s * 5 * uy, tip[1] - 8 * uy + s * 5 * ux];
  return [node("path", { class: "leader", "stroke-width": 2, d: `M${tail}L${tip}M${wing(1)}L${tip}L${wing(-1)}` }), text(x + 28, y + 5, "gravity", "small")];
}
