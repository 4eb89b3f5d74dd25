// The plan of the storey: the scene from above, cut above the floor of the avatar or camera. Walls that are cut are
// dark, because the inner sides of their triangles are visible there. A click walks there.
import { DoubleSide, OrthographicCamera, ShaderMaterial, Vector3 } from "three";
import type { App } from "../app";
import { findCssColor } from "../view/avatars";
import type { CameraRig } from "../view/camera_rig";
import { makeButton, makeElement } from "./dom";
import { VERTEX_BODY, VERTEX_HEAD } from "../view/entity_material";
import { renderOffscreen } from "../view/offscreen";
import type { Walk } from "../walk/walk";
import { toVector } from "../world/world_state";

const CUT_HEIGHT = 1.2; // metres above the floor
const CUT_DEPTH = 2.2; // metres below the cut that are drawn
const NEW_FLOOR = 0.6; // metres of height after which another storey is drawn
const PIXELS = 1536; // of the rendered plan
const MAX_EXTENT = 90; // metres of the rendered plan
const TRAIL_STEP = 0.15; // metres between points of a path
const MAX_TRAIL = 4000; // points

const PLAN_VERTEX = `${VERTEX_HEAD}
varying vec3 planNormal;
varying float planDepth;
void main() {
  vec4 p = vec4(position, 1.0);
  vec3 n = normal;
  #ifdef USE_INSTANCING
    p = instanceMatrix * p;
    n = mat3(instanceMatrix) * n;
  #endif
  planNormal = mat3(modelMatrix) * n;
  gl_Position = projectionMatrix * modelViewMatrix * p;
  planDepth = 0.5 * gl_Position.z + 0.5;
${VERTEX_BODY}}
`;
const PLAN_FRAGMENT = `
varying vec3 planNormal;
varying float planDepth;
void main() {
  float up = abs(normalize(planNormal).y);
  // Furniture is darker than the floor: the more, the higher it is.
  float low = smoothstep(0.0, ${(CUT_HEIGHT / CUT_DEPTH).toFixed(3)}, planDepth);
  vec3 top = mix(vec3(0.66, 0.71, 0.76), vec3(0.94, 0.955, 0.97), low);
  gl_FragColor = gl_FrontFacing ? vec4(mix(vec3(0.55, 0.6, 0.65), top, smoothstep(0.2, 0.9, up)), 1.0)
                                : vec4(0.16, 0.22, 0.28, 1.0);
  // The bottom of a wall lies on the floor: a few millimetres decide for the wall.
  gl_FragDepth = gl_FragCoord.z - (gl_FrontFacing ? 0.0 : 0.002);
}
`;

export class Minimap {
  readonly root: HTMLElement;
  #app: App;
  #rig: CameraRig;
  #walk: Walk;
  #canvas = makeElement("canvas", { tabindex: "0", role: "img", label: "Plan of the storey with avatars. A click walks there." });
  #plan = document.createElement("canvas");
  #planCenter = new Vector3();
  #planExtent = 0; // metres
  #floor = NaN;
  #metresWide = 24;
  #trails = new Map<string, Vector3[]>();
  #target: Vector3 | null = null;
  #planAge = 0;

  constructor(app: App, rig: CameraRig, walk: Walk) {
    this.#app = app;
    this.#rig = rig;
    this.#walk = walk;
    this.root = makeElement(
      "section", { class: "minimap", label: "Plan" }, this.#canvas,
      makeElement("div", { class: "zoom" },
        makeButton("+", () => this.#zoom(-1), { label: "Enlarge the plan" }), makeButton("−", () => this.#zoom(1), { label: "Reduce the plan" })),
    );
    this.#canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.#zoom(Math.sign(event.deltaY));
    }, { passive: false });
    this.#canvas.addEventListener("click", (event) => this.#click(event));
    app.sceneLoaded.listen(() => {
      this.#floor = NaN;
      this.#trails.clear();
    });
    app.visibilityChanged.listen(() => (this.#floor = NaN));
    app.stateArrived.listen(() => this.#remember());
    setInterval(() => this.#draw(), 50);
  }

  #zoom(steps: number): void {
    this.#metresWide = Math.max(5, Math.min(MAX_EXTENT, this.#metresWide * 1.3 ** steps));
  }

  #remember(): void {
    for (const { name, feet } of this.#app.state.latest?.avatars ?? []) {
      const place = toVector(feet);
      const trail = this.#trails.get(name) ?? [];
      this.#trails.set(name, trail);
      const last = trail.at(-1);
      if (last && last.distanceTo(place) < TRAIL_STEP) continue;
      trail.push(place);
      if (trail.length > MAX_TRAIL) trail.shift();
    }
  }

  /** The place in the middle of the plan: the focused avatar's feet, or the floor below the camera. */
  #findMiddle(): { at: Vector3; floor: number } | null {
    const avatar = this.#app.state.findAvatar(this.#app.focus);
    if (avatar) return { at: avatar.feet, floor: avatar.state.grounded || Number.isNaN(this.#floor) ? avatar.feet.y : this.#floor };
    const { position } = this.#rig;
    const hit = this.#app.model?.raycast(position, new Vector3(0, -1, 0), 60);
    return { at: position, floor: hit ? hit.point.y : position.y - 1.6 };
  }

  #draw(): void {
    const { model } = this.#app;
    const middle = model && this.root.offsetParent !== null && !document.hidden ? this.#findMiddle() : null;
    if (!middle || !model) return;
    const { at, floor } = middle;
    const isFar = Math.max(Math.abs(at.x - this.#planCenter.x), Math.abs(at.z - this.#planCenter.z)) > this.#planExtent / 2 - this.#metresWide / 2;
    const size = model.bounds.getSize(new Vector3());
    const isCovering = this.#planExtent >= Math.max(size.x, size.z);
    const isNew = !(Math.abs(floor - this.#floor) < NEW_FLOOR) || isFar && !isCovering;
    if (isNew && ++this.#planAge > 4) {
      this.#planAge = 0;
      this.#renderPlan(at, floor);
    }
    if (!isNew) this.#planAge = 0;
    this.#paint(at);
  }

  #renderPlan(at: Vector3, floor: number): void {
    const { model, view } = this.#app;
    const size = model!.bounds.getSize(new Vector3());
    this.#floor = floor;
    this.#planExtent = Math.min(MAX_EXTENT, 1.02 * Math.max(size.x, size.z, 10));
    this.#planCenter.copy(size.x <= this.#planExtent && size.z <= this.#planExtent ? model!.bounds.getCenter(new Vector3()) : at);
    const half = this.#planExtent / 2;
    const camera = new OrthographicCamera(-half, half, half, -half, 0, CUT_DEPTH);
    camera.position.set(this.#planCenter.x, floor + CUT_HEIGHT, this.#planCenter.z);
    camera.up.set(0, 0, -1);
    camera.lookAt(this.#planCenter.x, floor, this.#planCenter.z);
    const material = new ShaderMaterial({
      vertexShader: PLAN_VERTEX, fragmentShader: PLAN_FRAGMENT, side: DoubleSide,
      uniforms: { entityFlags: { value: model!.flags.texture } },
    });
    const pixels = renderOffscreen(view.renderer, model!.root, camera, material, PIXELS, PIXELS);
    material.dispose();
    this.#plan.width = this.#plan.height = PIXELS;
    this.#plan.getContext("2d")!.putImageData(new ImageData(pixels, PIXELS, PIXELS), 0, 0);
  }

  #paint(at: Vector3): void {
    const canvas = this.#canvas;
    const ratio = Math.min(2, window.devicePixelRatio);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d")!;
    const scale = width / this.#metresWide; // pixels per metre
    const x = (v: Vector3) => width / 2 + (v.x - at.x) * scale;
    const y = (v: Vector3) => height / 2 + (v.z - at.z) * scale;
    context.fillStyle = "#f4f6f8";
    context.fillRect(0, 0, width, height);
    const corner = this.#planCenter.clone().addScalar(-this.#planExtent / 2);
    const side = this.#planExtent * scale;
    if (this.#plan.width === PIXELS) context.drawImage(this.#plan, x(corner), y(corner), side, side);
    this.#paintTrails(context, x, y, ratio);
    if (this.#target) {
      context.strokeStyle = "#1f5fa8";
      context.lineWidth = 2 * ratio;
      context.beginPath();
      context.arc(x(this.#target), y(this.#target), 5 * ratio, 0, 7);
      context.stroke();
    }
    this.#paintAvatars(context, x, y, ratio);
  }

  #paintTrails(context: CanvasRenderingContext2D, x: (v: Vector3) => number, y: (v: Vector3) => number, ratio: number): void {
    const ids = new Map(this.#app.state.latest?.avatars.map(({ id, name }) => [name, id]));
    context.lineWidth = 1.5 * ratio;
    for (const [name, trail] of this.#trails) {
      const id = ids.get(name);
      if (id === undefined) continue;
      context.strokeStyle = findCssColor(id);
      context.globalAlpha = 0.55;
      context.beginPath();
      let last: Vector3 | null = null;
      for (const place of trail) {
        const isHere = Math.abs(place.y - this.#floor) < 1.5;
        if (isHere && last && last.distanceTo(place) < 2) context.lineTo(x(place), y(place));
        else context.moveTo(x(place), y(place));
        last = isHere ? place : null;
      }
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  #paintAvatars(context: CanvasRenderingContext2D, x: (v: Vector3) => number, y: (v: Vector3) => number, ratio: number): void {
    for (const { state, feet, gaze } of this.#app.state.getAvatars()) {
      const isFocus = state.name === this.#app.focus;
      const direction = isFocus && this.#rig.mode === "first" ? this.#rig.forward : gaze;
      drawArrow(context, x(feet), y(feet), Math.atan2(direction.z, direction.x), findCssColor(state.id), (isFocus ? 9 : 7) * ratio,
        Math.abs(feet.y - this.#floor) < 1.5 ? 1 : 0.35);
    }
    if (this.#rig.mode !== "free") return;
    const { position, forward } = this.#rig;
    drawArrow(context, x(position), y(position), Math.atan2(forward.z, forward.x), "#38454f", 8 * ratio, 0.8);
  }

  #click(event: MouseEvent): void {
    const middle = this.#findMiddle();
    if (!middle) return;
    const scale = this.#canvas.clientWidth / this.#metresWide;
    const place = new Vector3(
      middle.at.x + (event.offsetX - this.#canvas.clientWidth / 2) / scale, middle.floor,
      middle.at.z + (event.offsetY - this.#canvas.clientHeight / 2) / scale,
    );
    if (this.#walk.isWalking) {
      this.#target = place;
      this.#app.attempt(this.#walk.walkTo(place).finally(() => {
        if (this.#target === place) this.#target = null;
      }));
    } else if (this.#walk.canWalk) void this.#walk.start(place);
    else this.#rig.flyTo(place.setY(middle.floor + 1.6), place.clone().add(this.#rig.forward.setY(0)));
  }
}

function drawArrow(context: CanvasRenderingContext2D, x: number, y: number, angle: number, color: string, size: number, alpha: number): void {
  context.save();
  context.translate(x, y);
  context.rotate(angle);
  context.globalAlpha = alpha;
  context.beginPath();
  context.moveTo(size, 0);
  context.lineTo(-0.75 * size, 0.7 * size);
  context.lineTo(-0.4 * size, 0);
  context.lineTo(-0.75 * size, -0.7 * size);
  context.closePath();
  context.fillStyle = color;
  context.fill();
  context.lineWidth = size / 6;
  context.strokeStyle = "#fff";
  context.stroke();
  context.restore();
}
