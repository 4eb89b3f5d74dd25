// The state that the parts of the page share, and the news by which they learn of changes.
import { EntityTable } from "./world/entities";
import {
  Role, type AvatarState, type Clock, type ContactEvent, type NavigationProgress, type Notice, type Replay, type State,
  type TickEvents, type Welcome,
} from "./generated/enfilade_pb";
import { SceneModel } from "./view/scene";
import { parseScene, readEntities } from "./world/scene_file";
import { Signal } from "./signal";
import type { MakeSource, RequestFields, Trouble, WorldSource } from "./world/source";
import { View } from "./view/view";
import { WorldState } from "./world/world_state";

export class App {
  readonly view = new View();
  readonly connection: WorldSource;
  readonly state = new WorldState();
  table = new EntityTable();
  model: SceneModel | null = null;
  welcome: Welcome | null = null;
  clock: Clock | null = null;
  replay: Replay | null = null;
  tick = 0;
  time = 0; // seconds
  selection = 0; // entity id; 0: none
  /** The avatar whose place the page shows: its own or a followed one; empty: none. */
  focus = "";
  own = ""; // name of the page's own avatar, if it is in the world

  readonly opened = new Signal<Welcome>();
  readonly troubled = new Signal<Trouble>();
  readonly loading = new Signal<string>();
  readonly sceneLoaded = new Signal<SceneModel>();
  readonly stateArrived = new Signal<State>();
  readonly contactEvents = new Signal<ContactEvent[]>();
  readonly contactsReset = new Signal<ContactEvent[]>();
  readonly noticed = new Signal<Notice>();
  readonly timeChanged = new Signal();
  readonly selected = new Signal<number>();
  readonly focused = new Signal<string>();
  readonly visibilityChanged = new Signal();
  readonly said = new Signal<string>();
  #sceneHash = 0n;
  #preparing = 0n; // the request for whose meshes the user waits

  constructor(makeSource: MakeSource) {
    this.connection = makeSource({
      opened: (welcome) => void this.#begin(welcome),
      troubled: (trouble) => this.troubled.emit(trouble),
      events: (events) => this.#takeEvents(events),
      state: (state) => this.#takeState(state),
      replay: (replay) => this.#takeReplay(replay),
      clock: ({ clock, tick }) => this.setClock(clock, Number(tick)),
      navigationProgress: (progress) => this.#takeProgress(progress),
    });
  }

  /** Says once per request that the user has to wait. */
  #takeProgress({ requestId, share }: NavigationProgress): void {
    if (requestId === this.#preparing || share === 1) return;
    this.#preparing = requestId;
    this.say("The server prepares the paths of this scene; the walk begins in a moment.");
  }

  get mayDrive(): boolean {
    return (this.welcome?.role ?? 0) >= Role.DRIVE;
  }

  /** Commands are refused while a recording is played. */
  get isPlayback(): boolean {
    return this.replay !== null && !this.replay.branched;
  }

  /** Shows a sentence to the user for some seconds. */
  say(text: string): void {
    this.said.emit(text);
  }

  /** Sends a request whose failure the user should read, and nothing else depends on. */
  attempt(request: Promise<unknown>): void {
    request.catch((error: Error) => this.say(describeError(error)));
  }

  select(entity: number): void {
    if (this.model) {
      this.model.flags.setMarked(this.selection, false);
      this.model.flags.setMarked(entity, true);
      this.view.invalidate();
    }
    this.selection = entity;
    this.selected.emit(entity);
  }

  setFocus(avatar: string): void {
    if (this.focus === avatar) return;
    this.focus = avatar;
    this.focused.emit(avatar);
    this.view.invalidate();
  }

  avatarState(name: string): AvatarState | undefined {
    return this.state.latest?.avatars.find((avatar) => avatar.name === name);
  }

  async requestClock(mode: RequestFields<"setClock">["mode"]): Promise<void> {
    const reply = await this.connection.request("setClock", { mode });
    this.setClock(reply.clock, Number(reply.tick));
    this.view.invalidate();
  }

  async #begin(welcome: Welcome): Promise<void> {
    this.welcome = welcome;
    this.state.clear();
    this.replay = welcome.replay ?? null;
    this.setClock(welcome.clock, Number(welcome.tick));
    try {
      await this.#subscribe();
      if (!this.model || this.#sceneHash !== welcome.scene!.hash) await this.#loadScene(welcome);
      this.opened.emit(welcome);
    } catch (error) {
      if (!this.connection.isOpen) return; // the connection reports its own end
      this.troubled.emit({ kind: "final", text: (error as Error).message });
    }
  }

  async #subscribe(): Promise<void> {
    const { live } = await this.connection.request("subscribe", {
      contacts: true, nearMisses: true, notices: true, state: true, stateRate: 0, clock: true,
    });
    this.contactsReset.emit(live);
  }

  async #loadScene(welcome: Welcome): Promise<void> {
    const scene = welcome.scene!;
    this.loading.emit("Loading the scene …");
    const bytes = await this.connection.fetchScene((received) => {
      this.loading.emit(`Loading the scene: ${(received / 1e6).toFixed(1)} MB`);
    });
    this.loading.emit("Preparing the scene …");
    const gltf = await parseScene(bytes);
    const table = new EntityTable();
    for (const body of scene.bodies) {
      for (const object of body.objects) table.bodyByObject.set(object, body.id);
    }
    readEntities(gltf, table);
    await table.complete(this.connection, scene.objects);
    this.model?.dispose();
    this.table = table;
    this.model = new SceneModel(gltf, table, scene.bodies, scene.objects);
    this.#sceneHash = scene.hash;
    this.selection = 0;
    this.view.scene.add(this.model.root);
    this.view.setBounds(this.model.bounds);
    this.model.prepareRays();
    this.sceneLoaded.emit(this.model);
  }

  #takeEvents(events: TickEvents): void {
    if (events.contacts.length > 0) this.contactEvents.emit(events.contacts);
    for (const notice of events.notices) this.noticed.emit(notice);
  }

  #takeState(state: State): void {
    for (const { id, name } of state.avatars) this.table.avatars.set(id, name);
    this.state.add(state);
    this.#setTick(Number(state.tick), state.time);
    this.stateArrived.emit(state);
    this.view.invalidate();
  }

  #takeReplay(replay: Replay): void {
    this.replay = replay;
    this.setClock(replay.clock, Number(replay.tick));
  }

  #setTick(tick: number, time: number): void {
    this.tick = tick;
    this.time = time;
    this.timeChanged.emit();
  }

  setClock(clock: Clock | undefined, tick: number): void {
    if (clock) this.clock = clock;
    this.#setTick(tick, tick * (this.welcome?.policies?.tick ?? 0));
  }
}

/** The text of an error without the code that the client puts before it. */
export function describeError(error: Error): string {
  return error.message.replace(/^ERROR_\w+: /, "");
}
