// network.html: the contact network of a run over time, and its drag force.
import { Vector3 } from "three";
import { Chosen, named, underRay } from "./chosen.js";
import { CLASS_COLOURS, COLOURS, colourMap } from "./colours.js";
import { Frames, readColumns } from "./data.js";
import { byId, digits, fixed, make, seconds, whole } from "./dom.js";
import { ForceCurve } from "./force_curve.js";
import { showLegend, showScale } from "./legend.js";
import { Contacts, Media } from "./bodies.js";
import { Player } from "./player.js";
import { PRESETS, View } from "./view.js";
import { Workpiece, outline } from "./workpiece.js";

const NEAR = 5, // pixels within which a click meets a thin contact
  STILL = 4; // pixels: a shorter drag is a click
const TURN = 0.09, // rad, and a factor: what a key does
  MAGNIFY = 1.15;

class Page {
  constructor(head, columns) {
    this.head = head;
    this.frames = new Frames(head, columns);
    this.colourOf = colourMap(head.colours);
    this.number = head.peaks[0]?.frame ?? 0;
    this.look = {};
    this.chosen = null;
    const classes = CLASS_COLOURS.map((colour, kind) => [`class-${kind}`, colour]);
    for (const [name, colour] of [...Object.entries(COLOURS), ...classes])
      document.documentElement.style.setProperty(`--${name}`, colour); // network.css takes them by name
    this.startCurve(columns);
    this.startScene(columns);
    if (head.peaks.length) this.showPeak(0);
    else this.show(0);
  }

  // --- curve -----------------------------------------------------------------------------------

  startCurve({ resistance }) {
    document.documentElement.classList.add("with-curve");
    const { curve, peaks } = this.head,
      { times } = this.frames;
    const away = (time) => times.map((moment) => Math.abs(moment - time)),
      nearest = (time) => away(time).indexOf(Math.min(...away(time)));
    this.curve = new ForceCurve(
      byId("curve"),
      { curve, peaks, values: resistance, end: times.at(-1) },
      {
        go: (time) => this.go(nearest(time)),
        goToPeak: (rank) => this.showPeak(rank),
        told: (text) => (byId("hovered").textContent = text),
      },
    );
    for (const [k, name] of ["raw", "smooth"].entries())
      byId(name).onchange = () => this.curve.plot.setSeries(k + 1, { show: byId(name).checked });
    byId("whole").onclick = () => this.curve.zoom(this.curve.whole);
    byId("peaks").append(...peaks.map((peak, rank) => this.peakButton(rank, peak)));
    if (!peaks.length) byId("peaks").append(make("li", {}, "none"));
  }

  peakButton(rank, { time, force }) {
    const words = [seconds(time), `${digits(force, 3)} N`],
      title = `Peak ${rank + 1}: ${words[1]} at ${words[0]}`,
      onclick = () => this.showPeak(rank);
    return make(
      "li",
      {},
      make("button", { type: "button", title, onclick }, ...words.map((text) => make("span", {}, text))),
    );
  }

  /** Go to a peak and show the dominant path of its frame. */
  showPeak(rank) {
    const { frame, time } = this.head.peaks[rank];
    this.peak = rank;
    this.curve.reveal(time);
    byId("path").checked = true;
    this.go(frame, time);
  }

  // --- scene ---------------------------------------------------------------------------------

  startScene(columns) {
    const { head, frames } = this;
    try {
      const [own] = head.workpieces;
      this.workpiece = new Workpiece(own, columns, head.bowl.height + 2 * head.media.radius);
      this.view = new View(byId("canvas"), { area: () => this.area(), pose: () => this.workpiece.pose(this.number) });
    } catch (error) {
      tell("This browser cannot draw the scene (WebGL 2 is missing); the report has pictures of one frame.", error);
      return;
    }
    document.documentElement.classList.add("with-scene");
    this.media = new Media(frames);
    this.contacts = new Contacts(frames);
    this.marks = new Chosen(frames, this.workpiece);
    const { cylinders, halos } = this.contacts;
    this.view.scene.add(outline(head), this.workpiece.group, this.workpiece.arrow);
    this.view.scene.add(this.media.spheres.mesh, cylinders.mesh, halos.mesh, this.marks.group);
    this.view.after = () => {
      showScale(byId("scale-bar"), byId("scale-length"), this.view.millimetresPerPixel);
      this.share?.();
    };
    this.view.resize();
    this.preset("overview");
    this.player = new Player(this);
    this.startControls();
    this.startChoosing();
    if (parent !== window) this.link();
  }

  /** Share camera, time and scales with the pages beside this one, by way of the page around them all. */
  link() {
    const { view, frames } = this,
      { camera, controls } = view,
      own = this.tops;
    const told = () => ({
      dragdeck: true,
      place: camera.position.toArray(),
      target: controls.target.toArray(),
      zoom: camera.zoom,
      time: this.number / Math.max(frames.count - 1, 1),
    });
    let last = JSON.stringify(told());
    this.share = () => {
      const now = JSON.stringify(told());
      if (now !== last) parent.postMessage(told(), "*");
      last = now;
    };
    addEventListener("message", ({ data, source }) => {
      if (source !== parent || data?.dragdeck !== true) return;
      if ("tops" in data) {
        this.tops = { ...own, ...data.tops };
        return;
      }
      Object.assign(view, { follows: null, framed: null });
      this.go(Math.round(data.time * (frames.count - 1)));
      view.look(new Vector3(...data.target), new Vector3(...data.place).sub(new Vector3(...data.target)), data.zoom);
      last = JSON.stringify(told());
    });
    parent.postMessage({ ...told(), opens: true, own }, "*");
  }

  /** The tops of all scales by name: those of the scene, and those of the loads on the workpiece. */
  get tops() {
    const { mean, ...scene } = this.head.scales,
      loads = this.workpiece.own.loads.map(({ name, top }) => [name, top]);
    return { ...scene, ...Object.fromEntries(loads) };
  }

  set tops(tops) {
    const { scales } = this.head;
    for (const name of Object.keys(scales)) scales[name] = tops[name] ?? scales[name];
    for (const load of this.workpiece.own.loads) load.top = tops[load.name];
    this.workpiece.shown = null;
    this.redraw();
  }

  /** What is to be seen: the bowl, or the surroundings of the workpiece in a wide one. */
  area() {
    const { bowl, media } = this.head,
      { height } = bowl,
      { partial } = this.frames,
      { x, y } = partial ? this.workpiece.pose(this.number) : { x: 0, y: 0 },
      reach = partial ? media.reach : bowl.radius;
    return { centre: new Vector3(x, y, 0.5 * height), radius: Math.hypot(reach, 0.5 * height), reach, height };
  }

  preset(name) {
    this.pressPreset(name);
    this.view.preset(name);
  }

  pressPreset(name) {
    for (const button of byId("presets").children) button.setAttribute("aria-pressed", button.dataset.preset === name);
  }

  // --- time ----------------------------------------------------------------------------------

  /** Go to a frame as the user wants, which ends playing; see `show`. */
  go(number, time) {
    this.player?.stop();
    this.show(number, time);
  }

  /** Show a frame; `time`: where the cursor of the curve stands, if not at the frame. */
  show(number, time) {
    const { times, count } = this.frames;
    this.number = Math.min(Math.max(number, 0), count - 1);
    this.time = time ?? times[this.number];
    this.curve.moveCursor(this.time);
    if (!this.view) return;
    const now = seconds(times[this.number]);
    byId("time").value = this.number;
    byId("time").setAttribute("aria-valuetext", now);
    byId("caption-time").textContent = now;
    byId("now").textContent = `${now} (${this.number + 1} of ${count})`;
    this.workpiece.place(this.number);
    this.view.follow();
    this.redraw();
  }

  // --- what is seen --------------------------------------------------------------------------

  startControls() {
    const { scales } = this.head;
    byId("controls").oninput = byId("controls").onchange = ({ target: { id, value } }) => {
      if (id === "find") return;
      if (id === "section-axis") this.placeSection();
      if (id === "threshold-range") this.setThreshold(scales.largest * (value / 1000) ** 2);
      else this.redraw();
    };
    for (const button of byId("presets").children) button.onclick = () => this.preset(button.dataset.preset);
    byId("mean").onclick = () => this.setThreshold(scales.mean);
    this.placeSection();
  }

  setThreshold(force) {
    byId("threshold").value = Number(force.toPrecision(3));
    this.redraw();
  }

  /** Put the section through the workpiece, or in the middle of the height, and show the side behind it. */
  placeSection() {
    const [axis, at, side] = ["section-axis", "section-at", "section-side"].map(byId),
      number = Number(axis.value);
    at.disabled = side.disabled = !axis.value;
    if (!axis.value) return;
    const { camera, controls } = this.view,
      { radius, height } = this.head.bowl,
      { x, y } = this.workpiece.pose(this.number),
      [min, max] = number === 2 ? [0, height] : [-radius, radius];
    Object.assign(at, { min, max, value: [x, y, height / 2][number] });
    side.checked = camera.position.getComponent(number) < controls.target.getComponent(number);
  }

  /** The section that is chosen: its axis, place in mm, and 1 or −1 for the side that is shown. */
  get section() {
    const axis = byId("section-axis").value,
      at = Number(byId("section-at").value);
    byId("section-shown").textContent = axis && `${fixed(at, 1)} mm`;
    return axis ? { axis: Number(axis), at, side: byId("section-side").checked ? -1 : 1 } : null;
  }

  readControls() {
    const { scales } = this.head,
      { look } = this;
    for (const name of ["colour", "load", "others"]) look[name] = byId(name).value;
    for (const name of ["path", "chains"]) look[name] = byId(name).checked;
    look.classes = [0, 1, 2].map((kind) => byId(`class-${kind}`).checked);
    look.threshold = Math.max(Number(byId("threshold").value) || 0, 0);
    look.size = byId("size").value / 100;
    look.top = scales[look.colour];
    look.kept = this.frames.kept(this.frames.at(this.number), this.section);
    byId("threshold-range").value = 1000 * Math.sqrt(look.threshold / scales.largest);
    byId("size-shown").textContent = `${byId("size").value} %`;
  }

  redraw() {
    const frame = this.frames.at(this.number),
      { look } = this;
    this.readControls();
    for (const part of [this.media, this.contacts]) part.update(frame, look, this.colourOf);
    this.workpiece.update(look, this.colourOf);
    this.marks.update(frame, this.chosen ?? {});
    showLegend(byId("legend"), this.head, look, this.workpiece.load(look.load));
    this.tellNumbers(frame);
    if (this.chosen) this.tellChosen(frame);
    this.view.wanted();
  }

  tellNumbers(frame) {
    const { counts } = this.contacts,
      { look } = this,
      bold = (text) => make("b", {}, text);
    const kinds = look.others === "hidden" ? ", those of chains only" : "",
      also = look.path && look.threshold ? ", or on the dominant path" : "";
    counts.forEach((count, kind) => (byId(`count-${kind}`).textContent = whole(count)));
    byId("status").replaceChildren(
      bold(whole(counts.reduce((sum, count) => sum + count))),
      ` of ${whole(frame.a.length)} contacts shown${kinds}: normal force above ${digits(look.threshold, 3)} N${also}. Drag force `,
      bold(`${digits(this.curve.at(this.time))} N`),
      ` at ${seconds(this.time)}. `,
    );
    if (!look.path) return;
    const path = this.head.paths[this.number];
    if (path)
      byId("status").append(
        "Dominant path: bottleneck ",
        bold(`${digits(path.bottleneck)} N`),
        `, mean ${digits(path.mean)} N, ${path.particles.length} particles, from workpiece to ${path.end}.`,
      );
    else byId("status").append("No path of contacts above the mean force leads from workpiece to bowl.");
  }

  tellChosen(frame) {
    const [title, rows] = this.marks.numbers(frame, this.chosen);
    const lines = rows.map(([name, value]) =>
      make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, value)),
    );
    byId("chosen").replaceChildren(make("h3", {}, title), make("table", {}, ...lines));
  }

  // --- choosing ------------------------------------------------------------------------------

  startChoosing() {
    const canvas = byId("canvas"),
      find = byId("find");
    let start = null;
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => (start = [offsetX, offsetY]));
    canvas.addEventListener("pointerup", ({ offsetX, offsetY }) => {
      if (start && Math.hypot(offsetX - start[0], offsetY - start[1]) < STILL) this.chooseAt(offsetX, offsetY);
      start = null;
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
    byId("find-button").onclick = () => this.find(find.value);
    find.addEventListener("keydown", ({ key }) => key === "Enter" && this.find(find.value));
    byId("highest-facet").onclick = () => this.showHighestFacet();
    byId("highest-facet").hidden = !this.workpiece.own.loads.length;
  }

  chooseAt(x, y) {
    const near = NEAR * this.view.millimetresPerPixel;
    const choice = underRay(this.view.ray(x, y), near, this.frames.at(this.number), this);
    if (choice) this.choose(choice);
  }

  choose(chosen) {
    this.chosen = chosen;
    this.redraw();
  }

  find(text) {
    const choice = named(text);
    if (choice) this.choose(choice);
    else byId("chosen").textContent = "Enter the number of a particle, or two bodies such as 12 345 or 12 workpiece.";
  }

  /** Choose the facet with the highest load and look at it. */
  showHighestFacet() {
    const { workpiece, view } = this,
      { group } = workpiece,
      load = workpiece.load(byId("load").value) ?? workpiece.own.loads[0],
      facet = workpiece.highest(load.name);
    byId("load").value = load.name;
    group.updateMatrixWorld();
    const target = workpiece.facet(facet).centre.applyMatrix4(group.matrixWorld),
      from = new Vector3(...workpiece.normals.subarray(9 * facet, 9 * facet + 3)).transformDirection(group.matrixWorld);
    from.add(new Vector3(0, 0, 0.15));
    Object.assign(view, { follows: null, framed: null });
    view.look(target, from, 2 * view.zoomOf(from));
    this.pressPreset(null);
    this.choose({ facet });
  }

  key(event) {
    const { view } = this,
      { peaks } = this.head;
    const actions = {
      ArrowLeft: () => view.turn(-TURN, 0),
      ArrowRight: () => view.turn(TURN, 0),
      ArrowUp: () => view.turn(0, -TURN),
      ArrowDown: () => view.turn(0, TURN),
      "+": () => view.magnify(MAGNIFY),
      "=": () => view.magnify(MAGNIFY),
      "-": () => view.magnify(1 / MAGNIFY),
      " ": () => this.player.playOrPause(),
      ",": () => this.go(this.number - 1),
      ".": () => this.go(this.number + 1),
      p: () => peaks.length && this.showPeak(((this.peak ?? -1) + 1) % peaks.length),
      ...Object.fromEntries(PRESETS.map((name, k) => [k + 1, () => this.preset(name)])),
    };
    const action = actions[event.key] ?? actions[event.key.toLowerCase()];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  }
}

function tell(text, error) {
  byId("problem").textContent = text;
  byId("problem").hidden = false;
  console.warn(text, error);
}

async function start() {
  const head = JSON.parse(byId("head").textContent);
  const page = new Page(head, await readColumns(head.columns, byId("data").textContent));
  globalThis.networkPage = page; // for the browser's console, tests and benchmarks
  page.view?.draw();
  performance.mark("first-picture");
  document.documentElement.dataset.ready = "true";
}

start().catch((error) =>
  tell("This page could not be shown: use a browser of 2023 or later. The report has static pictures.", error),
);
