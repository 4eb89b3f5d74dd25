// The frame of the page: header, side panel with tabs, messages, and the dialog for troubles.
import type { App } from "../app";
import { makeButton, makeElement, makeFacts, setText } from "./dom";
import type { Trouble } from "../world/source";

const TOAST_SECONDS = 6;

export interface Tab {
  name: string;
  content: HTMLElement;
}

export function makeTabs(tabs: Tab[]): HTMLElement {
  const bar = makeElement("div", { class: "tabs", role: "tablist", label: "Panels" });
  const buttons: HTMLButtonElement[] = [];
  const show = (chosen: number) => tabs.forEach(({ content }, index) => {
    content.hidden = index !== chosen;
    buttons[index]!.setAttribute("aria-selected", String(index === chosen));
    buttons[index]!.tabIndex = index === chosen ? 0 : -1;
  });
  tabs.forEach(({ name, content }, index) => {
    content.setAttribute("role", "tabpanel");
    content.setAttribute("aria-label", name);
    buttons.push(makeButton(name, () => show(index), { role: "tab" }));
  });
  bar.append(...buttons);
  bar.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (step === 0) return;
    const at = buttons.indexOf(document.activeElement as HTMLButtonElement);
    const next = (at + step + buttons.length) % buttons.length;
    show(next);
    buttons[next]!.focus();
    event.preventDefault();
  });
  show(0);
  return makeElement("aside", { class: "panel", label: "Scene and world" }, bar, ...tabs.map(({ content }) => content));
}

/** Sentences that vanish by themselves. */
export function makeToasts(app: App): HTMLElement {
  const root = makeElement("div", { class: "toasts", role: "status", "aria-live": "polite" });
  app.said.listen((text) => {
    const toast = makeElement("p", {}, text);
    root.append(toast);
    while (root.children.length > 3) root.firstElementChild!.remove();
    setTimeout(() => toast.remove(), TOAST_SECONDS * 1000);
  });
  return root;
}

/** What is wrong, in words, and the token field. */
export function makeTroubleDialog(app: App, onToken: (token: string) => void): HTMLElement {
  const text = makeElement("p");
  const detail = makeElement("p", { class: "quiet" });
  const token = makeElement("input", { type: "password", autocomplete: "off", label: "Token", placeholder: "Token" });
  const form = makeElement("form", { hidden: true }, token, makeElement("button", { type: "submit" }, "Connect"));
  const retry = makeButton("Try now", () => void app.connection.open(), { hidden: true });
  const root = makeElement("div", { class: "trouble", role: "alert" }, text, detail, form, retry);
  let countdown = 0;
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    onToken(token.value.trim());
  });
  const showTrouble = (trouble: Trouble) => {
    clearInterval(countdown);
    root.hidden = false;
    setText(text, trouble.text);
    setText(detail, "");
    form.hidden = trouble.kind !== "token";
    retry.hidden = trouble.kind !== "waiting";
    if (trouble.kind === "token") token.focus();
    if (trouble.kind !== "waiting") return;
    let left = Math.ceil(trouble.seconds);
    const showCountdown = () => setText(detail, left > 0 ? `Trying again in ${left} s …` : "Connecting …");
    showCountdown();
    countdown = window.setInterval(() => {
      --left;
      showCountdown();
    }, 1000);
  };
  app.troubled.listen(showTrouble);
  app.loading.listen((what) => {
    clearInterval(countdown);
    root.hidden = false;
    form.hidden = retry.hidden = true;
    setText(text, what);
    setText(detail, "");
  });
  app.opened.listen(() => {
    clearInterval(countdown);
    root.hidden = true;
  });
  setText(text, "Connecting …");
  return root;
}

/** `isFile`: the page of a recording, in which no avatar can be driven. */
export function makeHelp(isFile: boolean): HTMLElement {
  const keys: [string, string][] = [
    ["W A S D, arrows", isFile ? "fly the camera" : "walk (without an avatar: fly the camera)"],
    ["Mouse drag", "look around; M captures the mouse"], ["Click", "name the object"],
    ["V", "first or third person of the followed avatar"], ["P", "pause or play"], ["Wheel", "distance in third person"],
  ];
  if (!isFile) {
    keys.push(["Enter", "enter the world with an avatar"], ["Shift", "run"], ["Space", "jump"], ["C", "crouch"],
      ["F", "fly; E and Q up and down"], ["Esc", "leave the avatar"], ["Touch", "left half walks, right half looks"]);
  }
  return makeElement("div", { class: "stack" }, makeElement("dl", { class: "facts" }, ...makeFacts(keys)));
}
