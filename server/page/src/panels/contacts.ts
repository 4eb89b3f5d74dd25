// Contacts and near misses: a list by time, and markers around the avatar in focus.
import { ArrowHelper, Group, Mesh, MeshBasicMaterial, SphereGeometry, Vector3, type Material } from "three";
import type { App } from "../app";
import type { CameraRig } from "../view/camera_rig";
import { makeButton, makeCheck, makeElement, setText } from "./dom";
import { formatLength, formatTime, shortenPath } from "./format";
import {
  ContactEvent_Kind as Kind, ContactEvent_Phase as Phase, ContactEvent_Reason as Reason, Verdict, type ContactEvent,
  type PairState,
} from "../generated/enfilade_pb";
import { toVector } from "../world/world_state";

const MAX_LISTED = 400;
const MAX_ROWS = 120;
const QUERY_SECONDS = 0.15; // between queries for what is near the focused avatar
const NEAR = 0.25; // metres: shown as near misses if the server has no limit of its own
const MAX_MARKERS = 12;
const FLOOR_NORMAL = -0.7; // y of the normal from an avatar to what it stands on
const LABEL_HEIGHT = 20; // pixels
const LABEL_WIDTH = 210; // pixels
const TOUCH_COLOR = 0xc0392b;
const NEAR_COLOR = 0xd68910;

interface Marker {
  group: Group;
  ball: Mesh<SphereGeometry, MeshBasicMaterial>;
  arrow: ArrowHelper;
  label: HTMLElement;
  x: number; // pixels of the label
  y: number;
}

export class Contacts {
  readonly root: HTMLElement;
  readonly labels = makeElement("div", { class: "labels", "aria-hidden": "true" });
  #listed: ContactEvent[] = []; // newest first
  #app: App;
  #rig: CameraRig;
  #live = new Map<string, ContactEvent>();
  #list = makeElement("ol", { class: "events", label: "Contacts, newest first" });
  #summary = makeElement("p", { class: "quiet", role: "status" });
  #floors = makeElement("input", { type: "checkbox", id: "floors" });
  #ends = makeElement("input", { type: "checkbox", id: "ends" });
  #markersShown = makeElement("input", { type: "checkbox", id: "markers", checked: true });
  #markers: Marker[] = [];
  #root = new Group();
  #isDirty = true;
  #isAsking = false;
  #found: PairState[] = [];

  constructor(app: App, rig: CameraRig) {
    this.#app = app;
    this.#rig = rig;
    this.root = makeElement(
      "div", { class: "stack" }, this.#summary,
      makeElement("div", { class: "row" }, makeCheck(this.#markersShown, "Markers"), makeCheck(this.#floors, "Floors"), makeCheck(this.#ends, "Ends"),
        makeButton("Clear", () => this.#clear())),
      this.#list,
    );
    for (const box of [this.#floors, this.#ends]) box.addEventListener("change", () => (this.#isDirty = true));
    this.#markersShown.addEventListener("change", () => app.view.invalidate());
    app.view.scene.add(this.#root);
    app.contactsReset.listen((live) => this.#reset(live));
    app.contactEvents.listen((events) => this.#take(events));
    app.focused.listen(() => (this.#found = []));
    app.view.updaters.push(() => this.#placeMarkers());
    setInterval(() => this.#render(), 250);
    setInterval(() => void this.#ask(), QUERY_SECONDS * 1000);
  }

  get liveCount(): number {
    return this.#live.size;
  }

  #clear(): void {
    this.#listed.length = 0;
    this.#isDirty = true;
  }

  #reset(live: ContactEvent[]): void {
    this.#live.clear();
    for (const event of live) this.#live.set(makeKey(event), event);
    this.#isDirty = true;
  }

  #take(events: ContactEvent[]): void {
    for (const event of events) {
      if (event.kind === Kind.BEGIN) this.#live.set(makeKey(event), event);
      if (event.kind === Kind.END) this.#live.delete(makeKey(event));
      this.#listed.unshift(event);
    }
    this.#listed.length = Math.min(this.#listed.length, MAX_LISTED);
    this.#isDirty = true;
  }

  #isListed(event: ContactEvent): boolean {
    const isEnd = event.kind === Kind.END || event.kind === Kind.LEAVE || event.kind === Kind.NEAR && event.phase === Phase.END;
    return (this.#floors.checked || !isFloor(event)) && (this.#ends.checked || !isEnd);
  }

  #render(): void {
    if (!this.#isDirty || this.root.offsetParent === null) return;
    this.#isDirty = false;
    const floors = [...this.#live.values()].filter(isFloor).length;
    const others = this.#live.size - floors;
    setText(this.#summary, `Now: ${others} ${others === 1 ? "contact" : "contacts"}, and ${floors} with floors`);
    const rows = this.#listed.filter((event) => this.#isListed(event)).slice(0, MAX_ROWS).map((event) => this.#makeRow(event));
    if (rows.length === 0) rows.push(makeElement("li", { class: "empty" }, "No contact yet. Walk into something."));
    this.#list.replaceChildren(...rows);
  }

  #makeRow(event: ContactEvent): HTMLElement {
    const row = makeButton("", () => this.#goTo(event), { class: `event ${getCssClass(event)}`, title: `${event.aName} – ${event.bName}` });
    row.append(
      makeElement("time", {}, formatTime(event.time)),
      makeElement("span", { class: "what" }, describeEvent(event)),
      makeElement("span", { class: "distance" }, formatDistance(event)),
      makeElement("span", { class: "who" }, this.#formatPair(event)),
    );
    return makeElement("li", {}, row);
  }

  /** Both names; that of the focused avatar is left out. */
  #formatPair({ aName, bName }: ContactEvent): string {
    if (!bName) return aName;
    return aName === this.#app.focus ? shortenPath(bName) : `${shortenPath(aName)} – ${shortenPath(bName)}`;
  }

  /** Flies to where the contact can be seen: off its normal, on the side of `a`. */
  #goTo(event: ContactEvent): void {
    if (event.b !== 0) this.#app.select(event.b);
    if (!event.pointB) return;
    const point = toVector(event.pointB);
    const away = toVector(event.normal).negate().add(new Vector3(0, 0.5, 0));
    const side = new Vector3(-away.z, 0, away.x).multiplyScalar(0.7);
    const direction = away.add(side).normalize();
    const hit = this.#app.model?.raycast(point.clone().addScaledVector(direction, 0.02), direction, 2.6);
    this.#rig.flyTo(point.clone().addScaledVector(direction, Math.max(0.5, (hit?.distance ?? 2.6) - 0.15)), point);
  }

  /** The exact distances around the focused avatar. They need no limit for near misses on the server. */
  async #ask(): Promise<void> {
    const { focus, connection, state, welcome } = this.#app;
    const avatar = focus ? this.#app.avatarState(focus) : undefined;
    if (!avatar || !this.#markersShown.checked) this.#found = [];
    if (!avatar || this.#isAsking || document.hidden || !connection.isOpen || !state.latest || !this.#markersShown.checked) return;
    this.#isAsking = true;
    try {
      const { found } = await connection.request("touching", {
        entity: { by: { case: "id", value: avatar.id } }, within: welcome?.policies?.nearMiss || NEAR,
      });
      this.#found = found.filter(({ normal }) => (normal?.y ?? 0) > FLOOR_NORMAL).slice(0, MAX_MARKERS);
      this.#app.view.invalidate();
    } catch {
      this.#found = []; // the avatar left between its state and this query
    } finally {
      this.#isAsking = false;
    }
  }

  #placeMarkers(): boolean {
    const shown = this.#markersShown.checked ? this.#found : [];
    while (this.#markers.length < shown.length) this.#addMarker();
    const epsilon = this.#app.welcome?.policies?.epsilon ?? 0.0005;
    this.#markers.forEach((marker, index) => {
      const pair = shown[index];
      marker.group.visible = pair !== undefined;
      marker.label.hidden = !pair;
      if (pair) this.#place(marker, pair, epsilon);
    });
    this.#placeLabels();
    return false;
  }

  #addMarker(): void {
    const material = new MeshBasicMaterial({ color: TOUCH_COLOR, depthTest: false, transparent: true, opacity: 0.9 });
    const ball = new Mesh(new SphereGeometry(1, 16, 12), material);
    ball.renderOrder = 10;
    const arrow = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 0.3, TOUCH_COLOR, 0.08, 0.05);
    const group = new Group();
    group.add(ball, arrow);
    for (const part of [arrow.line, arrow.cone]) {
      (part.material as Material).depthTest = false;
      part.renderOrder = 10;
    }
    this.#root.add(group);
    const label = makeElement("span", { class: "marker" });
    this.labels.append(label);
    this.#markers.push({ group, ball, arrow, label, x: 0, y: 0 });
  }

  #place(marker: Marker, pair: PairState, epsilon: number): void {
    const isContact = pair.verdict !== Verdict.SEPARATED || pair.distance < 2 * epsilon;
    const color = isContact ? TOUCH_COLOR : NEAR_COLOR;
    const point = toVector(pair.pointB);
    const { camera, canvas } = this.#app.view;
    const distance = point.distanceTo(camera.position);
    marker.ball.position.copy(point);
    marker.ball.scale.setScalar(Math.max(0.008, 0.007 * distance)); // the same size in the picture
    marker.ball.material.color.setHex(color);
    // The normal of the obstacle: towards the avatar.
    marker.arrow.position.copy(point);
    marker.arrow.setDirection(toVector(pair.normal).negate().normalize());
    marker.arrow.setColor(color);
    // Seen from nearby, an arrow would cover what it points at.
    const length = Math.min(0.3, 0.2 * distance);
    marker.arrow.setLength(length, 0.22 * length, 0.12 * length);
    const screen = point.clone().project(camera);
    marker.label.hidden = screen.z >= 1; // behind the camera
    if (marker.label.hidden) return;
    const text = isContact ? "contact" : formatLength(pair.distance);
    setText(marker.label, `${text} · ${shortenPath(pair.bName)}`);
    marker.label.classList.toggle("near", !isContact);
    // The label of a point outside the picture stays at its edge: the wall that stops an avatar is often too near to see.
    const inside = (value: number, low: number, high: number) => Math.max(low, Math.min(high, value));
    marker.x = inside(((screen.x + 1) / 2) * canvas.clientWidth, 0, canvas.clientWidth - LABEL_WIDTH);
    marker.y = inside(((1 - screen.y) / 2) * canvas.clientHeight, LABEL_HEIGHT, canvas.clientHeight - LABEL_HEIGHT);
  }

  /** Each label moves down until it covers none above it; those at the lower edge move up again. */
  #placeLabels(): void {
    const shown = this.#markers.filter(({ label }) => !label.hidden).sort((a, b) => a.y - b.y);
    const overlap = (a: Marker, b: Marker) => Math.abs(a.x - b.x) < LABEL_WIDTH;
    shown.forEach((marker, index) => {
      for (const above of shown.slice(0, index)) {
        if (overlap(above, marker)) marker.y = Math.max(marker.y, above.y + LABEL_HEIGHT);
      }
    });
    const bottom = this.#app.view.canvas.clientHeight - LABEL_HEIGHT / 2 - 2;
    for (let index = shown.length - 1; index >= 0; --index) {
      const marker = shown[index]!;
      marker.y = Math.min(marker.y, bottom);
      for (const below of shown.slice(index + 1)) {
        if (overlap(below, marker)) marker.y = Math.min(marker.y, below.y - LABEL_HEIGHT);
      }
      marker.label.style.transform = `translate(${marker.x.toFixed(1)}px, ${marker.y.toFixed(1)}px) translate(10px, -50%)`;
    }
  }
}

function makeKey({ a, b }: ContactEvent): string {
  return `${a} ${b}`;
}

export function isFloor({ kind, normal }: ContactEvent): boolean {
  return kind !== Kind.BLOCKED && (normal?.y ?? 0) < FLOOR_NORMAL;
}

export function describeEvent({ kind, phase, reason }: ContactEvent): string {
  switch (kind) {
    case Kind.BEGIN: return "contact";
    case Kind.END: return reason === Reason.LEFT ? "left" : "parted";
    case Kind.NEAR: return phase === Phase.MIN ? "closest" : phase === Phase.END ? "far again" : "near miss";
    case Kind.BLOCKED: return "blocked";
    case Kind.ENTER: return "enters";
    case Kind.LEAVE: return "leaves";
    case Kind.LEFT_WORLD: return "fell out";
    default: return "event";
  }
}

export function getCssClass({ kind }: ContactEvent): string {
  if (kind === Kind.BEGIN || kind === Kind.BLOCKED) return "touching";
  return kind === Kind.NEAR ? "near" : "plain";
}

function formatDistance(event: ContactEvent): string {
  if (event.kind === Kind.END || event.kind === Kind.ENTER || event.kind === Kind.LEAVE || event.b === 0) return "";
  if (event.verdict === Verdict.PENETRATING) return "penetrates";
  return event.verdict === Verdict.TOUCHING ? "0" : formatLength(event.distance);
}
