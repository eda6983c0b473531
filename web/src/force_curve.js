// The force against the motion over process time: raw and filtered, with zoom, cursor and peaks.
import { plain, set, ticks } from "./axes.js";
import { digits, seconds } from "./numbers.js";

const EDGE = { left: 46, right: 10, top: 10, bottom: 30 };
const NEAR = 9; // pixels within which a click meets a peak
const LEAST_SPAN = 0.02; // shortest stretch to zoom into, as a fraction of the whole

export class ForceCurve {
  /** `curve` and `peaks`: entries of the page's data; `go(time)`, `goToPeak(rank)`: what clicks do. */
  constructor(element, { curve, peaks, values, end }, { go, goToPeak }) {
    Object.assign(this, { element, curve, peaks, raw: values, go, goToPeak });
    this.smooth = movingMean(values, Math.max(1, Math.round(curve.window / curve.interval)));
    this.whole = [curve.first, Math.max(end, curve.first + (values.length - 1) * curve.interval)];
    this.span = [...this.whole];
    this.shown = { raw: true, smooth: true };
    this.time = curve.first;
    element.innerHTML = `<g class="grid"></g><rect class="transient"></rect><clipPath id="inside"><rect></rect></clipPath>
      <g clip-path="url(#inside)"><path class="raw"></path><path class="smooth"></path></g><g class="peaks"></g>
      <rect class="selection" hidden></rect><line class="cursor"></line><g class="hover" hidden><line></line><circle r="3"></circle></g>`;
    new ResizeObserver(() => this.draw()).observe(element);
    this.listen();
    this.draw();
  }

  get size() {
    return [this.element.clientWidth || 600, this.element.clientHeight || 180];
  }

  x(time) {
    const [first, last] = this.span;
    return EDGE.left + ((time - first) / (last - first)) * (this.size[0] - EDGE.left - EDGE.right);
  }

  timeAt(x) {
    const [first, last] = this.span,
      part = (x - EDGE.left) / (this.size[0] - EDGE.left - EDGE.right);
    return first + Math.min(Math.max(part, 0), 1) * (last - first);
  }

  y(force) {
    const [low, high] = this.range;
    return this.size[1] - EDGE.bottom - ((force - low) / (high - low)) * (this.size[1] - EDGE.top - EDGE.bottom);
  }

  row(time) {
    return Math.min(Math.max(Math.round((time - this.curve.first) / this.curve.interval), 0), this.raw.length - 1);
  }

  /** The force at a time, N: of the raw or the filtered curve. */
  at(time, values = this.raw) {
    return values[this.row(time)];
  }

  zoom(span) {
    const [first, last] = this.whole,
      least = LEAST_SPAN * (last - first),
      middle = (span[0] + span[1]) / 2;
    if (span[1] - span[0] < least) span = [middle - least / 2, middle + least / 2];
    this.span = [Math.max(span[0], first), Math.min(span[1], last)];
    this.draw();
  }

  /** Bring a time into the stretch that is shown. */
  reveal(time) {
    const [first, last] = this.span;
    if (time < first || time > last) this.zoom([time - (last - first) / 2, time + (last - first) / 2]);
  }

  draw() {
    const [width, height] = this.size,
      from = this.row(this.span[0]),
      to = this.row(this.span[1]) + 1;
    this.range = niceRange(this.raw.subarray(from, to));
    this.element.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const inner = {
      x: EDGE.left,
      y: EDGE.top,
      width: Math.max(width - EDGE.left - EDGE.right, 1),
      height: Math.max(height - EDGE.top - EDGE.bottom, 1),
    };
    set(this.element.querySelector("#inside rect"), inner);
    set(this.element.querySelector(".transient"), {
      ...inner,
      width: Math.min(Math.max(this.x(this.curve.counted) - EDGE.left, 0), inner.width),
    });
    this.drawGrid(width, height);
    for (const name of ["raw", "smooth"]) {
      const values = { raw: this.raw, smooth: this.smooth }[name];
      set(this.element.querySelector(`path.${name}`), { d: this.shown[name] ? this.line(values, from, to) : "" });
    }
    this.element.querySelector(".peaks").innerHTML = this.peaks
      .map(({ time, force }, rank) =>
        time < this.span[0] || time > this.span[1]
          ? ""
          : `<circle data-rank="${rank}" cx="${this.x(time)}" cy="${this.y(force)}" r="4.5"><title>Peak ${rank + 1}: ${digits(force)} N at ${seconds(time)}</title></circle>`,
      )
      .join("");
    this.moveCursor(this.time);
  }

  /** A path through all values, or through the least and the largest of each pixel. */
  line(values, from, to) {
    const perPixel = (to - from) / Math.max(this.size[0], 1),
      points = [];
    const put = (row) =>
      points.push(
        `${this.x(this.curve.first + row * this.curve.interval).toFixed(1)},${this.y(values[row]).toFixed(1)}`,
      );
    if (perPixel < 3) for (let row = from; row < to; row++) put(row);
    else {
      for (let start = from; start < to; start += perPixel) {
        let low = Math.floor(start),
          high = low;
        for (let row = low; row < Math.min(start + perPixel, to); row++) {
          if (values[row] < values[low]) low = row;
          if (values[row] > values[high]) high = row;
        }
        for (const row of low < high ? [low, high] : [high, low]) put(row);
      }
    }
    return `M${points.join("L")}`;
  }

  drawGrid(width, height) {
    const across = ticks(...this.span, width / 90),
      up = ticks(...this.range, height / 40);
    const vertical = across.map(
      (time) =>
        `<line x1="${this.x(time)}" x2="${this.x(time)}" y1="${EDGE.top}" y2="${height - EDGE.bottom}"></line><text x="${this.x(time)}" y="${height - EDGE.bottom + 13}" text-anchor="middle">${plain(time)}</text>`,
    );
    const horizontal = up.map(
      (force) =>
        `<line x1="${EDGE.left}" x2="${width - EDGE.right}" y1="${this.y(force)}" y2="${this.y(force)}"></line><text x="${EDGE.left - 5}" y="${this.y(force) + 3.5}" text-anchor="end">${plain(force)}</text>`,
    );
    const labels = `<text class="label" x="${(EDGE.left + width - EDGE.right) / 2}" y="${height - 3}" text-anchor="middle">Process time (s)</text>
      <text class="label" transform="translate(12 ${(height - EDGE.bottom + EDGE.top) / 2}) rotate(-90)" text-anchor="middle">Drag force, magnitude (N)</text>`;
    this.element.querySelector(".grid").innerHTML = [...vertical, ...horizontal, labels].join("");
  }

  moveCursor(time) {
    this.time = time;
    const inside = time >= this.span[0] && time <= this.span[1];
    set(this.element.querySelector(".cursor"), {
      x1: this.x(time),
      x2: this.x(time),
      y1: EDGE.top,
      y2: this.size[1] - EDGE.bottom,
    });
    this.element.querySelector(".cursor").toggleAttribute("hidden", !inside);
    this.element
      .querySelectorAll(".peaks circle")
      .forEach((peak) => peak.classList.toggle("now", Math.abs(this.peaks[peak.dataset.rank].time - time) < 1e-9));
  }

  /** Drag to zoom, click to go to a time or a peak, double click for the whole, hover for values. */
  listen() {
    const { element } = this,
      selection = element.querySelector(".selection"),
      hover = element.querySelector(".hover");
    let start = null;
    const place = (event) => event.clientX - element.getBoundingClientRect().left;
    element.addEventListener("pointerdown", (event) => {
      start = place(event);
      element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      const x = place(event),
        time = this.timeAt(x);
      set(hover.querySelector("line"), {
        x1: this.x(time),
        x2: this.x(time),
        y1: EDGE.top,
        y2: this.size[1] - EDGE.bottom,
      });
      set(hover.querySelector("circle"), {
        cx: this.x(time),
        cy: this.y(this.at(time, this.shown.smooth ? this.smooth : this.raw)),
      });
      hover.removeAttribute("hidden");
      this.hovered?.({ time, raw: this.at(time), smooth: this.at(time, this.smooth) });
      if (start === null || Math.abs(x - start) < 4) return;
      selection.removeAttribute("hidden");
      set(selection, {
        x: Math.min(x, start),
        width: Math.abs(x - start),
        y: EDGE.top,
        height: this.size[1] - EDGE.top - EDGE.bottom,
      });
    });
    element.addEventListener("pointerup", (event) => {
      const x = place(event),
        from = start;
      start = null;
      selection.setAttribute("hidden", "");
      if (from === null) return;
      if (Math.abs(x - from) >= 4) this.zoom([this.timeAt(Math.min(x, from)), this.timeAt(Math.max(x, from))]);
      else this.click(x, event.clientY - element.getBoundingClientRect().top);
    });
    element.addEventListener("pointerleave", () => {
      hover.setAttribute("hidden", "");
      this.hovered?.(null);
    });
    element.addEventListener("dblclick", () => this.zoom([...this.whole]));
  }

  click(x, y) {
    const away = this.peaks.map(({ time, force }) => Math.hypot(this.x(time) - x, this.y(force) - y)),
      rank = away.indexOf(Math.min(...away));
    if (away[rank] <= NEAR) this.goToPeak(rank);
    else this.go(this.timeAt(x));
  }
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

function niceRange(values) {
  const low = Math.min(
      0,
      values.reduce((least, value) => Math.min(least, value), Infinity),
    ),
    high = values.reduce((most, value) => Math.max(most, value), -Infinity);
  return [low, low + 1.06 * (high - low || 1)];
}
