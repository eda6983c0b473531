// The plots of the profiles: a frame over the mean of all frames, and the map of the workpiece.
import { plain, set, ticks } from "./axes.js";
import { digits, seconds, tenTo, whole } from "./numbers.js";
import { profilesOf } from "./profiles.js";

const EDGE = { left: 46, right: 20, top: 8, bottom: 46 };
const SIDES = { "-180": "behind", "-90": "right", 0: "ahead", 90: "left", 180: "behind" };
const KEYS = "Arrow keys go from value to value.";
const NEAREST = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

const azimuthAxis = {
  label: "Azimuth from the motion (°)",
  marks: () =>
    Object.keys(SIDES).map((angle) => ({ at: Number(angle), text: plain(Number(angle)), side: SIDES[angle] })),
};
const depthAxis = { label: "Depth below surface (mm)", marks: round(5) };
const forceAxis = {
  label: "Normal force of a contact (N)",
  marks: (first, last) =>
    Array.from({ length: Math.floor(last) - Math.ceil(first) + 1 }, (_, k) => {
      const power = Math.ceil(first) + k;
      return { at: power, text: power < -3 ? tenTo(power) : plain(10 ** power) };
    }),
};

function round(most) {
  return (first, last) => ticks(first, last, most).map((at) => ({ at, text: plain(at) }));
}

const between = (limits, bin, unit) => `${plain(limits[bin])} to ${plain(limits[bin + 1])}${unit}`;
const total = (values) => values.reduce((sum, value) => sum + value, 0);
/** The bin at a fraction of the way from the first limit to the last. */
function binOf(limits, part) {
  const value = limits[0] + part * (limits.at(-1) - limits[0]);
  return Math.max(
    limits.findLastIndex((limit, k) => k < limits.length - 1 && limit <= value),
    0,
  );
}

const highest = (values) => values.reduce((best, value, bin) => (value > values[best] ? bin : best), 0);

/** Axes, and values told for the bin that the mouse or the arrow keys choose. */
class Plot {
  constructor(element, across, up) {
    Object.assign(this, { element, across, up, active: false });
    element.innerHTML = `<g class="grid"></g><g class="content"></g><rect class="bin" hidden></rect>`;
    set(element, { tabindex: 0, role: "slider", "aria-roledescription": "plot", "aria-valuemin": 0 });
    new ResizeObserver(() => this.draw()).observe(element);
    for (const moved of ["pointerdown", "pointermove"]) element.addEventListener(moved, (event) => this.point(event));
    element.addEventListener("pointerleave", () => this.leave());
    element.addEventListener("focus", () => element.matches(":focus-visible") && this.choose(this.bin));
    element.addEventListener("blur", () => this.leave());
    element.addEventListener("keydown", (event) => this.key(event));
  }

  get inner() {
    const width = this.element.clientWidth || 300,
      height = this.element.clientHeight || 210;
    return {
      x: EDGE.left,
      y: EDGE.top,
      width: width - EDGE.left - EDGE.right,
      height: height - EDGE.top - EDGE.bottom,
    };
  }

  x(value) {
    const [first, last] = this.across.range;
    return this.box.x + ((value - first) / (last - first)) * this.box.width;
  }

  y(value) {
    const [low, high] = this.up.range;
    return this.box.y + this.box.height - ((value - low) / (high - low)) * this.box.height;
  }

  draw() {
    const box = (this.box = this.inner),
      bottom = box.y + box.height,
      right = box.x + box.width;
    set(this.element, { viewBox: `0 0 ${right + EDGE.right} ${bottom + EDGE.bottom}` });
    const parts = [];
    for (const { at, text, side } of this.across.marks(...this.across.range)) {
      const x = this.x(at);
      parts.push(
        `<line x1="${x}" x2="${x}" y1="${box.y}" y2="${bottom}"></line><text x="${x}" y="${bottom + 13}" text-anchor="middle">${text}</text>`,
        side ? `<text x="${x}" y="${bottom + 25}" text-anchor="middle">${side}</text>` : "",
      );
    }
    for (const { at, text } of this.up.marks(...[...this.up.range].sort((one, other) => one - other))) {
      const y = this.y(at);
      parts.push(
        `<line x1="${box.x}" x2="${right}" y1="${y}" y2="${y}"></line><text x="${box.x - 5}" y="${y + 3.5}" text-anchor="end">${text}</text>`,
      );
    }
    parts.push(`<text class="label" x="${box.x + box.width / 2}" y="${bottom + 40}" text-anchor="middle">${this.across.label}</text>
      <text class="label" transform="translate(12 ${box.y + box.height / 2}) rotate(-90)" text-anchor="middle">${this.up.label}</text>`);
    this.element.querySelector(".grid").innerHTML = parts.join("");
    this.drawContent();
    this.tell();
  }

  /** Tell a bin's values, here and to `told`. */
  choose(bin) {
    Object.assign(this, { bin, active: true });
    this.tell();
  }

  leave() {
    this.active = false;
    this.element.querySelector(".bin").setAttribute("hidden", "");
    this.told?.("");
  }

  tell() {
    const text = this.values(this.bin);
    set(this.element, { "aria-valuenow": this.bin, "aria-valuetext": text });
    if (!this.active) return;
    const [x0, y0, x1, y1] = this.corners(this.bin),
      frame = this.element.querySelector(".bin");
    set(frame, {
      x: Math.min(x0, x1),
      y: Math.min(y0, y1),
      width: Math.abs(x1 - x0),
      height: Math.abs(y1 - y0),
    });
    frame.removeAttribute("hidden");
    this.told?.(text);
  }

  point({ clientX, clientY }) {
    const from = this.element.getBoundingClientRect(),
      { x, y, width, height } = this.box;
    const across = (clientX - from.left - x) / width,
      down = (clientY - from.top - y) / height;
    if (across < 0 || across >= 1 || down < 0 || down >= 1) this.leave();
    else this.choose(this.binAt(across, down));
  }

  key(event) {
    const ends = { Home: 0, End: this.count - 1 };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in ends) this.choose(ends[event.key]);
    else if (event.key in NEAREST) this.choose(this.beside(...NEAREST[event.key]));
    else return;
    event.preventDefault();
  }
}

/** Bars of a profile, upright or from the left edge. */
class Bars extends Plot {
  /** `words`: `title`, and `value(value)`, `bin(limits, bin)` as text; `marked(number)`: a place to mark. */
  constructor(element, profile, axis, { lying, label, marked, words }) {
    const bins = { ...axis, range: [profile.limits[0], profile.limits.at(-1)] },
      values = { label, marks: round(lying ? 4 : 5), range: [0, 1.04 * profile.top] };
    super(element, lying ? values : bins, lying ? { ...bins, range: bins.range.reverse() } : values);
    Object.assign(this, { profile, lying, marked, words, number: 0, count: profile.mean.length });
    this.bin = highest(profile.mean);
    element.querySelector(".content").innerHTML =
      `<path class="mean"></path><path class="now"></path><line class="mean"></line><line class="now"></line>`;
    element.setAttribute("aria-valuemax", this.count - 1);
  }

  /** Where a value of a bin's limit lies. */
  place(limit, value) {
    return this.lying ? [this.x(value), this.y(limit)] : [this.x(limit), this.y(value)];
  }

  outline(values) {
    const { limits } = this.profile,
      points = [this.place(limits[0], 0)];
    values.forEach((value, bin) => points.push(this.place(limits[bin], value), this.place(limits[bin + 1], value)));
    points.push(this.place(limits.at(-1), 0));
    return `M${points.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join("L")}`;
  }

  drawContent() {
    this.element.querySelector("path.mean").setAttribute("d", `${this.outline(this.profile.mean)}Z`);
    this.mark("line.mean", this.marked?.(null));
    this.drawNow();
  }

  drawNow() {
    this.element.querySelector("path.now").setAttribute("d", this.outline(this.profile.values[this.number]));
    this.mark("line.now", this.marked?.(this.number));
  }

  mark(selector, at) {
    const line = this.element.querySelector(selector),
      [first, last] = this.across.range;
    line.toggleAttribute("hidden", !(at >= first && at <= last));
    if (at >= first && at <= last)
      set(line, { x1: this.x(at), x2: this.x(at), y1: this.box.y, y2: this.box.y + this.box.height });
  }

  show(number, time) {
    this.number = number;
    if (this.box) this.drawNow();
    this.element.setAttribute(
      "aria-label",
      `${this.words.title} at ${seconds(time)}${this.words.sum(number)}. ${KEYS}`,
    );
    if (this.box) this.tell();
  }

  values(bin) {
    const { profile, words } = this;
    return `${words.bin(profile.limits, bin)}: ${words.value(profile.values[this.number][bin])}, mean ${words.value(profile.mean[bin])}`;
  }

  corners(bin) {
    const [first, last] = this.profile.limits.slice(bin, bin + 2);
    return [...this.place(first, 0), ...this.place(last, this.profile.top * 1.04)];
  }

  binAt(across, down) {
    return binOf(this.profile.limits, this.lying ? down : across);
  }

  beside(right, down) {
    return Math.min(Math.max(this.bin + (this.lying ? right + down : right - down), 0), this.count - 1);
  }
}

/** The mean normal force on the workpiece over azimuth and depth. */
class Unrolled extends Plot {
  constructor(element, map, colourOf) {
    const across = { ...azimuthAxis, range: [-180, 180] },
      down = { ...depthAxis, range: [map.levels.at(-1), map.levels[0]] };
    super(element, across, down);
    Object.assign(this, { map, colourOf, columns: map.sectors.length - 1, count: map.values.length });
    this.bin = highest(map.values);
    set(element, {
      "aria-valuemax": this.count - 1,
      "aria-label": `Mean normal force on the workpiece over azimuth and depth; largest: ${this.values(this.bin)}. ${KEYS}`,
    });
  }

  drawContent() {
    const cells = Array.from(this.map.values, (force, bin) => {
      if (!force) return "";
      const [x0, y0, x1, y1] = this.corners(bin),
        tint = this.colourOf(force / this.map.top).map((channel) => Math.round(255 * channel));
      return `<rect x="${x0.toFixed(1)}" y="${y0.toFixed(1)}" width="${(x1 - x0 + 0.2).toFixed(1)}" height="${(y1 - y0 + 0.2).toFixed(1)}" fill="rgb(${tint})"></rect>`;
    });
    this.element.querySelector(".content").innerHTML = cells.join("");
  }

  values(bin) {
    const { sectors, levels, values } = this.map;
    const [column, row] = [bin % this.columns, Math.floor(bin / this.columns)];
    return `Azimuth ${between(sectors, column, "°")}, depth ${between(levels, row, " mm")}: mean ${digits(values[bin])} N`;
  }

  corners(bin) {
    const { sectors, levels } = this.map;
    const [column, row] = [bin % this.columns, Math.floor(bin / this.columns)];
    return [this.x(sectors[column]), this.y(levels[row]), this.x(sectors[column + 1]), this.y(levels[row + 1])];
  }

  binAt(across, down) {
    return binOf(this.map.levels, down) * this.columns + binOf(this.map.sectors, across);
  }

  beside(right, down) {
    const to = this.bin + right + down * this.columns;
    return to >= 0 && to < this.count ? to : this.bin;
  }
}

/** All plots; `parts`: elements `azimuth`, `depth`, `map`, `size`, the map's `scale`, and `told` for the values. */
export class ProfilePlots {
  constructor(parts, frames, colourOf) {
    const { azimuth, depth, size, map } = (this.profiles = profilesOf(frames)),
      { head } = frames;
    const force = (number) => `: ${digits(total(azimuth.values[number]))} N in all`;
    this.times = frames.times;
    this.bars = [
      new Bars(parts.azimuth, azimuth, azimuthAxis, {
        label: "Normal force (N)",
        words: {
          title: "Normal force on the workpiece by azimuth from the direction of motion",
          sum: force,
          bin: (limits, bin) => `Azimuth ${between(limits, bin, "°")}`,
          value: (value) => `${digits(value)} N`,
        },
      }),
      new Bars(parts.depth, depth, depthAxis, {
        lying: true,
        label: "Normal force per depth (N/mm)",
        words: {
          title: "Normal force on the workpiece by depth below the surface",
          sum: force,
          bin: (limits, bin) => `Depth ${between(limits, bin, " mm")}`,
          value: (value) => `${digits(value)} N/mm`,
        },
      }),
      new Bars(parts.size, size, forceAxis, {
        label: "Contacts",
        marked: (number) => Math.log10(number === null ? head.scales.mean : size.means[number]),
        words: {
          title: "Distribution of the normal forces of all contacts",
          sum: (number) => `: mean ${digits(size.means[number])} N; mean of all frames ${digits(head.scales.mean)} N`,
          bin: (limits, bin) => `${digits(10 ** limits[bin], 3)} to ${digits(10 ** limits[bin + 1], 3)} N`,
          value: (value) => `${Number.isInteger(value) ? whole(value) : digits(value)} contacts`,
        },
      }),
    ];
    const unrolled = new Unrolled(parts.map, map, colourOf);
    for (const plot of [...this.bars, unrolled]) {
      plot.told = (text) => (parts.told.textContent = text);
      plot.draw();
    }
    const bar = document.createElement("i");
    bar.style.background = `linear-gradient(to right, ${head.colours.join(", ")})`;
    parts.scale.append("0", bar, `${digits(map.top, 3)} N`);
  }

  show(number) {
    for (const bars of this.bars) bars.show(number, this.times[number]);
  }
}
