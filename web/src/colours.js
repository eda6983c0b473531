// Colours of the page: those of all figures for what they show too; one map for force, speed,
// displacement and load; one colour per class.
import COLOURS from "../../workflow/dragdeck/data/colours.json";

export { COLOURS };
export const PALE = "#dfe3e8",
  MEDIA = "#b9c2cc",
  STEEL = "#8d98a5",
  CHOSEN = COLOURS.red;
export const CLASS_COLOURS = [COLOURS.grey, COLOURS.red, COLOURS.blue]; // told apart with any colour vision
const OF_MEDIA = ["blue", "orange", "green", "violet", "teal", "red"].map((name) => COLOURS[name]);
/** Colour of a class of media by its number. */
export const mediaColour = (number) => OF_MEDIA[number % OF_MEDIA.length];

export const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

/** A map of numbers from 0 to 1 onto colours, from colours at equal distances. */
export function colourMap(hexes) {
  const table = hexes.map(rgb),
    last = table.length - 1;
  return (value) => {
    const at = Math.min(Math.max(value, 0), 1) * last,
      k = Math.min(Math.floor(at), last - 1),
      part = at - k;
    return blend(table[k], table[k + 1], part);
  };
}

export const blend = (from, to, part) => from.map((channel, c) => channel + part * (to[c] - channel));
