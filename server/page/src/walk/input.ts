// Keys, mouse and touch as intentions: a direction of motion, a turn of the view, a pick, and actions.
import { isTyping } from "../panels/dom";

const LOOK_PER_PIXEL = 0.0035; // radians
const CLICK_PIXELS = 5; // a press that moves less is a click
const STICK_PIXELS = 60; // finger travel for full speed

export type Action = "jump" | "crouch" | "fly" | "view" | "leave" | "walk" | "pause";

const ACTIONS: Record<string, Action> = {
  Space: "jump", KeyC: "crouch", KeyF: "fly", KeyV: "view", Escape: "leave", Enter: "walk", KeyP: "pause",
};
const MOVES: Record<string, [number, number, number]> = {
  KeyW: [1, 0, 0], ArrowUp: [1, 0, 0], KeyS: [-1, 0, 0], ArrowDown: [-1, 0, 0],
  KeyD: [0, 1, 0], ArrowRight: [0, 1, 0], KeyA: [0, -1, 0], ArrowLeft: [0, -1, 0],
  KeyE: [0, 0, 1], KeyQ: [0, 0, -1],
};

export class Input {
  onLook: (yaw: number, pitch: number) => void = () => {};
  onClick: (x: number, y: number) => void = () => {}; // pixels of the canvas
  onAction: (action: Action) => void = () => {};
  onMove: () => void = () => {};
  onZoom: (steps: number) => void = () => {};
  #canvas: HTMLCanvasElement;
  #held = new Set<string>();
  #isRunning = false;
  #stick: { id: number; x: number; y: number; forward: number; right: number } | null = null;
  #press: { id: number; x: number; y: number; lastX: number; lastY: number; travel: number } | null = null;

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    canvas.tabIndex = 0;
    canvas.style.touchAction = "none";
    window.addEventListener("keydown", (event) => this.#keyDown(event));
    window.addEventListener("keyup", (event) => this.#keyUp(event));
    window.addEventListener("blur", () => this.release());
    canvas.addEventListener("pointerdown", (event) => this.#pointerDown(event));
    canvas.addEventListener("pointermove", (event) => this.#pointerMove(event));
    for (const end of ["pointerup", "pointercancel"] as const) {
      canvas.addEventListener(end, (event) => this.#pointerUp(event));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.onZoom(Math.sign(event.deltaY));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** The intended motion: forward, right and up in -1..1. */
  get motion(): { forward: number; right: number; up: number; running: boolean } {
    const sum = [this.#stick?.forward ?? 0, this.#stick?.right ?? 0, 0];
    for (const code of this.#held) MOVES[code]!.forEach((part, axis) => (sum[axis]! += part));
    const [forward, right, up] = sum.map((part) => Math.max(-1, Math.min(1, part))) as [number, number, number];
    return { forward, right, up, running: this.#isRunning };
  }

  get isMoving(): boolean {
    const { forward, right, up } = this.motion;
    return forward !== 0 || right !== 0 || up !== 0;
  }

  release(): void {
    this.#held.clear();
    this.#stick = null;
    this.#isRunning = false;
    this.onMove();
  }

  get isLocked(): boolean {
    return document.pointerLockElement === this.#canvas;
  }

  toggleLock(): void {
    if (this.isLocked) document.exitPointerLock();
    else void this.#canvas.requestPointerLock();
  }

  #keyDown(event: KeyboardEvent): void {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    this.#isRunning = event.shiftKey;
    const onControl = event.target instanceof HTMLElement && event.target.closest("button, [role=tree], input, summary, [role=tablist]");
    // Controls keep the keys that operate them; the letters move in every case.
    if (onControl && !event.code.startsWith("Key") && event.code !== "Escape") return;
    if (MOVES[event.code]) {
      event.preventDefault();
      if (!event.repeat) this.#held.add(event.code);
      this.onMove();
      return;
    }
    const action = ACTIONS[event.code];
    if (action && !event.repeat) {
      if (event.code === "Space") event.preventDefault();
      this.onAction(action);
    } else if (event.key === "Shift") this.onMove();
  }

  #keyUp(event: KeyboardEvent): void {
    this.#isRunning = event.shiftKey;
    this.#held.delete(event.code);
    this.onMove();
  }

  #pointerDown(event: PointerEvent): void {
    this.#canvas.focus({ preventScroll: true });
    const isTouch = event.pointerType === "touch";
    if (isTouch && event.offsetX < this.#canvas.clientWidth / 2 && !this.#stick) {
      this.#stick = { id: event.pointerId, x: event.clientX, y: event.clientY, forward: 0, right: 0 };
    }
    if (!this.#press && this.#stick?.id !== event.pointerId || !isTouch) {
      this.#press = { id: event.pointerId, x: event.offsetX, y: event.offsetY, lastX: event.clientX, lastY: event.clientY, travel: 0 };
    }
    if (!this.isLocked) this.#canvas.setPointerCapture(event.pointerId);
  }

  #pointerMove(event: PointerEvent): void {
    const stick = this.#stick;
    if (stick && stick.id === event.pointerId) {
      const clamp = (pixels: number) => Math.max(-1, Math.min(1, pixels / STICK_PIXELS));
      stick.forward = clamp(stick.y - event.clientY);
      stick.right = clamp(event.clientX - stick.x);
      return this.onMove();
    }
    if (this.isLocked) return this.onLook(-event.movementX * LOOK_PER_PIXEL, -event.movementY * LOOK_PER_PIXEL);
    const press = this.#press;
    if (press?.id !== event.pointerId) return;
    // A dragged scene follows the pointer. Not all browsers give the movement of touches.
    const [x, y] = [event.clientX - press.lastX, event.clientY - press.lastY];
    Object.assign(press, { lastX: event.clientX, lastY: event.clientY, travel: press.travel + Math.abs(x) + Math.abs(y) });
    this.onLook(x * LOOK_PER_PIXEL, y * LOOK_PER_PIXEL);
  }

  #pointerUp(event: PointerEvent): void {
    if (this.#stick?.id === event.pointerId) {
      this.#stick = null;
      this.onMove();
    }
    const press = this.#press;
    if (press?.id !== event.pointerId) return;
    this.#press = null;
    if (event.type !== "pointerup" || press.travel > CLICK_PIXELS) return;
    if (this.isLocked) this.onClick(this.#canvas.clientWidth / 2, this.#canvas.clientHeight / 2);
    else this.onClick(press.x, press.y);
  }
}
