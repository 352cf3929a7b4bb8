// Light, dark, or as the system has it; remembered by this browser.

import { element, setAttribute } from "./dom.js";
import { picture } from "./icons.js";

const CHOICES = ["auto", "light", "dark"];
const PICTURES = { auto: "auto", light: "sun", dark: "moon" };
const WORDS = { auto: "Colours: as the system", light: "Colours: light", dark: "Colours: dark" };
const KEY = "axlecast-colours";

function remembered() {
  try {
    const choice = localStorage.getItem(KEY);
    return CHOICES.includes(choice) ? choice : "auto";
  } catch {
    return "auto"; // storage is switched off
  }
}

function remember(choice) {
  try {
    localStorage.setItem(KEY, choice);
  } catch {
    // then it holds until the page is left
  }
}

// A button that goes through the choices; `onChange` when colours are others.
export function themeButton(onChange) {
  let choice = remembered();
  const button = element("button.quiet.square", { type: "button", id: "theme" });
  const show = () => {
    setAttribute(document.documentElement, "data-theme", choice === "auto" ? null : choice);
    setAttribute(button, "aria-label", WORDS[choice]);
    button.title = WORDS[choice];
    button.replaceChildren(picture(PICTURES[choice]));
  };
  button.addEventListener("click", () => {
    choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length];
    remember(choice);
    show();
    onChange();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", onChange);
  show();
  return button;
}
