// The picture: renderer, camera in parallel projection, its presets, rays and the scale bar.
import {
  ColorManagement,
  LinearSRGBColorSpace,
  OrthographicCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { make } from "./dom.js";

ColorManagement.enabled = false; // colours are shown as they are given

export const PRESETS = ["overview", "above", "along", "side", "follow"];
// Where presets look from: ahead of the workpiece, to its left, and above; "above" keeps y upright instead.
const FROM = { overview: [0.55, -0.75, 0.4], along: [-1, 0, 0], side: [0, -1, 0], follow: [-0.75, -0.5, 0.45] },
  ABOVE = new Vector3(0, -1e-4, 1);
const FINE = 2; // pixels of the picture per pixel of the page at rest: smooth edges
const LEAST_RATIO = 0.6;
const REST_MS = 180,
  SLOW_MS = 32;
const UP = new Vector3(0, 0, 1);

export class View {
  /** `area()`: centre, radius, reach to the sides and height, mm, of what is to be seen; `pose()`: that of the workpiece. */
  constructor(canvas, { area, pose }) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setClearColor(0xffffff);
    this.scene = new Scene();
    this.camera = new OrthographicCamera();
    this.camera.up.copy(UP);
    Object.assign(this, { area, pose });
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enableDamping: false, zoomToCursor: true, minZoom: 0.3, maxZoom: 40 });
    this.controls.addEventListener("change", () => this.wanted());
    this.controls.addEventListener("start", () => (this.framed = null));
    this.pace = { ratio: devicePixelRatio, last: 0, slow: 0 };
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.preset("overview");
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
    if (!width || !height) return;
    const { radius } = this.area(),
      half = radius * Math.max(1, height / width);
    const [top, right] = [half, (half * width) / height];
    Object.assign(this.camera, { left: -right, right, top, bottom: -top, near: 0.1 * radius, far: 20 * radius });
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height, false);
    if (this.framed) this.preset(this.framed);
    else this.wanted();
  }

  /** Draw before the screen is next refreshed, and finer once nothing has changed for a while. */
  wanted() {
    this.request ??= requestAnimationFrame((now) => this.draw(this.paced(now)));
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.draw(Math.max(FINE, devicePixelRatio)), REST_MS);
  }

  /** Pixels of the picture per pixel of the page while it moves: fewer if pictures come too slowly. */
  paced(now) {
    const { pace } = this,
      took = now - pace.last;
    pace.last = now;
    if (took < REST_MS) pace.slow = 0.8 * pace.slow + 0.2 * took;
    if (pace.slow > SLOW_MS && pace.ratio > LEAST_RATIO)
      Object.assign(pace, { ratio: Math.max(0.85 * pace.ratio, LEAST_RATIO), slow: 0 });
    return pace.ratio;
  }

  draw(ratio = this.pace.ratio) {
    cancelAnimationFrame(this.request);
    this.request = undefined;
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.renderer.render(this.scene, this.camera);
    this.after?.();
  }

  /** Save the scene as a PNG file with twice the pixels of the screen along each edge. */
  save(name) {
    this.draw(2 * devicePixelRatio);
    this.renderer.domElement.toBlob((picture) =>
      make("a", { href: URL.createObjectURL(picture), download: name }).click(),
    );
    this.wanted();
  }

  preset(name) {
    const follows = name === "follow",
      { heading } = this.pose(),
      { centre, radius } = this.area();
    const from = name === "above" ? ABOVE.clone() : new Vector3(...FROM[name]).applyAxisAngle(UP, heading);
    this.follows = follows ? heading : null;
    this.framed = name; // until the user moves the camera: a window of another size is filled again
    this.look(follows ? this.nearWorkpiece() : centre, from, (follows ? 1.4 : 1) * this.zoomOf(from), radius);
  }

  /** The magnification at which the area just fits, seen from a direction. */
  zoomOf(from) {
    const { reach, height } = this.area(),
      { top, right } = this.camera,
      rise = Math.abs(from.z) / from.length();
    const half = 0.5 * height * Math.sqrt(1 - rise * rise) + reach * rise;
    return 0.94 * Math.min(top / half, right / reach);
  }

  /** Look at a point from a direction, with a magnification. */
  look(target, from, zoom, radius = this.area().radius) {
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(from.normalize(), 8 * radius);
    this.camera.zoom = zoom;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.camera.updateMatrixWorld();
    this.wanted();
  }

  nearWorkpiece() {
    const { x, y } = this.pose();
    return new Vector3(x, y, this.area().centre.z);
  }

  /** Go along with the workpiece and turn with its heading, if that is wanted. */
  follow() {
    if (this.follows === null) return;
    const { heading } = this.pose(),
      offset = this.camera.position
        .clone()
        .sub(this.controls.target)
        .applyAxisAngle(UP, heading - this.follows);
    this.follows = heading;
    this.look(this.nearWorkpiece(), offset, this.camera.zoom);
  }

  turn(sideways, upwards) {
    this.framed = null;
    this.controls.rotateLeft(-sideways);
    this.controls.rotateUp(-upwards);
  }

  magnify(factor) {
    this.framed = null;
    this.controls.dollyOut(factor);
  }

  /** The ray under a point of the canvas, in pixels from its corner. */
  ray(x, y) {
    const { clientWidth, clientHeight } = this.renderer.domElement,
      caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.camera);
    return caster;
  }

  /** Where a point of the scene is on the canvas, in pixels. */
  onCanvas(point) {
    const { clientWidth, clientHeight } = this.renderer.domElement,
      seen = new Vector3(...point).project(this.camera);
    return [((1 + seen.x) / 2) * clientWidth, ((1 - seen.y) / 2) * clientHeight];
  }

  get millimetresPerPixel() {
    return (this.camera.top - this.camera.bottom) / this.camera.zoom / this.renderer.domElement.clientHeight;
  }
}
