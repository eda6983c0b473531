// The force against the motion over process time: raw and filtered, with zoom, cursor and peaks.
import uPlot from "uplot";
import style from "uplot/dist/uPlot.min.css";
import { COLOURS } from "./colours.js";
import { digits, make, minus, seconds } from "./dom.js";

document.head.prepend(make("style", {}, style));

const LEAST_SPAN = 0.02; // shortest stretch to zoom into, as a fraction of the whole
const NEAR = 4; // pixels: a shorter drag is a click

const axis = (label, space) => ({
  label,
  space,
  stroke: () => getComputedStyle(document.body).color,
  font: "11px system-ui, sans-serif",
  labelFont: "12px system-ui, sans-serif",
  lineGap: 1.1,
  size: (plot, _, number) => (plot.axes[number].side % 2 ? 30 : 20),
  labelSize: 15,
  grid: { stroke: "#8a94a040", width: 0.7 },
  ticks: { show: false },
  values: (_, splits) => splits.map((value) => minus(String(Number(value.toPrecision(6))))),
});
const line = (options) => ({ points: { show: false }, pxAlign: 0, ...options });

export class ForceCurve {
  /** `curve` and `peaks`: entries of the page's data; `go(time)`, `goToPeak(rank)`: what clicks do;
   *  `told(text)`: told the values under the mouse. */
  constructor(element, { curve, peaks, values, end }, { go, goToPeak, told }) {
    const times = Float64Array.from(values, (_, row) => curve.first + row * curve.interval),
      smooth = movingMean(values, Math.max(1, Math.round(curve.window / curve.interval))),
      whole = [curve.first, Math.max(end, times.at(-1))];
    const words = (k) => `${seconds(times[k])}: raw ${digits(values[k])} N, filtered ${digits(smooth[k])} N`;
    const size = () => ({ width: element.clientWidth || 300, height: element.clientHeight || 200 });
    Object.assign(this, { whole, time: curve.first, marks: [] });
    const options = {
      ...size(),
      padding: [8, 10, 0, 0],
      legend: { show: false },
      scales: { x: { time: false, range: (_, from, to) => stretch(whole, from, to) }, y: { range: upright } },
      axes: [axis("Process time (s)", 60), axis("Drag force, magnitude (N)", 40)],
      series: [{}, line({ stroke: `${COLOURS.drag}59` }), line({ stroke: COLOURS.drag, width: 1.6 })],
      cursor: { y: false, drag: { dist: NEAR }, bind: { dblclick: () => () => this.zoom(whole) } },
      hooks: { setCursor: [({ cursor: { idx } }) => told(idx === null ? "" : words(idx))], draw: [() => this.layMarks()] },
    };
    this.plot = new uPlot(options, [times, values, smooth], element);
    new ResizeObserver(() => this.plot.setSize(size())).observe(element);
    this.mark("transient", () => [curve.first, curve.counted], null, {}, this.plot.under);
    this.mark("cursor", () => [this.time, this.time]);
    this.peaks = peaks.map(({ time, force }, rank) => ({
      time,
      element: this.mark("peak", () => [time, time], force, {
        title: `Peak ${rank + 1}: ${digits(force)} N at ${seconds(time)}`,
        onclick: () => goToPeak(rank),
      }),
    }));
    this.listen(this.plot, go);
    this.zoom(whole);
  }

  /** A click goes to a time; a finger does what a mouse does. */
  listen({ over, select, cursor, posToVal }, go) {
    over.addEventListener("mouseup", ({ target }) => {
      if (target === over && !select.width) go(posToVal(cursor.left, "x"));
    });
    for (const kind of ["down", "move", "up"])
      over.addEventListener(`pointer${kind}`, ({ target, pointerType, clientX, clientY }) => {
        const mouse = new MouseEvent(`mouse${kind}`, { clientX, clientY, movementX: 1, bubbles: true });
        if (pointerType === "touch" && target === over) over.dispatchEvent(mouse);
      });
  }

  /** The drag force at a time, N. */
  at(time) {
    return this.plot.data[1][this.plot.valToIdx(time)];
  }

  zoom([min, max]) {
    this.plot.setScale("x", { min, max });
  }

  /** Bring a time into the stretch that is shown. */
  reveal(time) {
    const { min, max } = this.plot.scales.x,
      half = (max - min) / 2;
    if (time < min || time > max) this.zoom([time - half, time + half]);
  }

  /** Mark a stretch of time, at a force or from top to bottom. */
  mark(className, times, force, more, layer = this.plot.over) {
    const element = make("i", { className, ...more });
    layer.append(element);
    this.marks.push({ element, times, force });
    return element;
  }

  layMarks() {
    const { plot } = this;
    for (const { element, times, force } of this.marks) {
      const [left, right] = times().map((time) => plot.valToPos(time, "x")),
        [top, height] = force == null ? [0, plot.over.clientHeight] : [plot.valToPos(force, "y"), 0];
      element.style.cssText = `left: ${left}px; width: ${right - left}px; top: ${top}px; height: ${height}px`;
    }
  }

  moveCursor(time) {
    this.time = time;
    for (const peak of this.peaks) peak.element.classList.toggle("now", Math.abs(peak.time - time) < 1e-9);
    this.layMarks();
  }
}

/** The stretch of the whole from a time to another, or the shortest about their middle. */
function stretch([first, last], from, to) {
  const half = Math.max(to - from, LEAST_SPAN * (last - first)) / 2,
    middle = (from + to) / 2;
  return [Math.max(middle - half, first), Math.min(middle + half, last)];
}

/** From zero, or the least force below it, to a little above the largest. */
function upright(_, least, most) {
  const low = Math.min(0, least);
  return [low, low + 1.06 * (most - low || 1)];
}

/** The mean over `width` samples around each one, fewer at the ends. */
function movingMean(values, width) {
  const sums = new Float64Array(values.length + 1),
    half = Math.floor(width / 2);
  values.forEach((value, row) => (sums[row + 1] = sums[row] + value));
  return Float32Array.from(values, (_, row) => {
    const reach = Math.min(half, row, values.length - 1 - row);
    return (sums[row + reach + 1] - sums[row - reach]) / (2 * reach + 1);
  });
}
