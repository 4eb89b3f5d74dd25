// The list of avatars: follow one, in first or third person.
import type { App } from "../app";
import { findCssColor, type Avatars } from "../view/avatars";
import type { CameraRig } from "../view/camera_rig";
import { makeButton, makeCheck, makeElement } from "./dom";
import { getLastName } from "./format";
import type { AvatarState } from "../generated/enfilade_pb";
import type { Walk } from "../walk/walk";

const MAX_ROWS = 200;

export class People {
  readonly root = makeElement("div", { class: "stack" });
  #list = makeElement("ul", { class: "people", label: "Avatars" });
  #app: App;
  #rig: CameraRig;
  #walk: Walk;
  #shown = "";

  constructor(app: App, rig: CameraRig, walk: Walk, avatars: Avatars) {
    this.#app = app;
    this.#rig = rig;
    this.#walk = walk;
    const shapes = makeElement("input", { type: "checkbox", id: "shapes" });
    shapes.addEventListener("change", () => {
      avatars.prismsShown = shapes.checked;
      app.view.invalidate();
    });
    this.root.append(makeCheck(shapes, "Shapes that collide"), this.#list);
    setInterval(() => this.#render(), 300);
  }

  #render(): void {
    if (this.root.offsetParent === null) return;
    const all = this.#app.state.latest?.avatars ?? [];
    const avatars = all.slice(0, MAX_ROWS);
    const names = `${all.map(({ id, name }) => `${id} ${name}`).join()} ${this.#app.focus} ${this.#walk.name}`;
    if (names !== this.#shown) {
      this.#shown = names;
      this.#list.replaceChildren(...(avatars.length > 0 ? avatars.map((avatar) => this.#makeRow(avatar))
        : [makeElement("li", { class: "empty" }, "No avatar is in the world.")]));
      if (all.length > MAX_ROWS) this.#list.append(makeElement("li", { class: "empty" }, `and ${all.length - MAX_ROWS} more`));
    }
    avatars.forEach((avatar, index) => {
      const doing = this.#list.children[index]?.querySelector(".doing");
      if (doing) doing.textContent = this.#describe(avatar);
    });
  }

  #makeRow({ id, name }: AvatarState): HTMLElement {
    const dot = makeElement("span", { class: "dot" });
    dot.style.background = findCssColor(id);
    const isFollowed = this.#app.focus === name;
    const follow = makeButton(isFollowed ? "Leave view" : "Follow", () => this.#follow(name), { "aria-pressed": String(isFollowed) });
    return makeElement(
      "li", {}, dot,
      makeElement("span", { class: "who" }, name === this.#walk.name ? `${name} (you)` : name, makeElement("small", { class: "doing" })),
      follow,
    );
  }

  #describe({ feet, flying, grounded, move }: AvatarState): string {
    const made = move?.made;
    const speed = made ? Math.hypot(made.x, made.y, made.z) / (this.#app.welcome?.policies?.tick ?? 1 / 60) : 0;
    const what = flying ? "flies" : !grounded ? "in the air" : speed > 0.01 ? "walks" : "stands";
    const stopped = move?.stoppedByName ? `, stopped by ${getLastName(move.stoppedByName)}` : "";
    return `${what}, ${speed.toFixed(1)} m/s, height ${(feet?.y ?? 0).toFixed(2)} m${stopped}`;
  }

  #follow(name: string): void {
    if (this.#app.focus === name) {
      this.#app.setFocus("");
      this.#rig.setMode("free");
    } else {
      this.#app.setFocus(name);
      this.#rig.setMode(name === this.#walk.name ? "first" : "third");
    }
    this.#shown = "";
    this.#render();
  }
}
