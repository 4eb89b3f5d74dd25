// A recording in the page's own file: it answers the requests of the page as a server that plays the recording does.
import { create, fromBinary } from "@bufbuild/protobuf";
import {
  Clock_Mode, ClockSchema, ContactEvent_Kind as Kind, ContactEvent_Reason as Reason, ContactEventSchema,
  EntityNamesSchema, PairStateSchema, ReplaySchema, SeekReplySchema, ServerMessageSchema, SetClockReplySchema,
  StateSchema, StepReplySchema, SubscribeReplySchema, TouchingReplySchema, type ContactEvent, type State,
  type TickEvents, type Welcome,
} from "../generated/enfilade_pb";
import type { CommandFields, Listener, ReplyOf, RequestFields, RequestName, WorldSource } from "./source";

const LENGTHS = 8; // bytes before a message: total, header_length
const INTERVAL = 16; // milliseconds between steps of playback
const MAX_CATCH_UP = 0.25; // seconds: a page in the background does not catch up

/** Messages of a server, as on the wire: Welcome first, then events and one state per tick, in order. */
export function splitMessages(bytes: Uint8Array): Uint8Array[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const messages: Uint8Array[] = [];
  for (let at = 0; at + LENGTHS <= bytes.length;) {
    const total = view.getUint32(at, true);
    const header = view.getUint32(at + 4, true);
    messages.push(bytes.subarray(at + LENGTHS, at + LENGTHS + header));
    at += 4 + total;
  }
  return messages;
}

export class RecordedWorld implements WorldSource {
  token = "";
  readonly world = "";
  readonly isFile = true;
  readonly recordedEvents: ContactEvent[] = [];
  #listener: Listener;
  #fetch: () => Promise<ArrayBuffer>;
  #welcome: Welcome;
  #states: { tick: number; message: Uint8Array }[] = []; // decoded when they are shown
  #events: TickEvents[] = [];
  #tick: number;
  #first: number;
  #last: number;
  #isOpen = false;
  #mode = Clock_Mode.PAUSED;
  #speed = 1;
  #timer = 0;
  #shownAt = 0; // milliseconds of wall clock at the last step of playback
  #owed = 0; // ticks that are due, a fraction

  constructor(listener: Listener, messages: Uint8Array[], fetchScene: () => Promise<ArrayBuffer>) {
    this.#listener = listener;
    this.#fetch = fetchScene;
    let welcome: Welcome | null = null;
    for (const message of messages) {
      const { body } = fromBinary(ServerMessageSchema, message);
      if (body.case === "welcome") welcome = body.value;
      else if (body.case === "state") this.#states.push({ tick: Number(body.value.tick), message });
      else if (body.case === "events") this.#addEvents(body.value);
    }
    if (!welcome?.replay) throw new Error("The file is damaged: it does not begin with the recording's scene.");
    this.#welcome = welcome;
    this.#first = Number(welcome.replay.firstTick);
    this.#last = Number(welcome.replay.lastTick);
    this.#tick = this.#first;
  }

  #addEvents(events: TickEvents): void {
    this.#events.push(events);
    this.recordedEvents.push(...events.contacts);
  }

  get isOpen(): boolean {
    return this.#isOpen;
  }

  async open(): Promise<void> {
    this.#isOpen = true;
    this.#listener.opened(this.#welcome);
  }

  fetchScene(): Promise<ArrayBuffer> {
    return this.#fetch();
  }

  command(_avatar: string, _order: CommandFields["order"]): Promise<ReplyOf<"command">> {
    return Promise.reject(new Error("This is a recording in a file: its avatars cannot be commanded."));
  }

  async request<K extends RequestName>(name: K, fields: RequestFields<K>): Promise<ReplyOf<K>> {
    return this.#answer(name, fields) as ReplyOf<K>;
  }

  #answer(name: RequestName, fields: unknown): unknown {
    switch (name) {
      case "subscribe":
        queueMicrotask(() => this.#sendState());
        return create(SubscribeReplySchema, { live: this.#findLive(this.#tick) });
      case "describe":
        return create(EntityNamesSchema, {});
      case "setClock":
        this.#setClock((fields as RequestFields<"setClock">).mode!);
        return create(SetClockReplySchema, { clock: this.#makeClock(), tick: BigInt(this.#tick) });
      case "step":
        this.#advance((fields as RequestFields<"step">).ticks ?? 1);
        return create(StepReplySchema, { tick: BigInt(this.#tick) });
      case "seek":
        this.#seek(Number((fields as RequestFields<"seek">).tick));
        return create(SeekReplySchema, { tick: BigInt(this.#tick) });
      case "touching":
        return create(TouchingReplySchema, { found: this.#findTouching(fields as RequestFields<"touching">) });
      default:
        throw new Error("This is a recording in a file: it can only be watched.");
    }
  }

  // ---- the clock -------------------------------------------------------------------------------

  #makeClock() {
    return create(ClockSchema, { mode: this.#mode, speed: this.#speed });
  }

  #setClock(mode: NonNullable<RequestFields<"setClock">["mode"]>): void {
    clearInterval(this.#timer);
    this.#mode = mode.case === "freeRun" ? Clock_Mode.FREE_RUN : mode.case === "lockstep" ? Clock_Mode.LOCKSTEP : Clock_Mode.PAUSED;
    if (mode.case !== "freeRun") return;
    this.#speed = mode.value?.speed || 1;
    this.#shownAt = performance.now();
    this.#owed = 0;
    this.#timer = window.setInterval(() => this.#play(), INTERVAL);
  }

  #play(): void {
    const now = performance.now();
    const seconds = Math.min(MAX_CATCH_UP, (now - this.#shownAt) / 1000) * this.#speed;
    this.#shownAt = now;
    this.#owed += seconds / (this.#welcome.policies?.tick || 1 / 60);
    const ticks = Math.floor(this.#owed);
    this.#owed -= ticks;
    if (ticks > 0) this.#advance(ticks);
  }

  #advance(ticks: number): void {
    const from = this.#tick;
    this.#tick = Math.min(this.#last, from + ticks);
    for (const events of this.#events) {
      if (Number(events.tick) > from && Number(events.tick) <= this.#tick) this.#listener.events(events);
    }
    this.#sendState();
    if (this.#tick < this.#last) return;
    clearInterval(this.#timer);
    if (this.#mode === Clock_Mode.FREE_RUN) this.#mode = Clock_Mode.PAUSED;
    this.#sendReplay();
  }

  #seek(tick: number): void {
    const ended = this.#findLive(this.#tick).map((contact) => create(ContactEventSchema, { ...contact, kind: Kind.END, reason: Reason.SEEK }));
    this.#tick = Math.max(this.#first, Math.min(this.#last, tick));
    const events = { tick: BigInt(this.#tick), time: 0, sequence: 0n, notices: [], horizons: [] };
    this.#listener.events({ ...events, contacts: [...ended, ...this.#findLive(this.#tick)] } as unknown as TickEvents);
    this.#sendState();
    this.#sendReplay();
  }

  #sendState(): void {
    this.#listener.state(this.#findState(this.#tick));
  }

  #sendReplay(): void {
    this.#listener.replay(create(ReplaySchema, {
      ...this.#welcome.replay!, tick: BigInt(this.#tick), atEnd: this.#tick === this.#last, clock: this.#makeClock(),
    }));
  }

  // ---- the recording ---------------------------------------------------------------------------

  /** The state of a tick; the first one, and ticks that the recording lacks, have no avatars. */
  #findState(tick: number): State {
    let low = 0;
    let high = this.#states.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#states[middle]!.tick < tick) low = middle + 1;
      else high = middle;
    }
    const found = this.#states[low];
    if (found?.tick === tick) {
      const { body } = fromBinary(ServerMessageSchema, found.message);
      if (body.case === "state") return body.value;
    }
    return create(StateSchema, { tick: BigInt(tick), time: tick * (this.#welcome.policies?.tick ?? 0) });
  }

  /** Contacts that are active after a tick, as begin events. */
  #findLive(tick: number): ContactEvent[] {
    const live = new Map<string, ContactEvent>();
    for (const events of this.#events) {
      if (Number(events.tick) > tick) break;
      for (const event of events.contacts) {
        if (event.kind === Kind.BEGIN) live.set(`${event.a} ${event.b}`, event);
        if (event.kind === Kind.END) live.delete(`${event.a} ${event.b}`);
      }
    }
    return [...live.values()];
  }

  /** The recorded contacts of an entity. Distances between recorded events are not known. */
  #findTouching(query: RequestFields<"touching">) {
    const by = query.entity?.by;
    const id = by?.case === "id" ? by.value : 0;
    return this.#findLive(this.#tick).filter(({ a, b }) => a === id || b === id).map((event) => {
      const isFirst = event.a === id;
      const { verdict, distance, pointA, pointB, normal } = event;
      return create(PairStateSchema, {
        a: id, b: isFirst ? event.b : event.a, aName: isFirst ? event.aName : event.bName, bName: isFirst ? event.bName : event.aName,
        verdict, distance, pointA: isFirst ? pointA : pointB, pointB: isFirst ? pointB : pointA,
        normal: isFirst || !normal ? normal : { x: -normal.x, y: -normal.y, z: -normal.z },
      });
    });
  }
}
