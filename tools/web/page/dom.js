// Elements without a framework: made once, then only told what has changed.

const SVG = "http://www.w3.org/2000/svg";

// element("button.primary", {type: "button", onclick: f}, "Text", child): properties, with aria-* and data-* as attributes.
export function element(selector, properties = {}, ...children) {
  const [tag, ...classes] = selector.split(".");
  const node = document.createElement(tag || "div");
  if (classes.length > 0) node.className = classes.join(" ");
  for (const [name, value] of Object.entries(properties)) {
    if (name in node && !name.includes("-")) node[name] = value;
    else node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
}

export function drawing(tag, attributes = {}, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

export function setText(node, text) {
  if (node.shownText !== text) {
    node.shownText = text;
    node.textContent = text;
  }
}

// A unit behind its number; the sign of degrees stands close to it.
export function setUnit(node, text) {
  setText(node, text);
  node.classList.toggle("degree", text === "°");
}

export function setAttribute(node, name, value) {
  if (value === null || value === undefined) {
    if (node.hasAttribute(name)) node.removeAttribute(name);
  } else if (node.getAttribute(name) !== String(value)) {
    node.setAttribute(name, String(value));
  }
}

export function setHidden(node, hidden) {
  if (node.hidden !== hidden) node.hidden = hidden;
}

// Children of `parent` for `items`, in their order: made by make(item) -> {root, update(item)}, kept by keyOf(item).
export class KeyedList {
  constructor(parent, keyOf, make) {
    this.parent = parent;
    this.keyOf = keyOf;
    this.make = make;
    this.parts = new Map();
  }

  update(items) {
    const gone = new Set(this.parts.keys());
    let place = this.parent.firstChild;
    for (const item of items) {
      const key = this.keyOf(item);
      gone.delete(key);
      if (!this.parts.has(key)) this.parts.set(key, this.make(item));
      const part = this.parts.get(key);
      part.update(item);
      if (part.root === place) place = place.nextSibling;
      else this.parent.insertBefore(part.root, place);
    }
    for (const key of gone) {
      this.parts.get(key).root.remove();
      this.parts.delete(key);
    }
  }
}

/** What is known of something, a label and its text each: `update` takes [label, text] pairs. */
export function factList(root) {
  return new KeyedList(
    root,
    ([label]) => label,
    ([label]) => {
      const value = element("dd");
      return {
        root: element("div", {}, element("dt", {}, label), value),
        update: ([, text]) => setText(value, text),
      };
    },
  );
}
