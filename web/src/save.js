// The scene as a picture or a film, with the labels that lie over it.
import { make } from "./dom.js";

const KINDS = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];
const RATE = 30, // pictures per second of a film
  PART_MS = 250; // a film is recorded in parts of this length

/** What this browser can record a canvas as; none if it cannot. */
export const filmKind = () =>
  HTMLCanvasElement.prototype.captureStream && KINDS.find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));

/** Save the scene as a PNG file with twice the pixels of the screen along each edge. */
export function savePicture(view, name) {
  view.draw(2 * devicePixelRatio);
  const canvas = sheet(view);
  paint(canvas, view);
  view.wanted();
  canvas.toBlob((blob) => download(blob, `${name}.png`));
}

/** A film of what the view shows until it is ended. */
export class Film {
  /** `begun()` is called once the browser records; the first pictures may be lost before. */
  constructor(view, name, begun) {
    const canvas = sheet(view),
      kind = filmKind(),
      parts = [];
    const recorder = new MediaRecorder(canvas.captureStream(RATE), { mimeType: kind, videoBitsPerSecond: 8e6 });
    const turn = () => {
      view.draw(devicePixelRatio);
      paint(canvas, view);
      if (recorder.state === "recording") requestAnimationFrame(turn);
    };
    this.left = Infinity; // parts to come
    recorder.ondataavailable = ({ data }) => {
      if (data.size && !parts.length) begun();
      if (data.size) parts.push(data);
      if (data.size && --this.left === 0) recorder.stop();
    };
    recorder.onstop = () => download(new Blob(parts, { type: kind }), `${name}.${kind.slice(6).split(";")[0]}`);
    recorder.start(PART_MS);
    turn();
  }

  /** Record the last picture and save the film. */
  end() {
    this.left = 3; // the first ones may end before that picture
  }
}

/** An empty canvas of the size of the picture that was drawn last, in even numbers of pixels, as films need. */
function sheet({ renderer: { domElement } }) {
  const [width, height] = [domElement.width, domElement.height].map((size) => size - (size % 2));
  return make("canvas", { width, height });
}

/** Paint what was just drawn, and what lies over it where the browser shows it. */
function paint(canvas, { renderer: { domElement } }) {
  const context = canvas.getContext("2d"),
    { width, left, top } = domElement.getBoundingClientRect();
  context.resetTransform();
  context.drawImage(domElement, 0, 0, canvas.width, canvas.height);
  context.scale(canvas.width / width, canvas.width / width);
  context.translate(-left, -top);
  for (const element of domElement.parentElement.querySelectorAll(":not(canvas)")) paintElement(context, element);
}

function paintElement(context, element) {
  const style = getComputedStyle(element),
    { left, top, width, height } = element.getBoundingClientRect();
  if (!width || !height) return;
  const colours = style.backgroundImage.match(/rgba?\([^)]*\)/g),
    fill = colours ? context.createLinearGradient(left, 0, left + width, 0) : style.backgroundColor;
  colours?.forEach((colour, k) => fill.addColorStop(k / (colours.length - 1), colour));
  context.fillStyle = fill;
  context.fillRect(left, top, width, height);
  const [up, right, down, before] = ["Top", "Right", "Bottom", "Left"].map((side) =>
    parseFloat(style[`border${side}Width`]),
  );
  context.fillStyle = style.borderBottomColor;
  context.fillRect(left, top, width, up);
  context.fillRect(left + width - right, top, right, height);
  context.fillRect(left, top + height - down, width, down);
  context.fillRect(left, top, before, height);
  const { color: fillStyle, fontWeight, fontSize, fontFamily } = style; // `font` is empty with tabular numerals
  Object.assign(context, { fillStyle, font: `${fontWeight} ${fontSize} ${fontFamily}` });
  for (const node of element.childNodes) if (node.nodeType === Node.TEXT_NODE) paintWords(context, node);
}

/** Paint each word of a text where it is, whatever line that is on. */
function paintWords(context, node) {
  const range = document.createRange();
  for (const { 0: word, index } of node.data.matchAll(/[^ \n]+/g)) {
    range.setStart(node, index);
    range.setEnd(node, index + word.length);
    const { left, top } = range.getBoundingClientRect();
    context.fillText(word, left, top + context.measureText(word).fontBoundingBoxAscent);
  }
}

function download(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
