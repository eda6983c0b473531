// The plots of the profiles: a frame over the mean of all frames, and the map of the workpiece.
import uPlot from "uplot";
import { axis, Chart, line } from "./chart.js";
import { colourBar } from "./legend.js";
import { digits, plain, seconds, tenTo, whole } from "./dom.js";

const BLUE = "#0b5c96",
  GREY = "#ccd3da";
const SIDES = ["behind", "right", "ahead", "left", "behind"];
const paths = uPlot.paths.stepped({ align: 1 });

// What bins are of: an axis, and a bin in words.
const AZIMUTH = {
  words: (from, to) => `azimuth ${plain(from)} to ${plain(to)}°`,
  axis: axis("Azimuth from the motion (°)", {
    size: 32,
    splits: [-180, -90, 0, 90, 180],
    values: (_, angles) => angles.map((angle, k) => `${plain(angle)}\n${SIDES[k]}`),
  }),
};
const DEPTH = {
  words: (from, to) => `depth ${plain(from)} to ${plain(to)} mm`,
  axis: axis("Depth below surface (mm)", { space: 30, side: 3 }),
};
const FORCE = {
  words: (from, to) => `force ${digits(10 ** from, 3)} to ${digits(10 ** to, 3)} N`,
  axis: axis("Normal force of a contact (N)", {
    incrs: [1, 2, 5],
    values: (_, powers) => powers.map((power) => (power < -3 ? tenTo(power) : plain(10 ** power))),
  }),
};

const inWords = (value) => (Number.isInteger(value) ? whole(value) : digits(value));
const highest = (values) => values.reduce((best, value, bin) => (value > values[best] ? bin : best), 0);
/** The bin that a value is in: how many inner limits are not above it. */
const binOf = (limits, at) => limits.slice(1, -1).filter((limit) => limit <= at).length;
const ends = (limits) => [limits[0], limits.at(-1)];
/** Heights of bars, from zero at the first limit to zero at the last one. */
const outline = (values) => [0, ...values, 0];

/** A chart of bins, of which the mouse or the arrow keys choose one. */
class Bins extends Chart {
  /** `bins`: what they are `along` x, and y of a map, and their `limits`; their `values`, and `value(bin)` in words;
   *  how much further on the one `below` is; `told(text)` is told the words of the chosen one. */
  constructor(element, bins, options, data) {
    super(element, { padding: [8, 20, 0, 0], cursor: { show: false }, ...options }, data);
    Object.assign(this, bins, { element, bin: highest(bins.values), active: false });
    this.mark("bin", () => this.active && this.place(this.bin));
    element.setAttribute("aria-valuemax", this.values.length - 1);
    const { over } = this.plot;
    for (const moved of ["pointerdown", "pointermove"])
      over.addEventListener(moved, ({ offsetX, offsetY }) => this.choose(this.binAt(offsetX, offsetY)));
    over.addEventListener("pointerleave", () => this.leave());
    element.addEventListener("focus", () => element.matches(":focus-visible") && this.choose(this.bin));
    element.addEventListener("blur", () => this.leave());
    element.addEventListener("keydown", (event) => this.key(event));
  }

  /** The limits of a bin along x, and y of a map. */
  place(bin) {
    const { x, y } = this.limits,
      column = bin % (x.length - 1),
      row = Math.floor(bin / (x.length - 1));
    return { x: x.slice(column, column + 2), y: y?.slice(row, row + 2) };
  }

  binAt(left, top) {
    const { limits, plot } = this,
      column = binOf(limits.x, plot.posToVal(plot.scales.x.ori ? top : left, "x"));
    return limits.y ? column + (limits.x.length - 1) * binOf(limits.y, plot.posToVal(top, "y")) : column;
  }

  choose(bin) {
    Object.assign(this, { bin, active: true });
    this.tell();
  }

  leave() {
    this.active = false;
    this.layMarks();
    this.told("");
  }

  tell() {
    const places = Object.entries(this.along).map(([key, { words }]) => words(...this.place(this.bin)[key])),
      text = `${places.join(", ")}: ${this.value(this.bin)}`;
    this.element.setAttribute("aria-valuenow", this.bin);
    this.element.setAttribute("aria-valuetext", text);
    if (this.active) this.told(text);
    this.layMarks();
  }

  key(event) {
    const { bin, below } = this,
      last = this.values.length - 1;
    const keys = { ArrowLeft: bin - 1, ArrowRight: bin + 1, ArrowUp: bin - below, ArrowDown: bin + below },
      to = { ...keys, Home: 0, End: last }[event.key];
    if (to === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.choose(to >= 0 && to <= last ? to : bin);
  }
}

/** A profile: limits of its bins, their values at a frame, and the mean of all frames. */
function profile(name, { head, columns }) {
  const { limits, ...all } = head.profiles[name],
    bins = limits.length - 1;
  return { limits, ...all, at: (number) => columns[`${name}_profile`].subarray(bins * number, bins * (number + 1)) };
}

/** All plots; `parts`: elements `azimuth`, `depth`, `map`, `size`, the map's `scale`, and `told` for the values. */
export class ProfilePlots {
  constructor(parts, frames, colourOf) {
    const [azimuth, depth, size] = ["azimuth", "depth", "size"].map((name) => profile(name, frames)),
      { times, head } = frames,
      { map } = head.profiles;
    const force = (number) => `${digits(azimuth.at(number).reduce((sum, one) => sum + one))} N in all`,
      mean = (number) => `mean ${digits(size.means[number])} N; mean of all frames ${digits(head.scales.mean)} N`;
    Object.assign(this, { times, number: 0, told: (text) => (parts.told.textContent = text) });
    this.bars = [
      this.addBars(parts.azimuth, AZIMUTH, azimuth, ["Normal force (N)", "N"], force),
      this.addBars(parts.depth, DEPTH, depth, ["Normal force per depth (N/mm)", "N/mm"], force),
      this.addBars(parts.size, FORCE, size, ["Contacts", "contacts"], mean),
    ];
    const mark = (force) => force > 0 && { x: [Math.log10(force), Math.log10(force)] };
    this.bars[2].mark("mean", () => mark(head.scales.mean));
    this.bars[2].mark("now", () => mark(size.means[this.number]));
    this.addMap(parts.map, { ...map, sectors: azimuth.limits, levels: depth.limits }, colourOf);
    parts.scale.append("0", colourBar(head.colours), `${digits(map.top, 3)} N`);
  }

  /** Bars of a profile: upright, or over depth from the left edge. */
  addBars(element, along, { limits, mean, at, top }, [label, unit], sum) {
    const lying = along === DEPTH ? 1 : 0,
      title = element.getAttribute("aria-label");
    const bins = { along: { x: along }, limits: { x: limits }, values: mean, below: lying || -1, told: this.told };
    bins.value = (bin) => [at(this.number), mean].map((one) => `${inWords(one[bin])} ${unit}`).join(", mean ");
    const x = { time: false, range: ends(limits), ori: lying, dir: lying ? -1 : 1 },
      scales = { x, y: { range: [0, 1.04 * top], ori: 1 - lying } };
    const axes = [along.axis, axis(label, { side: lying ? 2 : 3, space: 30 })];
    const now = line({ fill: `${BLUE}26`, stroke: BLUE, width: 1.5, paths }),
      series = [{}, line({ fill: GREY, width: 0, paths }), now];
    const chart = new Bins(element, bins, { scales, axes, series }, []);
    chart.show = () => {
      chart.plot.setData([[limits[0], ...limits], outline(mean), outline(at(this.number))]);
      element.setAttribute("aria-label", `${title} at ${seconds(this.times[this.number])}: ${sum(this.number)}`);
      chart.tell();
    };
    return chart;
  }

  /** The mean normal force on the workpiece over azimuth and depth. */
  addMap(element, { sectors, levels, mean: values, top }, colourOf) {
    const bins = { along: { x: AZIMUTH, y: DEPTH }, limits: { x: sectors, y: levels }, values, told: this.told };
    Object.assign(bins, { value: (bin) => `mean ${digits(values[bin])} N`, below: sectors.length - 1 });
    const scales = { x: { time: false, range: ends(sectors) }, y: { range: ends(levels), dir: -1 } };
    const paint = ({ ctx, valToPos }) =>
      values.forEach((force, bin) => {
        const { x, y } = chart.place(bin),
          [left, right] = x.map((value) => Math.round(valToPos(value, "x", true))),
          [above, below] = y.map((value) => Math.round(valToPos(value, "y", true)));
        ctx.fillStyle = `rgb(${colourOf(force / top).map((channel) => 255 * channel)})`;
        if (force) ctx.fillRect(left, above, right - left, below - above);
      });
    const options = { scales, axes: [AZIMUTH.axis, DEPTH.axis], series: [{}], hooks: { drawAxes: [paint] } };
    const chart = new Bins(element, bins, options, [sectors]);
    chart.tell();
  }

  show(number) {
    this.number = number;
    for (const chart of this.bars) chart.show();
  }
}
