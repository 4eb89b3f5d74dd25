// The page's own avatar: its spawn, and the orders that keys and the minimap give.
import { Vector3 } from "three";
import type { App } from "../app";
import type { CameraRig } from "../view/camera_rig";
import { Clock_Mode, Notice_Kind, type Notice } from "../generated/enfilade_pb";
import type { Action, Input } from "./input";
import { proposeStarts, type StartPlace } from "./start_place";
import { toPlain, toVector } from "../world/world_state";

const WALK_SPEED = 1.4; // metres per second, as the server's default
const RUN_SPEED = 3.5;
const FLY_FACTOR = 2;
const CROUCHED = 1.2; // metres
const MAX_SPAWNS = 20;
const SPAWN_SECONDS = 5; // without a notice by then, no tick runs
const ORDER_SECONDS = 2; // a queued order without a notice by then no longer holds back the keys
const SNAP_DISTANCE = 1; // metres from a place on the plan to where there is room
const DRIVE_INTERVAL = 0.05; // seconds between changes of a driven direction

export class Walk {
  name = `visitor-${Math.random().toString(36).slice(2, 6).padEnd(4, "0")}`;
  isWalking = false;
  isFlying = false;
  isCrouched = false;
  onChanged: () => void = () => {};
  #app: App;
  #input: Input;
  #rig: CameraRig;
  #tag = 0n;
  #waiting = new Map<bigint, (notice: Notice) => void>();
  #driven = new Vector3(); // the last sent velocity
  #drivenAt = 0;
  #isDriving = false; // a Drive has acted since the last walk order
  #pendingOrders = 0; // queued orders that a Drive would drop
  #isStarting = false;
  #resume: StartPlace | null = null; // after a reconnection

  constructor(app: App, input: Input, rig: CameraRig) {
    this.#app = app;
    this.#input = input;
    this.#rig = rig;
    input.onMove = () => {
      app.view.invalidate();
      this.#drive();
    };
    app.noticed.listen((notice) => this.#take(notice));
    app.troubled.listen(() => this.#disconnected());
    app.opened.listen(() => {
      if (this.#resume && !app.isPlayback) void this.start(this.#resume.feet, this.#resume.facing);
    });
    app.view.updaters.push(() => {
      this.#drive();
      return this.isWalking && input.isMoving;
    });
  }

  /** Spawns the avatar: at `feet`, or near `feet` if it does not fit there, or in the middle of the scene. */
  async start(feet: Vector3 | null = null, facing: Vector3 | null = null): Promise<void> {
    const { model } = this.#app;
    if (this.isWalking || this.#isStarting || !model) return;
    if (!this.#app.mayDrive) return this.#app.say("This token may only observe.");
    if (this.#app.isPlayback) return this.#app.say("The recording is playing: take an avatar over first.");
    this.#isStarting = true;
    this.onChanged();
    try {
      await this.#runClock();
      const exact = feet ? [{ feet, facing: facing ?? this.#rig.forward }] : [];
      const around = feet ? feet.clone().add(new Vector3(0, 1, 0)) : null;
      const places = [...exact, ...proposeStarts(model, around), ...(around ? proposeStarts(model, null) : [])];
      await this.#spawnAtOne(places.slice(0, MAX_SPAWNS));
    } catch (error) {
      this.#app.say((error as Error).message);
    } finally {
      this.#isStarting = false;
      this.onChanged();
    }
  }

  get isStarting(): boolean {
    return this.#isStarting;
  }

  /** An avatar moves only while ticks run. A clock without a driver is set going. */
  async #runClock(): Promise<void> {
    const { clock } = this.#app;
    if (!clock || clock.hasDriver || clock.mode === Clock_Mode.FREE_RUN) return;
    await this.#app.requestClock({ case: "freeRun", value: { speed: 1 } });
  }

  async #spawnAtOne(places: StartPlace[]): Promise<void> {
    let refusal = "No free place was found in this scene. Click a floor, then choose “Walk from here”.";
    for (const { feet, facing } of places) {
      const degrees = (Math.atan2(-facing.z, facing.x) * 180) / Math.PI;
      const notice = await this.#order({ case: "spawn", value: { at: toPlain(feet), facing: degrees } }, SPAWN_SECONDS);
      if (!notice) throw new Error("No tick runs, so no avatar can enter: start the clock with ▶.");
      if (notice.kind === Notice_Kind.SPAWNED) return this.#entered(facing);
      refusal = `There is no room at that place: ${notice.text}`;
    }
    throw new Error(refusal);
  }

  #entered(facing: Vector3): void {
    this.isWalking = true;
    this.isFlying = this.isCrouched = this.#isDriving = false;
    this.#driven.set(0, 0, 0);
    this.#rig.lookAlong(facing);
    this.#rig.setMode("first");
    this.#app.own = this.name;
    this.#app.setFocus(this.name);
    this.#app.view.canvas.focus({ preventScroll: true });
    this.onChanged();
  }

  leave(): void {
    if (!this.isWalking) return;
    this.#app.attempt(this.#app.connection.command(this.name, { case: "leave", value: {} }));
  }

  #left(): void {
    this.isWalking = false;
    this.#resume = null;
    this.#app.own = "";
    if (this.#app.focus === this.name) this.#app.setFocus("");
    this.#rig.setMode("free");
    this.onChanged();
  }

  #disconnected(): void {
    const state = this.#app.avatarState(this.name);
    if (this.isWalking && state) this.#resume = { feet: toVector(state.feet), facing: this.#rig.forward.setY(0) };
    this.isWalking = false;
    this.#waiting.clear();
    this.#pendingOrders = 0;
    this.#app.own = "";
    this.#rig.setMode("free");
    this.#app.setFocus("");
    this.onChanged();
  }

  act(action: Action): void {
    if (!this.isWalking) return;
    const height = this.#app.avatarState(this.name)?.height ?? 0;
    if (action === "jump" && !this.isFlying) this.#queue({ case: "jump", value: { velocity: toPlain(this.#computeVelocity()) } });
    if (action === "fly") {
      void this.#queue({ case: "fly", value: { on: !this.isFlying } }).then((done) => {
        if (done) this.isFlying = !this.isFlying;
        this.onChanged();
      });
    }
    if (action === "crouch" && height > 0) {
      const value = this.isCrouched ? {} : { height: Math.min(CROUCHED, 0.9 * height) };
      void this.#queue({ case: "crouch", value }).then((done) => {
        if (done) this.isCrouched = !this.isCrouched;
        this.onChanged();
      });
    }
  }

  /** Walks to a place along a path that the server finds, until a key is pressed. */
  async walkTo(place: Vector3): Promise<void> {
    if (!this.isWalking) return;
    const facing = place.clone().sub(this.#rig.position).setY(0);
    if (this.#rig.mode === "first" && facing.lengthSq() > 0.01) this.#rig.lookAlong(facing);
    // The end of the keys' drive lets the queue run.
    if (this.#isDriving) await this.#app.connection.command(this.name, { case: "drive", value: { velocity: {} } });
    this.#isDriving = false;
    this.#driven.set(0, 0, 0);
    const notice = await this.#goTo(place);
    if (notice?.kind === Notice_Kind.BLOCKED) this.#app.say(`Stopped by ${notice.obstacleName || "an obstacle"}.`);
    if (notice?.kind === Notice_Kind.REFUSED) this.#app.say(notice.text);
  }

  /** Orders a path to the closest place where the avatar has room; without one, says so and orders a straight walk. */
  async #goTo(place: Vector3): Promise<Notice | null> {
    const point = toPlain(place);
    try {
      const query = { case: "snap" as const, value: { points: [point], maxDistance: SNAP_DISTANCE } };
      const [spot] = (await this.#app.connection.request("navigation", { query, progress: true })).spots;
      const to = { by: { case: "point" as const, value: spot?.found && spot.at ? spot.at : point } };
      return await this.#order({ case: "go", value: { to } }, 600);
    } catch (error) {
      this.#app.say(`${error instanceof Error ? error.message : error} Walking straight ahead.`);
      return this.#order({ case: "walk", value: { along: [point] } }, 600);
    }
  }

  /** The velocity that the held keys ask for. */
  #computeVelocity(): Vector3 {
    const { forward, right, up, running } = this.#input.motion;
    const ahead = this.isFlying ? this.#rig.forward : this.#rig.forward.setY(0).normalize();
    const velocity = ahead.multiplyScalar(forward).addScaledVector(this.#rig.right, right);
    if (this.isFlying) velocity.y += up;
    const limit = this.#app.welcome?.policies?.speedLimit ?? RUN_SPEED;
    const speed = (running ? RUN_SPEED : WALK_SPEED) * (this.isFlying ? FLY_FACTOR : this.isCrouched ? 0.6 : 1);
    return velocity.clampLength(0, 1).multiplyScalar(Math.min(speed, limit));
  }

  #drive(): void {
    if (!this.isWalking || this.#pendingOrders > 0) return;
    const velocity = this.#computeVelocity();
    if (velocity.distanceTo(this.#driven) < 0.005) return;
    const now = performance.now() / 1000;
    // A start or a stop is sent at once; turns of the view at most twenty times a second.
    const isTurn = velocity.lengthSq() > 0 && this.#driven.lengthSq() > 0;
    if (isTurn && now - this.#drivenAt < DRIVE_INTERVAL) return;
    this.#drivenAt = now;
    this.#driven.copy(velocity);
    this.#isDriving = true;
    this.#app.attempt(this.#app.connection.command(this.name, { case: "drive", value: { velocity: toPlain(velocity) } }));
  }

  /** Gives a short order; the keys wait for its end, because a Drive would drop it. True: it was carried out. */
  async #queue(order: Parameters<App["connection"]["command"]>[1]): Promise<boolean> {
    ++this.#pendingOrders;
    try {
      const notice = await this.#order(order, ORDER_SECONDS);
      if (notice?.kind === Notice_Kind.REFUSED) this.#app.say(notice.text);
      return notice?.kind === Notice_Kind.DONE;
    } catch (error) {
      this.#app.say((error as Error).message);
      return false;
    } finally {
      this.#pendingOrders = Math.max(0, this.#pendingOrders - 1);
      this.#driven.set(NaN, 0, 0); // send the keys' state again
      this.#drive();
    }
  }

  /** Sends an order and resolves to the notice of its outcome; null: none came in time. */
  async #order(order: Parameters<App["connection"]["command"]>[1], seconds: number): Promise<Notice | null> {
    const tag = ++this.#tag;
    const outcome = new Promise<Notice | null>((resolve) => {
      const timer = setTimeout(() => resolve(null), seconds * 1000);
      this.#waiting.set(tag, (notice) => {
        clearTimeout(timer);
        resolve(notice);
      });
    });
    try {
      await this.#app.connection.command(this.name, order, tag);
      return await outcome;
    } finally {
      this.#waiting.delete(tag);
    }
  }

  #take(notice: Notice): void {
    if (notice.avatar !== this.name) return;
    this.#waiting.get(notice.tag)?.(notice);
    if (notice.kind === Notice_Kind.LEFT && this.isWalking) this.#left();
  }

  /** Makes an avatar of a recording the page's own. */
  async takeOver(avatar: string): Promise<void> {
    await this.#app.connection.request("takeOver", { avatar });
    if (!avatar) return;
    this.name = avatar;
    const state = this.#app.avatarState(avatar);
    await this.#runClock();
    this.#entered(state ? toVector(state.gaze) : this.#rig.forward);
    this.isFlying = state?.flying ?? false;
  }

  get canWalk(): boolean {
    return this.#app.mayDrive && !this.#app.isPlayback;
  }
}
