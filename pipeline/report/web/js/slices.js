// SPDX-License-Identifier: AGPL-3.0-or-later
// The volume on the operating table: three slices with one cross-hair, window and level, and the regions of the targets.
"use strict";
(() => {
  const { data, el, section, number } = supine;

  // Axes of a slice as one faces the patient: across and down the picture, with their signs in patient LPS.
  const planes = [{ name: "axial", across: 0, down: 1, through: 2, flip: [1, 1], ends: ["R", "L", "A", "P"] }, { name: "coronal", across: 0, down: 2, through: 1, flip: [1, -1], ends: ["R", "L", "H", "F"] },
    { name: "sagittal", across: 1, down: 2, through: 0, flip: [1, -1], ends: ["A", "P", "H", "F"] }];

  class Slices {
    constructor(volume, regions) {
      this.volume = volume;
      this.regions = regions;
      this.voxels = Uint8Array.from(atob(volume.voxels), (c) => c.charCodeAt(0));
      this.at = volume.size.map((n) => Math.floor(n / 2));
      this.level = 128;
      this.window = 256;
      this.views = planes.map((plane) => this.make_view(plane));
      this.told = el("p", { class: "hint", role: "status", id: "slices-status" });
      const range = (label, key, low, high) => el("label", {}, label, el("input", { type: "range", min: low, max: high, value: this[key], "aria-label": label, "data-key": key,
        oninput: (event) => { this[key] = +event.target.value; this.draw(); } }));
      const centre = (r) => el("button", { type: "button", "data-target": r.name, onclick: () => this.go(r.place_mm) }, r.name);
      this.node = el("div", {}, el("div", { class: "slices" }, this.views.map((v) => v.node)), el("div", { class: "slices-tools" }, range("window", "window", 8, 512), range("level", "level", 0, 255), regions.map(centre)), this.told,
        el("p", { class: "hint" }, "Click to move the cross-hair, wheel or arrow keys to scroll. Ellipses: 95 % regions, cut by the slice. R L A P H F are the patient's."));
      if (regions.length) this.go(regions[0].place_mm);
      else this.draw();
    }

    make_view(plane) {
      const { size } = this.volume, canvas = el("canvas", { width: size[plane.across], height: size[plane.down], tabindex: 0, role: "img", "data-plane": plane.name, "aria-label": `${plane.name} slice; arrow keys scroll` });
      const over = supine.svg.node("svg", { class: "slice-over", viewBox: `0 0 ${size[plane.across]} ${size[plane.down]}`, "aria-hidden": "true" });
      const step = (by) => { this.at[plane.through] = this.inside(plane.through, this.at[plane.through] + by); this.draw(); };
      canvas.addEventListener("wheel", (event) => { event.preventDefault(); step(Math.sign(event.deltaY)); }, { passive: false });
      canvas.addEventListener("keydown", (event) => {
        const by = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1 }[event.key];
        if (by) { event.preventDefault(); step(by); }
      });
      canvas.addEventListener("click", (event) => {
        const box = canvas.getBoundingClientRect(), share = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
        [plane.across, plane.down].forEach((axis, k) => {
          const i = Math.floor(share[k] * size[axis]);
          this.at[axis] = this.inside(axis, plane.flip[k] > 0 ? i : size[axis] - 1 - i);
        });
        this.draw();
      });
      return { plane, canvas, over, node: el("div", { class: "slice", style: `flex: ${size[plane.across]} 1 0` }, el("p", { class: "title" }, plane.name), el("div", { class: "slice-picture" }, canvas, over)) };
    }

    inside(axis, index) { return Math.min(Math.max(index, 0), this.volume.size[axis] - 1); }

    place() { return this.at.map((i, axis) => this.volume.origin_mm[axis] + this.volume.spacing_mm * i); }

    go(place) {
      this.at = place.map((x, axis) => this.inside(axis, Math.round((x - this.volume.origin_mm[axis]) / this.volume.spacing_mm)));
      this.draw();
    }

    shade(byte) { return Math.min(255, Math.max(0, 255 * ((byte - this.level) / this.window + 0.5))); }

    draw() {
      this.views.forEach((view) => { this.draw_grey(view); this.draw_over(view); });
      const { size, black, white } = this.volume, byte = this.voxels[this.at[0] + size[0] * (this.at[1] + size[1] * this.at[2])];
      this.told.replaceChildren(`Cross-hair at ${this.place().map((x) => number(x, 1)).join(", ")} mm (LPS); value ${number(black + (byte / 255) * (white - black), 0)}.`);
    }

    draw_grey({ plane, canvas }) {
      const { size } = this.volume, stride = [1, size[0], size[0] * size[1]], width = size[plane.across], height = size[plane.down], context = canvas.getContext("2d");
      const picture = context.createImageData(width, height), first = this.at[plane.through] * stride[plane.through], table = Uint8Array.from({ length: 256 }, (_, byte) => this.shade(byte));
      for (let row = 0; row < height; ++row) {
        const down = first + (plane.flip[1] > 0 ? row : height - 1 - row) * stride[plane.down];
        for (let column = 0; column < width; ++column) {
          const grey = table[this.voxels[down + column * stride[plane.across]]], k = 4 * (row * width + column);
          picture.data[k] = picture.data[k + 1] = picture.data[k + 2] = grey;
          picture.data[k + 3] = 255;
        }
      }
      context.putImageData(picture, 0, 0);
    }

    // A place of the patient in a slice's picture, pixels.
    pixel(plane, place) {
      const { origin_mm, spacing_mm, size } = this.volume;
      return [plane.across, plane.down].map((axis, k) => {
        const i = (place[axis] - origin_mm[axis]) / spacing_mm + 0.5;
        return plane.flip[k] > 0 ? i : size[axis] - i;
      });
    }

    draw_over({ plane, over }) {
      const { node, text } = supine.svg, { size } = this.volume, width = size[plane.across], height = size[plane.down], [x, y] = this.pixel(plane, this.place());
      const line = (a) => node("line", { class: "cross", x1: a[0], y1: a[1], x2: a[2], y2: a[3] });
      const ellipses = this.regions.map((r) => this.cut(plane, r)).filter(Boolean);
      const font = Math.max(width, height) / 22, at = [[font * 0.3, height / 2], [width - font, height / 2], [width / 2, font], [width / 2, height - font * 0.4]];
      const letter = (word, [u, v]) => { const t = text(u, v, word); t.style.fontSize = `${font}px`; return t; };
      over.replaceChildren(line([x, 0, x, height]), line([0, y, width, y]), ...ellipses.map((d) => node("path", { class: "region", d })), ...plane.ends.map((word, k) => letter(word, at[k])));
    }

    // Outline of a region in the slice: points p with (p − c)ᵀ Σ⁻¹ (p − c) = 7.815; null where the slice misses it.
    cut(plane, { place_mm, half_axes_mm, axes }) {
      const through = this.place()[plane.through] - place_mm[plane.through], form = (u, v) => axes.reduce((sum, axis, k) => {
        const w = (u * axis[plane.across] + v * axis[plane.down]) / half_axes_mm[k];
        return sum + w * w;
      }, 0);
      const mixed = (a, b) => axes.reduce((sum, axis, k) => sum + (axis[a] * axis[b]) / half_axes_mm[k] ** 2, 0);
      const [aa, ab, bb, at, bt, tt] = [mixed(plane.across, plane.across), mixed(plane.across, plane.down), mixed(plane.down, plane.down), mixed(plane.across, plane.through),
        mixed(plane.down, plane.through), mixed(plane.through, plane.through)], det = aa * bb - ab * ab;
      const mu = [(-through * (bb * at - ab * bt)) / det, (-through * (aa * bt - ab * at)) / det];
      const left = 1 - (tt * through * through - (aa * mu[0] ** 2 + 2 * ab * mu[0] * mu[1] + bb * mu[1] ** 2));
      if (left <= 0) return null;
      const outline = Array.from({ length: 48 }, (_, k) => {
        const u = Math.cos((Math.PI * k) / 24), v = Math.sin((Math.PI * k) / 24), reach = Math.sqrt(left / form(u, v)), place = [...place_mm];
        place[plane.across] += mu[0] + reach * u;
        place[plane.down] += mu[1] + reach * v;
        return this.pixel(plane, place).map((p) => p.toFixed(2)).join(",");
      });
      return `M${outline.join("L")}Z`;
    }
  }

  supine.slices = () => {
    const volume = data.slices;
    if (!volume && !supine.stage("segment")) return section("slices", "Slices", el("p", {}, "The image is a surface: there is no volume to cut."));
    if (!volume) return section("slices", "Slices", el("div", { class: "gap" }, "No volume has been carried into the pose yet. To get it: ", supine.command(data.commands.warp)));
    const found = supine.targets_of(volume.pose);
    supine.slice_view = new Slices(volume, found ? found.points : []);
    return section("slices", `Slices in ${volume.pose}`, el("p", {}, `${volume.file}, carried along with the model.`), supine.slice_view.node);
  };
})();
