// SPDX-License-Identifier: AGPL-3.0-or-later
// The drawing: surfaces whose points and colours can change, a camera with named views. Everything of vtk.js is here.
import "@kitware/vtk.js/Rendering/OpenGL/Profiles/Geometry.js";
import vtkActor from "@kitware/vtk.js/Rendering/Core/Actor.js";
import vtkDataArray from "@kitware/vtk.js/Common/Core/DataArray.js";
import vtkMapper from "@kitware/vtk.js/Rendering/Core/Mapper.js";
import vtkOpenGLRenderWindow from "@kitware/vtk.js/Rendering/OpenGL/RenderWindow.js";
import vtkPolyData from "@kitware/vtk.js/Common/DataModel/PolyData.js";
import vtkRenderer from "@kitware/vtk.js/Rendering/Core/Renderer.js";
import vtkRenderWindow from "@kitware/vtk.js/Rendering/Core/RenderWindow.js";
import vtkRenderWindowInteractor from "@kitware/vtk.js/Rendering/Core/RenderWindowInteractor.js";
import vtkTrackball from "@kitware/vtk.js/Interaction/Style/InteractorStyleTrackballCamera.js";
import { side_room } from "./overlay.js";
import { box, cross, dot, normals, plus, scaled, unit } from "./geometry.js";

// One surface, or a cloud of points where there are no triangles.
class Layer {
  constructor(renderer, triangles) {
    this.triangles = triangles;
    this.data = vtkPolyData.newInstance();
    this.mapper = vtkMapper.newInstance({ interpolateScalarsBeforeMapping: false });
    this.mapper.setInputData(this.data);
    this.actor = vtkActor.newInstance();
    this.actor.setMapper(this.mapper);
    const property = this.actor.getProperty();
    // Mostly flat light: the colours must read as in the legend.
    property.setAmbient(0.5);
    property.setDiffuse(0.55);
    property.setSpecular(0);
    renderer.addActor(this.actor);
    if (triangles.length) this.data.getPolys().setData(cells(triangles, 3));
  }

  setPoints(points) {
    this.points = points;
    this.data.getPoints().setData(points, 3);
    if (this.triangles.length) {
      this.normals = normals(points, this.triangles);
      this.data.getPointData().setNormals(vtkDataArray.newInstance({ name: "Normals", values: this.normals, numberOfComponents: 3 }));
    } else if (this.data.getVerts().getNumberOfCells() !== points.length / 3) {
      this.data.getVerts().setData(cells(Uint32Array.from({ length: points.length / 3 }, (_, i) => i), 1));
    }
    this.data.getPoints().modified();
    this.data.modified();
  }

  // Bytes r g b of each point, or one colour [r, g, b] for all.
  setColours(colours) {
    const each = colours instanceof Uint8Array;
    this.mapper.setScalarVisibility(each);
    if (each) this.data.getPointData().setScalars(vtkDataArray.newInstance({ name: "colours", values: colours, numberOfComponents: 3 }));
    else this.actor.getProperty().setColor(...colours.map((c) => c / 255));
    this.data.modified();
  }

  setOpacity(opacity) {
    this.actor.getProperty().setOpacity(opacity);
    this.actor.setVisibility(opacity > 0);
  }

  setPointSize(pixels) {
    this.actor.getProperty().setRepresentationToPoints();
    this.actor.getProperty().setPointSize(pixels);
    this.actor.getProperty().setLighting(false);
  }
}

function cells(corners, size) {
  const list = new Uint32Array((corners.length / size) * (size + 1));
  for (let c = 0, at = 0; c < corners.length; c += size) {
    list[at++] = size;
    for (let k = 0; k < size; ++k) list[at++] = corners[c + k];
  }
  return list;
}

export class Scene {
  // @throws Error where there is no WebGL 2
  constructor(holder) {
    if (!document.createElement("canvas").getContext("webgl2")) throw new Error("no WebGL 2");
    this.holder = holder;
    this.window = vtkRenderWindow.newInstance();
    this.renderer = vtkRenderer.newInstance();
    this.renderer.setBackground(0, 0, 0, 0);
    this.window.addRenderer(this.renderer);
    this.gl = vtkOpenGLRenderWindow.newInstance();
    this.window.addView(this.gl);
    this.gl.setContainer(holder);
    this.canvas = holder.querySelector("canvas");
    const interactor = vtkRenderWindowInteractor.newInstance();
    interactor.setView(this.gl);
    interactor.initialize();
    interactor.bindEvents(holder);
    interactor.setInteractorStyle(vtkTrackball.newInstance());
    this.camera = this.renderer.getActiveCamera();
    this.camera.setParallelProjection(true);
    this.listeners = [];
    this.camera.onModified(() => this.changed());
    new ResizeObserver(() => this.resize()).observe(holder);
  }

  layer(triangles) { return new Layer(this.renderer, triangles); }

  // Calls back whenever the picture has to be thought of as another one.
  onChange(listener) { this.listeners.push(listener); }
  changed() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      if (this.frozen) return;
      this.listeners.forEach((listener) => listener());
    });
  }

  resize() {
    if (this.frozen) return;
    const { width, height } = this.holder.getBoundingClientRect();
    if (width < 2 || height < 2) return;
    const density = Math.min(window.devicePixelRatio || 1, 2);
    this.gl.setSize(Math.round(width * density), Math.round(height * density));
    this.frame();
    this.render();
  }

  render() {
    this.renderer.resetCameraClippingRange();
    this.window.render();
    this.changed();
  }

  // The shapes that every view is fitted to.
  fitTo(shapes) {
    const [low, high] = box(...shapes);
    this.centre = scaled(plus(low, high), 0.5);
    this.shapes = shapes;
  }

  // Looks along −from, `up` upward.
  look(from, up) {
    this.camera.setFocalPoint(...this.centre);
    this.camera.setPosition(...plus(this.centre, scaled(unit(from), 600)));
    this.camera.setViewUp(...up);
    this.camera.orthogonalizeViewUp();
    this.fitted = true;
    this.frame();
    this.render();
  }

  // As large as the shapes allow; once somebody has zoomed, that size stays.
  frame() {
    if (!this.fitted) return;
    const { width, height } = this.holder.getBoundingClientRect();
    const up = unit(this.camera.getViewUp()), right = unit(cross(this.camera.getDirectionOfProjection(), up));
    const [low, high] = [[0, 0], [0, 0]], axes = [right, up], middle = axes.map((axis) => dot(this.centre, axis));
    for (const points of this.shapes)
      for (let i = 0; i < points.length; i += 3)
        axes.forEach((axis, k) => {
          const at = points[i] * axis[0] + points[i + 1] * axis[1] + points[i + 2] * axis[2] - middle[k];
          low[k] = Math.min(low[k], at);
          high[k] = Math.max(high[k], at);
        });
    const focus = plus(this.centre, scaled(right, (low[0] + high[0]) / 2), scaled(up, (low[1] + high[1]) / 2));
    this.camera.setFocalPoint(...focus);
    this.camera.setPosition(...plus(focus, scaled(this.camera.getDirectionOfProjection(), -600)));
    const half = [0, 1].map((k) => (high[k] - low[k]) / 2);
    this.camera.setParallelScale(Math.max(1.1 * half[1], (half[0] * height) / Math.max(width - 2 * side_room(width), 100)));
  }

  turn(azimuth, elevation) {
    this.camera.azimuth(azimuth);
    this.camera.elevation(elevation);
    this.camera.orthogonalizeViewUp();
    this.render();
  }

  zoom(factor) {
    this.fitted = false;
    this.camera.setParallelScale(this.camera.getParallelScale() / factor);
    this.render();
  }

  // Place on the page, pixels from the holder's upper left corner.
  project(point) {
    const { width, height } = this.holder.getBoundingClientRect();
    const direction = this.camera.getDirectionOfProjection(), up = unit(this.camera.getViewUp()), right = unit(cross(direction, up));
    const offset = plus(point, scaled(this.camera.getFocalPoint(), -1)), size = height / (2 * this.camera.getParallelScale());
    return [width / 2 + size * dot(offset, right), height / 2 - size * dot(offset, up)];
  }

  // A direction of space in the plane of the picture (x right, y down), and how much of it lies in that plane.
  flat(vector) {
    const direction = this.camera.getDirectionOfProjection(), up = unit(this.camera.getViewUp()), right = unit(cross(direction, up));
    return [dot(vector, right), -dot(vector, up)];
  }

  toward() { return scaled(this.camera.getDirectionOfProjection(), -1); }

  // The picture as it is, a data URI.
  picture() {
    this.window.render();
    return this.canvas.toDataURL("image/png");
  }
}
