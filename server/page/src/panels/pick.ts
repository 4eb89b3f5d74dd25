// Picking: the object or avatar under a pixel, and the card that describes it.
import { Vector2, Vector3 } from "three";
import { describeError, type App } from "../app";
import type { Avatars } from "../view/avatars";
import type { CameraRig } from "../view/camera_rig";
import { makeButton, makeElement, makeFacts, setText } from "./dom";
import { formatLength, getLastName, shortenPath } from "./format";
import { Verdict, type PairState } from "../generated/enfilade_pb";
import type { Walk } from "../walk/walk";
import type { RequestFields } from "../world/source";

const TOUCH_SECONDS = 1; // between queries for what touches the selected object
const MAX_TOUCHING = 12;

type BodyAction = NonNullable<RequestFields<"bodyCommand">["action"]>;

const DOOR_ACTIONS: [string, BodyAction][] = [["Open", { case: "open", value: {} }], ["Close door", { case: "close", value: {} }]];
/** The commands of each kind of body, with the texts of their buttons. Levels of lifts come from the stops of the body itself. */
const ACTIONS: Record<string, [string, BodyAction][]> = {
  hinged: DOOR_ACTIONS,
  sliding: DOOR_ACTIONS,
  lift: [],
  path: [["Run", { case: "run", value: {} }], ["Stop", { case: "stop", value: {} }]],
  rigid: [],
  trigger: [],
};

interface Picked {
  entity: number;
  point: Vector3;
  normal: Vector3 | null;
}

/** The ray through a pixel of the canvas, in the scene's axes. */
export function computeRay(app: App, x: number, y: number): { origin: Vector3; direction: Vector3 } {
  const { camera, canvas } = app.view;
  camera.updateMatrixWorld();
  const point = new Vector2((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight);
  const origin = new Vector3().setFromMatrixPosition(camera.matrixWorld);
  const direction = new Vector3(point.x, point.y, 0.5).unproject(camera).sub(origin).normalize();
  return { origin, direction };
}

export function pick(app: App, avatars: Avatars, x: number, y: number): Picked | null {
  const { origin, direction } = computeRay(app, x, y);
  const hit = app.model?.raycast(origin, direction) ?? null;
  const person = avatars.raycast(origin, direction);
  if (person && person.distance < (hit?.distance ?? Infinity)) return { ...person, normal: null };
  return hit;
}

export class Card {
  readonly root: HTMLElement;
  #app: App;
  #rig: CameraRig;
  #walk: Walk;
  #place: Picked | null = null;
  #title = makeElement("h2");
  #path = makeElement("p", { class: "path" });
  #facts = makeElement("dl");
  #touching = makeElement("ul", { class: "touching" });
  #touchTitle = makeElement("h3", {}, "Touches now");
  #walkHere: HTMLButtonElement;
  #hide: HTMLButtonElement;
  #doors = makeElement("div", { class: "row" });
  #asked = 0;

  constructor(app: App, rig: CameraRig, walk: Walk) {
    this.#app = app;
    this.#rig = rig;
    this.#walk = walk;
    this.#walkHere = makeButton("Walk from here", () => this.#start());
    this.#hide = makeButton("Hide", () => this.#toggleHidden());
    this.root = makeElement(
      "section", { class: "card", label: "Selected object", hidden: true },
      makeElement("header", {}, this.#title, makeButton("×", () => app.select(0), { class: "close", label: "Close" })),
      this.#path, this.#facts, this.#doors,
      makeElement("div", { class: "row" }, makeButton("Go to", () => this.#goTo()), this.#hide, this.#walkHere),
      this.#touchTitle, this.#touching,
    );
    app.selected.listen((id) => this.#show(id));
    app.visibilityChanged.listen(() => this.#updateHide());
    setInterval(() => void this.#askTouching(), TOUCH_SECONDS * 1000);
  }

  /** Remembers where the object was hit, for “Walk from here”. */
  setPlace(place: Picked | null): void {
    this.#place = place;
    this.#walkHere.hidden = !(place?.normal && place.normal.y > 0.7);
  }

  #show(id: number): void {
    this.root.hidden = id === 0;
    if (this.#place?.entity !== id) this.setPlace(null);
    if (id === 0) return;
    const entity = this.#app.table.byId.get(id);
    setText(this.#title, entity ? getLastName(entity.path) : this.#app.table.findName(id));
    setText(this.#path, entity?.path ?? "avatar");
    const box = this.#app.model?.findBox(id);
    const size = box?.getSize(new Vector3());
    this.#facts.replaceChildren(...makeFacts([
      ["Class", entity?.class], ["GlobalId", entity?.globalId], ["Storey", entity?.storey],
      ["Size x, z, y", size && `${size.x.toFixed(2)} × ${size.z.toFixed(2)} × ${size.y.toFixed(2)} m`],
      ["Entity", String(id)],
    ]));
    this.#showBody(id);
    this.#touching.replaceChildren();
    setText(this.#touchTitle, "Touches now");
    this.#updateHide();
    void this.#askTouching();
  }

  /** Bodies that take commands have a button for each. */
  #showBody(id: number): void {
    const bodyId = this.#app.table.bodyByObject.get(id);
    const body = this.#app.welcome?.scene?.bodies.find((one) => one.id === bodyId);
    this.#doors.replaceChildren();
    if (!body) return;
    this.#facts.append(...makeFacts([["Body", body.mass ? `${body.kind}, ${body.mass} kg` : body.kind]]));
    if (this.#app.connection.isFile) return;
    const levels = body.stops.map((_, level): [string, BodyAction] => [`Level ${level}`, { case: "level", value: level }]);
    for (const [text, action] of [...(ACTIONS[body.kind] ?? []), ...levels]) {
      this.#doors.append(makeButton(text, () =>
        this.#app.attempt(this.#app.connection.request("bodyCommand", { body: body.name, action }))));
    }
  }

  #updateHide(): void {
    const { selection, model } = this.#app;
    setText(this.#hide, model?.flags.isHidden(selection) ? "Show" : "Hide");
    this.#hide.hidden = !this.#app.table.byId.has(selection);
  }

  #toggleHidden(): void {
    const { selection, model } = this.#app;
    model?.flags.setHidden(selection, !model.flags.isHidden(selection));
    this.#app.visibilityChanged.emit();
  }

  #goTo(): void {
    const { selection, model, table } = this.#app;
    const box = model?.findPresentBox(selection);
    if (box) this.#rig.showBox(box);
    else if (table.avatars.has(selection)) this.#app.setFocus(table.avatars.get(selection)!);
  }

  #start(): void {
    if (this.#place) void this.#walk.start(this.#place.point.clone().setY(this.#place.point.y + 0.002));
  }

  async #askTouching(): Promise<void> {
    const id = this.#app.selection;
    if (id === 0 || !this.#app.connection.isOpen || document.hidden) return;
    const asked = ++this.#asked;
    const epsilon = this.#app.welcome?.policies?.epsilon ?? 0.0005;
    try {
      const { found, leftOut } = await this.#app.connection.request("touching", {
        entity: { by: { case: "id", value: id } }, within: 2 * epsilon,
      });
      if (asked === this.#asked && id === this.#app.selection) this.#showTouching(found, leftOut);
    } catch (error) {
      setText(this.#touchTitle, describeError(error as Error));
    }
  }

  #showTouching(found: PairState[], leftOut: number): void {
    setText(this.#touchTitle, found.length === 0 ? "Touches nothing now" : `Touches now: ${found.length + leftOut}`);
    const rows = found.slice(0, MAX_TOUCHING).map(({ b, bName, verdict, distance }) => makeElement(
      "li", {},
      makeButton(shortenPath(bName), () => this.#app.select(b), { title: bName, class: "link" }),
      makeElement("span", {}, verdict === Verdict.PENETRATING ? "penetrates" : verdict === Verdict.TOUCHING ? "touches" : formatLength(distance)),
    ));
    // A list that is not replaced keeps the focus of the keyboard.
    if (rows.map((row) => row.textContent).join() !== [...this.#touching.children].map((row) => row.textContent).join()) {
      this.#touching.replaceChildren(...rows);
    }
  }
}
