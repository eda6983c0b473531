// Elements of the page.

export const byId = (id) => document.getElementById(id);

/** A new element with properties and what it contains. */
export function make(tag, properties, ...parts) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...parts);
  return element;
}
