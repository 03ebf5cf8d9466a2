// SPDX-License-Identifier: AGPL-3.0-or-later
// The 3-D view: one body that goes from prone over undeformed to a pose, for each model on the way to the least error.
import * as model from "./model.js";
import { Overlay } from "./overlay.js";
import { box as check_box, choice, group, picker, slider } from "./panel.js";
import { Scene } from "./scene.js";
import { dot, nearest, plus, row, scaled } from "./geometry.js";

const { el, colours, shown, words } = supine;

class View {
  constructor(holder) {
    const last_compared = [...model.states].reverse().find((s) => model.comparison_of(s, supine.data.case.predicted));
    const preferred = model.state_of("calibrated") || last_compared || model.states[0];
    this.state = preferred;
    this.pose = preferred.poses[supine.data.case.predicted] ? supine.data.case.predicted : Object.keys(preferred.poses)[0];
    this.morph = 2;
    this.colour = model.distance_of(this.state, this.pose) ? "distance" : "plain";
    this.show = { skin: 1, organs: true, scan: "off", muscle: false, landmarks: true, labels: true, ghost: false, regions: false };
    this.place = el("div", { class: "scene", tabindex: 0, role: "application", "aria-label": `3-D view of the ${supine.of_body("breast", "body")}; arrow keys turn it, plus and minus zoom, 1 to 5 are views` });
    this.panel = el("div", { class: "panel" });
    this.status = el("p", { class: "hint", role: "status", "aria-live": "polite" });
    this.legend = el("div", { class: "legend" });
    holder.replaceChildren(el("div", { class: "view" }, el("div", {}, this.place, this.legend, this.status), this.panel));
    this.scene = new Scene(this.place);
    this.overlay = new Overlay(this.place);
    this.make_layers();
    this.make_panel();
    this.place.addEventListener("keydown", (event) => this.key(event));
    this.scene.onChange(() => this.write_over());
    this.update();
    this.view("oblique");
    this.scene.resize();
    this.print();
    performance.mark("supine-first-picture");
  }

  make_layers() {
    const { scene } = this;
    this.layers = { muscle: scene.layer(model.muscle.triangles), organs: {}, scan: null };
    this.layers.muscle.setPoints(model.muscle.points);
    this.layers.muscle.setColours([170, 90, 80]);
    for (const organ of model.organs) {
      const layer = (this.layers.organs[organ.name] = scene.layer(organ.triangles));
      layer.setColours(colours.organ[organ.name] || [120, 120, 160]);
    }
    this.layers.ghost = scene.layer(model.body.triangles);
    this.layers.ghost.setPoints(model.body_at(this.state, this.pose, 0));
    this.layers.ghost.setColours([120, 130, 140]);
    this.layers.body = scene.layer(model.body.triangles);
    this.fit();
  }

  fit() {
    const shapes = model.states.flatMap((s) => [0, 1, 2].map((m) => model.body_at(s, s.poses[this.pose] ? this.pose : Object.keys(s.poses)[0], m)));
    this.scene.fitTo(shapes);
  }

  make_panel() {
    const noted = (s) => {
      const c = model.comparison_of(s, this.pose);
      return c ? shown(model.comparison_file(s, this.pose), ["rms_mm"]) : "";
    };
    const rung = choice("Model, RMS error in mm", model.states.map((s) => ({ id: s.id, label: words(s.label), note: noted(s) })), this.state.id, (id) => {
      this.state = model.state_of(id);
      if (!this.state.poses[this.pose]) this.pose = Object.keys(this.state.poses)[0];
      this.update();
    }, "rungs");
    const poses = Object.keys(this.state.poses);
    const pose = poses.length > 1 ? choice("Pose", poses.map((id) => ({ id, label: id })), this.pose, (id) => {
      this.pose = id;
      this.make_panel();
      this.fit();
      this.set_morph(2);
    }).node : "";
    const { imaged } = supine.data.case;
    this.morph_input = slider(`from ${imaged} over undeformed to the pose`, 100 * this.morph, 0, 200, (v) => this.set_morph(v / 100));
    const stop = (label, at) => el("button", { type: "button", "data-morph": at, onclick: () => this.go(at) }, label);
    const { show } = this, both = supine.data.case.side === "both", of_body = supine.of_body;
    const views = of_body([["front", "front"], ["outer", both ? "left side" : "outer side"], ["inner", both ? "right side" : "inner side"], ["feet", "feet"], ["head", "head"]],
      [["front", "front"], ["outer", "one end"], ["inner", "other end"], ["feet", "below"], ["head", "above"]]);
    const set = (key) => (value) => { show[key] = value; this.update(); };
    this.panel.replaceChildren(rung.node, pose, group("Shape", this.morph_input, el("div", { class: "stops" }, imaged === "undeformed" ? "" : stop(imaged, 0), stop("undeformed", 1), stop(this.pose, 2))),
      choice("Colour of the skin", [{ id: "distance", label: "distance" }, { id: "region", label: "regions" }, { id: "plain", label: "plain" }], this.colour, (id) => { this.colour = id; this.update(); }).node,
      group("Show", el("div", {}, "skin, from see-through to solid", slider("opacity of the skin", 100 * show.skin, 0, 100, (v) => set("skin")(v / 100))),
        model.organs.length ? check_box(model.organs.map((o) => o.name).join(", "), show.organs, set("organs"), colours.organ[model.organs[0].name]) : "",
        picker("measured scan ", [["off", "off"], ["points", "points"], ["surface", "surface"]], show.scan, set("scan")),
        check_box("landmarks (● predicted, ○ measured)", show.landmarks, set("landmarks")), check_box("names of what is off", show.labels, set("labels")),
        model.targets_of(this.pose).length ? check_box("95 % regions and depths", show.regions, set("regions")) : "",
        check_box(`${imaged} shape beside it`, show.ghost, set("ghost")), check_box(of_body("chest muscle", "supports"), show.muscle, set("muscle"))),
      group("Look from", el("div", { class: "row" }, views.map(([id, label]) => el("button", { type: "button", "data-view": id, onclick: () => this.view(id) }, label)))),
      model.targets_of(this.pose).length ? el("button", { type: "button", "data-id": "table", onclick: () => this.on_the_table() }, `Targets in ${this.pose}`) : "",
      el("p", { class: "hint" }, "Drag to turn, wheel to zoom. Keys in the picture: arrows, + −, 1 to 5, 0."),
      el("button", { type: "button", onclick: () => this.save() }, "Scan and distances as CSV"));
  }

  // What is asked for before an operation: the body see-through, what is in it, regions and depths.
  on_the_table() {
    Object.assign(this.show, { skin: 0.4, organs: true, regions: true, labels: false, scan: "off", landmarks: false });
    this.colour = "plain";
    this.make_panel();
    this.set_morph(2);
  }

  view(name) {
    const { outward, lateral, head } = model.directions;
    const views = { oblique: [plus(outward, scaled(lateral, 0.35), scaled(head, -0.55)), head], front: [outward, head], outer: [lateral, head], inner: [scaled(lateral, -1), head],
      feet: [scaled(head, -1), outward], head: [head, outward] };
    this.scene.look(...views[name]);
  }

  set_morph(value) {
    this.morph = value;
    this.morph_input.value = 100 * value;
    this.update();
  }

  // Runs to a stop, so that the eye can follow.
  go(target) {
    cancelAnimationFrame(this.running);
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.set_morph(target);
    const from = this.morph, began = performance.now(), last = 700 * Math.abs(target - from);
    const step = (now) => {
      const share = last ? Math.min(1, (now - began) / last) : 1;
      this.set_morph(from + (target - from) * share);
      if (share < 1) this.running = requestAnimationFrame(step);
    };
    this.running = requestAnimationFrame(step);
  }

  update() {
    const { state, pose, morph, show, layers } = this;
    this.points = model.body_at(state, pose, morph);
    layers.body.setPoints(this.points);
    layers.body.setColours(this.body_colours());
    layers.body.setOpacity(show.skin);
    for (const organ of model.organs) {
      const visible = show.organs && show.skin < 1;
      if (visible) layers.organs[organ.name].setPoints(model.organ_at(state, pose, morph, organ.name));
      layers.organs[organ.name].setOpacity(visible ? 1 : 0);
    }
    layers.ghost.setOpacity(show.ghost && morph > 0.02 ? 0.3 : 0);
    layers.muscle.setOpacity(show.muscle ? 1 : 0);
    this.update_scan();
    this.tell();
    this.scene.render();
  }

  body_colours() {
    const count = this.points.length / 3, bytes = new Uint8Array(3 * count), limit = model.colour_limit;
    const distance = this.colour === "distance" ? model.distance_of(this.state, this.pose) : null;
    for (let i = 0; i < count; ++i) {
      let rgb = colours.region[2][1];
      if (this.colour === "region") rgb = colours.region[model.region_of_point[i]][1];
      else if (this.colour === "distance") rgb = distance && isFinite(distance[i]) ? colours.diverging(distance[i] / limit) : colours.not_measured;
      bytes.set(rgb, 3 * i);
    }
    return bytes;
  }

  update_scan() {
    const { show } = this, scan = show.scan === "off" || this.morph < 1.999 ? null : model.scan_of(this.state, this.pose);
    if (this.layers.scan) this.scene.renderer.removeActor(this.layers.scan.actor);
    this.layers.scan = null;
    if (!scan) return;
    const surface = show.scan === "surface" && scan.triangles.length > 0;
    const layer = (this.layers.scan = this.scene.layer(surface ? scan.triangles : new Uint32Array(0)));
    layer.setPoints(scan.points);
    if (surface) {
      const bytes = new Uint8Array(scan.points.length);
      scan.distance.forEach((d, i) => bytes.set(isFinite(d) ? colours.diverging(d / model.colour_limit) : colours.not_measured, 3 * i));
      layer.setColours(bytes);
    } else {
      layer.setColours([20, 24, 28]);
      layer.setPointSize(3);
    }
  }

  // What is shown, in words, and its legend.
  tell() {
    const { state, pose, morph } = this, { imaged } = supine.data.case, shape = morph === 0 ? imaged : morph === 1 ? "undeformed" : morph === 2 ? pose : `on the way, ${morph < 1 ? imaged + " to undeformed" : "undeformed to " + pose}`;
    const comparison = model.comparison_of(state, pose);
    this.status.replaceChildren(`${words(state.label)}, ${shape}`, comparison ? `; distance to the scan in pose ${pose}: RMS ` : "",
      comparison ? shown(model.comparison_file(state, pose), ["rms_mm"]) : "", comparison ? " mm." : ".", this.colour === "distance" && comparison ? " Grey: not measured." : "");
    const names = this.colour === "region" ? Object.values(colours.region) : [];
    this.legend.replaceChildren(this.colour === "distance" && comparison ? colours.legend(model.colour_limit) : "",
      ...names.map(([name, rgb]) => el("span", { style: "margin-right:1rem" }, el("span", { class: "swatch", style: `background:rgb(${rgb.join(",")})` }), " " + name)));
  }

  write_over() {
    const { width, height } = this.place.getBoundingClientRect(), toward = this.scene.toward(), normal = this.layers.body.normals;
    const faces = (i) => dot(row(normal, i), toward) > 0.05;
    const spots = this.show.labels && this.colour === "distance" ? model.spots_of(this.state, this.pose).filter((s) => faces(s.point)) : [];
    const marks = this.show.landmarks ? model.landmarks_at(this.state, this.pose, this.morph) : [];
    const seen = marks.filter((m) => faces(nearest(this.points, m.predicted, (i) => model.region_of_point[i] === 2)));
    const targets = this.show.regions && this.morph > 1.999 ? model.targets_of(this.pose) : [];
    const gravity = this.morph < 0.5 ? model.gravity_of(supine.data.case.imaged) : this.morph > 1.5 ? model.gravity_of(this.pose) : [0, 0, 0];
    this.overlay.draw(width, height, spots.map((s) => ({ text: s.text, at: this.scene.project(row(this.points, s.point)) })),
      seen.map((m) => ({ name: m.name, predicted: this.scene.project(m.predicted), measured: m.measured && this.scene.project(m.measured) })),
      gravity.every((g) => g === 0) ? null : this.scene.flat(gravity), targets.map((t) => this.flat_target(t)));
  }

  // A region's outline in the picture, and the way to the nearest skin.
  flat_target({ name, place, half_axes, axes, skin, depth }) {
    const at = this.scene.project(place), far = axes.map((axis, k) => {
      const [x, y] = this.scene.project(plus(place, scaled(axis, half_axes[k])));
      return [x - at[0], y - at[1]];
    });
    return { name, at, far, skin: skin && this.scene.project(skin), depth };
  }

  key(event) {
    const { scene } = this;
    const keys = { ArrowLeft: () => scene.turn(8, 0), ArrowRight: () => scene.turn(-8, 0), ArrowUp: () => scene.turn(0, -8), ArrowDown: () => scene.turn(0, 8),
      "+": () => scene.zoom(1.15), "=": () => scene.zoom(1.15), "-": () => scene.zoom(1 / 1.15), 0: () => this.view("oblique"), 1: () => this.view("front"),
      2: () => this.view("outer"), 3: () => this.view("inner"), 4: () => this.view("feet"), 5: () => this.view("head") };
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  }

  save() {
    const scan = model.scan_of(this.state, this.pose);
    if (!scan) return;
    const lines = ["x_mm,y_mm,z_mm,distance_mm"];
    scan.distance.forEach((d, i) => lines.push([...row(scan.points, i), isFinite(d) ? d : ""].join(",")));
    const url = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
    el("a", { href: url, download: `scan_${this.state.id}_${this.pose}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  }

  // A canvas prints empty: paper gets a picture of it. The names over it stay as they are and are scaled along.
  print() {
    addEventListener("beforeprint", () => {
      this.scene.frozen = true;
      this.paper = el("img", { src: this.scene.picture(), alt: "", style: "position:absolute;inset:0;width:100%;height:100%;object-fit:contain" });
      this.scene.canvas.style.visibility = "hidden";
      this.place.prepend(this.paper);
    });
    addEventListener("afterprint", () => {
      if (this.paper) this.paper.remove();
      this.scene.canvas.style.visibility = "";
      this.scene.frozen = false;
      this.scene.resize();
    });
  }
}

supine.start_view3d = (holder) => { supine.view3d = new View(holder); };
