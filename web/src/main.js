// network.html: the contact network of a run over time, and its drag force.
import { Vector3 } from "three";
import { outline } from "./bowl.js";
import { named, underRay } from "./choice.js";
import { Chosen } from "./chosen.js";
import { CLASS_COLOURS, COLOURS, colourMap } from "./colours.js";
import { readColumns } from "./columns.js";
import { Contacts } from "./contacts.js";
import { byId, make } from "./dom.js";
import { ForceCurve } from "./force_curve.js";
import { Frames } from "./frames.js";
import { showLegend, showScale } from "./legend.js";
import { Media } from "./media.js";
import { digits, fixed, seconds, whole } from "./numbers.js";
import { Player } from "./player.js";
import { ProfilePlots } from "./profile_plots.js";
import { numbers } from "./readout.js";
import { Film, filmKind, savePicture } from "./save.js";
import { PRESETS, View } from "./view.js";
import { Workpiece } from "./workpiece.js";

const NEAR = 5; // pixels within which a click meets a thin contact

class Page {
  constructor(head, columns) {
    this.head = head;
    this.frames = new Frames(head, columns);
    this.colourOf = colourMap(head.colours);
    this.number = head.peaks[0]?.frame ?? 0;
    this.look = { classes: [true, true, true], threshold: 0, chosen: null, section: null };
    this.measured = null; // the particles or contacts whose distance is measured
    for (const [name, colour] of Object.entries(COLOURS))
      // network.css takes them by name
      document.documentElement.style.setProperty(`--${name}`, colour);
    this.startCurve(columns);
    this.startProfiles();
    this.startScene(columns);
    if (head.peaks.length) this.showPeak(0);
    else this.show(0);
  }

  // --- curve ---------------------------------------------------------------------------------

  startCurve({ resistance }) {
    document.documentElement.classList.add("with-curve");
    const { curve, peaks } = this.head,
      hovered = byId("hovered");
    const go = (time) => this.go(this.nearest(time)),
      goToPeak = (rank) => this.showPeak(rank);
    this.curve = new ForceCurve(
      byId("curve"),
      { curve, peaks, values: resistance, end: this.frames.times.at(-1) },
      { go, goToPeak, told: (text) => (hovered.textContent = text) },
    );
    for (const [k, name] of ["raw", "smooth"].entries())
      byId(name).onchange = () => this.curve.plot.setSeries(k + 1, { show: byId(name).checked });
    byId("whole").onclick = () => this.curve.zoom(this.curve.whole);
    byId("peaks").append(
      ...peaks.map(({ time, force }, rank) => this.peakButton(rank, seconds(time), digits(force, 3))),
    );
    if (!peaks.length) byId("peaks").append(make("li", {}, "none"));
  }

  peakButton(rank, time, force) {
    const parts = [time, `${force} N`].map((text) => make("span", {}, text)),
      title = `Peak ${rank + 1}: ${force} N at ${time}`;
    return make("li", {}, make("button", { type: "button", title, onclick: () => this.showPeak(rank) }, ...parts));
  }

  startProfiles() {
    const names = ["azimuth", "depth", "map", "size", "scale", "told"];
    const parts = Object.fromEntries(names.map((name) => [name, byId(`profile-${name}`)]));
    this.profiles = new ProfilePlots(parts, this.frames, this.colourOf);
  }

  nearest(time) {
    return this.frames.times.reduce(
      (best, one, k) => (Math.abs(one - time) < Math.abs(this.frames.times[best] - time) ? k : best),
      0,
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
      tell("This browser cannot draw the scene (WebGL 2 is missing); the picture below shows one frame.", error);
      return;
    }
    document.documentElement.classList.add("with-scene");
    this.media = new Media(frames);
    this.contacts = new Contacts(frames);
    this.chosen = new Chosen(frames, this.workpiece);
    this.view.scene.add(
      outline(head),
      this.workpiece.group,
      this.workpiece.arrow,
      this.media.mesh,
      ...this.contacts.meshes,
      this.chosen.group,
    );
    this.view.after = () => showScale(byId("scale-bar"), byId("scale-length"), this.view.millimetresPerPixel);
    this.view.resize();
    this.preset("overview");
    this.startControls();
    this.startTransport();
    this.startSaving();
    this.startSection();
    this.startChoosing();
  }

  /** What is to be seen: the bowl, or the surroundings of the workpiece in a wide one. */
  area() {
    const { bowl } = this.head,
      { height } = bowl;
    const { reach, x, y } = this.frames.partial
      ? { reach: this.reach, ...this.workpiece.pose(this.number) }
      : { reach: bowl.radius, x: 0, y: 0 };
    return { centre: new Vector3(x, y, 0.5 * height), radius: Math.hypot(reach, 0.5 * height), reach, height };
  }

  /** How far the shown particles reach from the workpiece's axis, mm. */
  get reach() {
    const { centre } = this.frames.at(0),
      { x, y } = this.workpiece.pose(0);
    let reach = 0;
    for (let k = 0; k < centre.length; k += 3) reach = Math.max(reach, Math.hypot(centre[k] - x, centre[k + 1] - y));
    return reach;
  }

  startControls() {
    const redraw = () => this.redraw(),
      { scales } = this.head;
    for (const button of byId("presets").children) button.onclick = () => this.preset(button.dataset.preset);
    for (const name of ["colour", "load", "path", "chains", "others", "class-0", "class-1", "class-2"])
      byId(name).onchange = redraw;
    for (const name of ["size", "threshold"]) byId(name).oninput = redraw;
    byId("threshold-range").oninput = () =>
      this.setThreshold(scales.largest * (byId("threshold-range").value / 1000) ** 2);
    byId("mean").onclick = () => this.setThreshold(scales.mean);
    for (const swatch of document.querySelectorAll("[data-class]"))
      swatch.style.background = CLASS_COLOURS[swatch.dataset.class];
  }

  startSection() {
    const axis = byId("section-axis"),
      at = byId("section-at"),
      side = byId("section-side");
    const place = () => {
      at.disabled = side.disabled = !axis.value;
      if (axis.value) this.placeSection(Number(axis.value));
    };
    place();
    axis.onchange = () => {
      place();
      this.redraw();
    };
    at.oninput = side.onchange = () => this.redraw();
  }

  /** Put the section through the workpiece, or in the middle of the height, and show the side behind it. */
  placeSection(axis) {
    const { camera, controls } = this.view,
      { radius, height } = this.head.bowl,
      { x, y } = this.workpiece.pose(this.number),
      [low, high] = axis === 2 ? [0, height] : [-radius, radius];
    Object.assign(byId("section-at"), { min: low, max: high, value: [x, y, height / 2][axis] });
    byId("section-side").checked = camera.position.getComponent(axis) < controls.target.getComponent(axis);
  }

  preset(name) {
    for (const button of byId("presets").children) button.setAttribute("aria-pressed", button.dataset.preset === name);
    this.view.preset(name);
  }

  setThreshold(force) {
    byId("threshold").value = Number(force.toPrecision(3));
    this.redraw();
  }

  // --- time ----------------------------------------------------------------------------------

  startTransport() {
    const slider = byId("time"),
      play = byId("play"),
      speed = byId("speed");
    const told = (on) => {
      play.textContent = on ? "Pause" : "Play";
      play.setAttribute("aria-pressed", on);
      if (!on) this.endFilm();
    };
    this.player = new Player(this.frames.times, { show: (number) => this.show(number), told });
    slider.max = this.frames.count - 1;
    slider.oninput = () => this.go(Number(slider.value));
    byId("previous").onclick = () => this.go(this.number - 1);
    byId("next").onclick = () => this.go(this.number + 1);
    play.onclick = () => this.playOrPause();
    speed.onchange = () => (this.player.speed = Number(speed.value));
    this.player.speed = Number(speed.value);
  }

  // --- saving --------------------------------------------------------------------------------

  startSaving() {
    const video = byId("save-video");
    byId("save-picture").onclick = () =>
      savePicture(this.view, `${this.head.run}_${this.frames.times[this.number].toFixed(3)}s`);
    video.disabled = !filmKind();
    if (video.disabled) video.title = "This browser cannot record a canvas.";
    video.onclick = () => (this.film ? this.player.stop() : this.startFilm());
  }

  /** Play all frames and record them. */
  startFilm() {
    this.go(0);
    this.view.draw(devicePixelRatio);
    this.film = new Film(this.view, this.head.run, () => this.film && this.player.start(0));
    byId("save-video").textContent = "End video";
  }

  endFilm() {
    this.film?.end();
    this.film = null;
    byId("save-video").textContent = "Save video";
  }

  playOrPause() {
    if (this.player.playing) this.player.stop();
    else this.player.start(this.number);
  }

  /** Go to a frame as the user wants, which ends playing; see `show`. */
  go(number, time) {
    this.player?.stop();
    this.show(number, time);
  }

  /** Show a frame; `time`: where the cursor of the curve stands, if not at the frame. */
  show(number, time) {
    this.number = Math.min(Math.max(number, 0), this.frames.count - 1);
    this.time = time ?? this.frames.times[this.number];
    this.curve.moveCursor(this.time);
    this.profiles.show(this.number);
    if (!this.view) return;
    byId("time").value = this.number;
    byId("time").setAttribute("aria-valuetext", seconds(this.frames.times[this.number]));
    byId("caption-time").textContent = seconds(this.frames.times[this.number]);
    byId("now").textContent = `${seconds(this.frames.times[this.number])} (${this.number + 1} of ${this.frames.count})`;
    this.workpiece.place(this.number);
    this.view.follow();
    this.redraw();
  }

  // --- what is seen --------------------------------------------------------------------------

  readControls() {
    const checked = (name) => byId(name).checked,
      { look } = this;
    Object.assign(look, {
      colour: byId("colour").value,
      load: byId("load").value,
      path: checked("path"),
      chains: checked("chains"),
      others: byId("others").value,
      section: this.section,
    });
    look.classes = [0, 1, 2].map((kind) => checked(`class-${kind}`));
    look.threshold = Math.max(Number(byId("threshold").value) || 0, 0);
    look.size = byId("size").value / 100;
    look.top = this.head.scales[look.colour];
    byId("threshold-range").value = 1000 * Math.sqrt(look.threshold / this.head.scales.largest);
    byId("size-shown").textContent = `${byId("size").value} %`;
  }

  /** The section that is chosen: its axis, place in mm, and 1 or −1 for the side that is shown. */
  get section() {
    const axis = byId("section-axis").value,
      at = Number(byId("section-at").value);
    byId("section-shown").textContent = axis && `${fixed(at, 1)} mm`;
    return axis ? { axis: Number(axis), at, side: byId("section-side").checked ? -1 : 1 } : null;
  }

  redraw() {
    const frame = this.frames.at(this.number);
    this.readControls();
    this.look.kept = this.frames.kept(frame, this.look.section);
    this.media.update(frame, this.look, this.colourOf);
    this.contacts.update(frame, this.look, this.colourOf);
    this.workpiece.update(this.look, this.colourOf);
    this.chosen.update(frame, this.look.chosen, this.tellDistance(frame));
    showLegend(
      byId("legend"),
      this.head,
      this.look,
      this.workpiece.own.loads.find(({ name }) => name === this.look.load),
    );
    this.tellNumbers(frame);
    this.view.wanted();
  }

  tellNumbers(frame) {
    const { counts } = this.contacts,
      path = this.head.paths[this.number],
      { look } = this;
    const kinds = look.others === "hidden" ? ", those of chains only" : "",
      also = look.path && look.threshold ? ", or on the dominant path" : "";
    counts.forEach((count, kind) => (byId(`count-${kind}`).textContent = whole(count)));
    const bold = (text) => make("b", {}, text);
    const parts = [
      bold(whole(counts.reduce((sum, count) => sum + count))),
      ` of ${whole(frame.a.length)} contacts shown${kinds}: normal force above ${digits(look.threshold, 3)} N${also}. Drag force `,
      bold(`${digits(this.curve.at(this.time))} N`),
      ` at ${seconds(this.time)}. `,
    ];
    if (look.path && path)
      parts.push(
        "Dominant path: bottleneck ",
        bold(`${digits(path.bottleneck)} N`),
        `, mean ${digits(path.mean)} N, ${path.particles.length} particles, from workpiece to ${path.end}.`,
      );
    if (look.path && !path) parts.push("No path of contacts above the mean force leads from workpiece to bowl.");
    byId("status").replaceChildren(...parts);
    if (look.chosen) this.tellChosen(frame);
  }

  tellChosen(frame) {
    const [title, rows] = numbers(this.look.chosen, frame, this.frames, this.workpiece);
    const lines = rows.map(([name, value]) =>
      make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, value)),
    );
    byId("chosen").replaceChildren(make("h3", {}, title), make("table", {}, ...lines));
  }

  /** Tell the distance between the measured places; returns those of them that are in the frame. */
  tellDistance(frame) {
    const { measured } = this,
      places = (measured ?? []).map((one) => this.frames.place(frame, one)).filter(Boolean),
      [from, to] = places;
    const known = to
      ? `${fixed(Math.hypot(...[0, 1, 2].map((axis) => to[axis] - from[axis])), 2)} mm`
      : "not in this frame";
    byId("distance").hidden = !measured;
    byId("distance").textContent = `Distance: ${measured?.length === 2 ? known : "choose two particles or contacts"}`;
    return places;
  }

  // --- choosing ------------------------------------------------------------------------------

  startChoosing() {
    const canvas = byId("canvas");
    let start = null;
    canvas.addEventListener("pointerdown", ({ offsetX, offsetY }) => (start = [offsetX, offsetY]));
    canvas.addEventListener("pointerup", ({ offsetX, offsetY }) => {
      if (start && Math.hypot(offsetX - start[0], offsetY - start[1]) < 4) this.chooseAt(offsetX, offsetY);
      start = null;
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
    byId("find-button").onclick = () => this.find(byId("find").value);
    byId("find").addEventListener("keydown", ({ key }) => key === "Enter" && this.find(byId("find").value));
    byId("measure").onclick = () => {
      this.measured = this.measured ? null : [];
      byId("measure").setAttribute("aria-pressed", Boolean(this.measured));
      this.redraw();
    };
    byId("highest-facet").onclick = () => this.showHighestFacet();
    byId("highest-facet").hidden = !this.workpiece.own.loads.length;
  }

  chooseAt(x, y) {
    const near = NEAR * this.view.millimetresPerPixel;
    const choice = underRay(this.view.ray(x, y), near, this.frames.at(this.number), this);
    if (choice) this.choose(choice);
  }

  choose(chosen) {
    this.look.chosen = chosen;
    if (this.measured && chosen.facet === undefined) this.measured = [...this.measured, chosen].slice(-2);
    this.redraw();
  }

  find(text) {
    const choice = named(text);
    if (choice) this.choose(choice);
    else byId("chosen").textContent = "Enter the number of a particle, or two bodies such as 12 345 or 12 workpiece.";
  }

  /** Choose the facet with the highest load and look at it. */
  showHighestFacet() {
    const { loads } = this.workpiece.own;
    if (!loads.some(({ name }) => name === byId("load").value)) byId("load").value = loads[0].name;
    const facet = this.workpiece.highest(byId("load").value),
      { group, normals } = this.workpiece,
      { centre } = this.workpiece.facet(facet);
    group.updateMatrixWorld();
    const target = centre.applyMatrix4(group.matrixWorld),
      from = new Vector3(...normals.subarray(9 * facet, 9 * facet + 3)).transformDirection(group.matrixWorld);
    Object.assign(this.view, { follows: null, framed: null });
    from.add(new Vector3(0, 0, 0.15));
    this.view.look(target, from, 2 * this.view.zoomOf(from));
    for (const button of byId("presets").children) button.setAttribute("aria-pressed", false);
    this.choose({ facet });
  }

  key(event) {
    const turn = 0.09,
      presets = Object.fromEntries(PRESETS.map((name, k) => [k + 1, () => this.preset(name)]));
    const actions = {
      ...presets,
      ArrowLeft: () => this.view.turn(-turn, 0),
      ArrowRight: () => this.view.turn(turn, 0),
      ArrowUp: () => this.view.turn(0, -turn),
      ArrowDown: () => this.view.turn(0, turn),
      "+": () => this.view.magnify(1.15),
      "=": () => this.view.magnify(1.15),
      "-": () => this.view.magnify(1 / 1.15),
      " ": () => this.playOrPause(),
      ",": () => this.go(this.number - 1),
      ".": () => this.go(this.number + 1),
      p: () => this.head.peaks.length && this.showPeak(((this.peak ?? -1) + 1) % this.head.peaks.length),
    };
    const action =
      event.ctrlKey || event.metaKey || event.altKey ? null : (actions[event.key] ?? actions[event.key.toLowerCase()]);
    if (!action) return;
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
  if (page.view) page.view.draw();
  performance.mark("first-picture");
  document.documentElement.dataset.ready = "true";
}

start().catch((error) =>
  tell("This page could not be shown; the pictures below are static. Use a browser of 2023 or later.", error),
);
