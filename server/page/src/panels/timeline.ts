// Time: play, pause, step, speed; for a recording a scrubber with its events, and take over.
import type { App } from "../app";
import { describeEvent, getCssClass, isFloor } from "./contacts";
import { makeButton, makeElement, setText } from "./dom";
import { formatTime, shortenPath } from "./format";
import { Clock_Mode, ContactEvent_Kind as Kind, ContactEvent_Phase as Phase, type ContactEvent } from "../generated/enfilade_pb";
import type { Walk } from "../walk/walk";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 10];
const SEEK_INTERVAL = 60; // milliseconds between seeks while the slider moves
const MARK_PLACES = 400; // of the track

export class Timeline {
  readonly root: HTMLElement;
  #app: App;
  #walk: Walk;
  #play = makeButton("▶", () => this.toggle(), { class: "play", label: "Play or pause" });
  #step = makeButton("▮▶", () => this.#stepOnce(), { label: "One tick", title: "One tick" });
  #speed = makeElement("select", { label: "Speed" },
    ...SPEEDS.map((speed) => makeElement("option", { value: speed }, `${speed}×`)));
  #slider = makeElement("input", { type: "range", min: "0", max: "1", value: "0", step: "1", label: "Tick of the recording" });
  #marks = makeElement("div", { class: "marks" });
  #track = makeElement("div", { class: "track", hidden: true }, this.#slider, this.#marks);
  #readout = makeElement("output", { class: "readout" });
  #takeOver = makeButton("Take over", () => this.#take(), { hidden: true, title: "Leave the recording here, and walk on with the followed avatar" });
  #note = makeElement("span", { class: "quiet" });
  #isScrubbing = false;
  #seeking: number | null = null;
  #wanted: number | null = null;
  #seen = new Set<string>(); // events that have a mark
  #knownTo = 0n; // tick: the recording's own events have their marks up to here
  #marked = new Map<string, { mark: HTMLButtonElement; text: string; others: number }>(); // by place and class

  constructor(app: App, walk: Walk) {
    this.#app = app;
    this.#walk = walk;
    this.#speed.value = "1";
    this.root = makeElement(
      "section", { class: "timeline", label: "Time" },
      this.#play, this.#step, this.#speed, this.#track, this.#readout, this.#takeOver, this.#note,
    );
    this.#speed.addEventListener("change", () => {
      if (app.clock?.mode === Clock_Mode.FREE_RUN) this.#run();
    });
    this.#slider.addEventListener("input", () => this.#scrub());
    this.#slider.addEventListener("change", () => (this.#isScrubbing = false));
    app.timeChanged.listen(() => this.#update());
    app.opened.listen(() => {
      this.#seen.clear();
      this.#marked.clear();
      this.#marks.replaceChildren();
      this.#knownTo = 0n;
      if (app.connection.recordedEvents) {
        this.#mark(app.connection.recordedEvents);
        this.#knownTo = app.replay?.lastTick ?? 0n;
      } else if (app.replay) {
        app.attempt(this.#fetchMarks());
      }
      const speed = app.clock?.speed ?? 0;
      if (speed > 0 && SPEEDS.includes(speed)) this.#speed.value = String(speed);
      this.#update();
    });
    app.contactEvents.listen((events) => this.#mark(events.filter((event) => !app.isPlayback || event.tick > this.#knownTo)));
  }

  toggle(): void {
    const { clock, replay } = this.#app;
    if (clock?.mode === Clock_Mode.FREE_RUN) this.#app.attempt(this.#app.requestClock({ case: "pause", value: {} }));
    else if (replay?.atEnd && !replay.branched) this.#seek(Number(replay.firstTick), true);
    else this.#run();
  }

  #run(): void {
    this.#app.attempt(this.#app.requestClock({ case: "freeRun", value: { speed: Number(this.#speed.value) } }));
  }

  /** One tick needs lockstep; the clock stays there. */
  #stepOnce(): void {
    const step = async () => {
      if (this.#app.clock?.mode !== Clock_Mode.LOCKSTEP) await this.#app.requestClock({ case: "lockstep", value: {} });
      await this.#app.connection.request("step", { ticks: 1 });
    };
    this.#app.attempt(step());
  }

  #scrub(): void {
    this.#isScrubbing = true;
    this.#seek(Number(this.#slider.value), false);
  }

  /** Seeks one at a time; of further wishes only the last one counts. */
  #seek(tick: number, thenRun: boolean): void {
    this.#wanted = tick;
    if (this.#seeking !== null) return;
    const next = async () => {
      while (this.#wanted !== null) {
        this.#seeking = this.#wanted;
        this.#wanted = null;
        await this.#app.connection.request("seek", { tick: BigInt(this.#seeking) });
        await new Promise((resolve) => setTimeout(resolve, SEEK_INTERVAL));
      }
      if (thenRun) this.#run();
    };
    this.#app.attempt(next().finally(() => (this.#seeking = null)));
  }

  goToTick(tick: number): void {
    if (this.#app.replay) this.#seek(tick, false);
  }

  #take(): void {
    const { focus, state } = this.#app;
    const avatar = focus || state.latest?.avatars[0]?.name || "";
    this.#app.attempt(this.#walk.takeOver(avatar));
  }

  #update(): void {
    const { clock, replay, tick, time } = this.#app;
    const isRunning = clock?.mode === Clock_Mode.FREE_RUN;
    setText(this.#play, isRunning ? "❚❚" : "▶");
    this.#play.setAttribute("aria-label", isRunning ? "Pause" : "Play");
    this.#play.title = isRunning ? "Pause (P)" : "Play (P)";
    setText(this.#readout, `${formatTime(time)} · tick ${tick}`);
    this.#track.hidden = !replay;
    this.#takeOver.hidden = !this.#app.isPlayback || this.#app.connection.isFile;
    if (replay) {
      this.#slider.min = String(replay.firstTick);
      this.#slider.max = String(replay.lastTick);
      if (!this.#isScrubbing && this.#seeking === null) this.#slider.value = String(tick);
      this.#slider.setAttribute("aria-valuetext", `${formatTime(time)}, tick ${tick}`);
    }
    setText(this.#note, this.#describeNote(isRunning));
    for (const control of [this.#play, this.#step, this.#speed]) control.disabled = !this.#app.mayDrive;
  }

  #describeNote(isRunning: boolean): string {
    const { clock, replay } = this.#app;
    if (replay?.diverged) return `The replay differs from the recording: ${replay.diverged}`;
    if (replay?.branched) return `left the recording at tick ${replay.branchedAt}`;
    if (replay?.atEnd) return "end of the recording";
    if (!this.#app.mayDrive) return "this token may only observe";
    if (clock?.mode === Clock_Mode.LOCKSTEP && !isRunning) return clock.hasDriver ? "a client steps the clock" : "the clock stands still";
    return clock?.mode === Clock_Mode.PAUSED ? "paused" : "";
  }

  /**
   * Marks on the track of a recording. Near ones share a mark. While the recording plays, events that it has are
   * not marked again: a seek ends the near misses of the moment with minima that the recording does not have.
   */
  #mark(events: ContactEvent[]): void {
    const { replay } = this.#app;
    if (!replay) return;
    const first = Number(replay.firstTick);
    const span = Math.max(1, Number(replay.lastTick) - first);
    for (const event of events) {
      const isShown = event.kind === Kind.BEGIN && !isFloor(event) || event.kind === Kind.BLOCKED || (event.kind === Kind.NEAR && event.phase === Phase.MIN) || event.kind === Kind.ENTER;
      const key = `${event.tick} ${event.kind} ${event.phase} ${event.a} ${event.b}`;
      if (!isShown || this.#seen.has(key)) continue;
      this.#seen.add(key);
      const place = Math.round((MARK_PLACES * (Number(event.tick) - first)) / span);
      const text = `${formatTime(event.time)} ${describeEvent(event)}: ${shortenPath(event.aName)} – ${shortenPath(event.bName)}`;
      const shared = this.#marked.get(`${place} ${getCssClass(event)}`);
      if (shared) {
        shared.others += 1;
        shared.mark.title = `${shared.text}, and ${shared.others} more`;
        continue;
      }
      const mark = makeButton("", () => this.#seek(Number(event.tick), false), { class: `mark ${getCssClass(event)}`, tabindex: "-1", title: text });
      mark.style.left = `${(100 * place) / MARK_PLACES}%`;
      this.#marks.append(mark);
      this.#marked.set(`${place} ${getCssClass(event)}`, { mark, text, others: 0 });
    }
  }

  /** Marks the events of the recording that the server plays. */
  async #fetchMarks(): Promise<void> {
    const { connection } = this.#app;
    const lastTick = this.#app.replay?.lastTick ?? 0n;
    let after = 0n;
    for (;;) {
      const reply = await connection.request("recordedEvents", { afterTick: after });
      this.#mark(reply.contacts);
      this.#knownTo = reply.completeTo;
      if (reply.completeTo >= lastTick || reply.completeTo <= after) return;
      after = reply.completeTo;
    }
  }

  /** Events that have a mark. */
  get markedEvents(): number {
    return this.#seen.size;
  }
}
