// The connection to the server: one world, typed requests, reconnection with back-off.
import { createRegistry } from "@bufbuild/protobuf";
import { connect, ConnectionFailed, makeSchemas, ServerError, type Client } from "enfilade-client";
import { file_enfilade } from "../generated/enfilade_pb";
import { fetchScene } from "./scene_file";
import type { CommandFields, Listener, ReplyOf, RequestFields, RequestName, Trouble, WorldSource } from "./source";

const FIRST_WAIT = 0.5; // seconds
const MAX_WAIT = 10; // seconds: a server that restarts is found soon, a dead one costs little

export class Connection implements WorldSource {
  token: string;
  readonly world: string;
  #client: Client | null = null;
  #listener: Listener;
  #wait = FIRST_WAIT;
  #timer = 0;
  #schemas = makeSchemas(createRegistry(file_enfilade));

  constructor(listener: Listener, token: string, world: string) {
    this.#listener = listener;
    this.token = token;
    this.world = world;
  }

  get isFile(): boolean {
    return false;
  }

  get isOpen(): boolean {
    return this.#client !== null;
  }

  async open(): Promise<void> {
    clearTimeout(this.#timer);
    const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;
    try {
      const client: Client = await connect(url, {
        name: "page", token: this.token, world: this.world, schemas: this.#schemas,
        on: {
          events: (body) => this.#listener.events(body),
          state: (body) => this.#listener.state(body),
          replay: (body) => this.#listener.replay(body),
          clock: (body) => this.#listener.clock(body),
          navigationProgress: (body) => this.#listener.navigationProgress(body),
          closed: (why) => this.#lost(why),
        },
      });
      this.#client = client;
      this.#wait = FIRST_WAIT;
      this.#listener.opened(client.welcome);
    } catch (error) {
      await this.#refused(error as Error);
    }
  }

  async request<K extends RequestName>(name: K, fields: RequestFields<K>): Promise<ReplyOf<K>> {
    if (!this.#client) throw new ConnectionFailed("not connected");
    return (await this.#client.request(name, fields as object)).body;
  }

  command(avatar: string, order: CommandFields["order"], tag = 0n): Promise<ReplyOf<"command">> {
    return this.request("command", { avatar, tag, order } as RequestFields<"command">);
  }

  fetchScene(progress: (bytes: number) => void): Promise<ArrayBuffer> {
    const query = this.world ? `?world=${encodeURIComponent(this.world)}` : "";
    return fetchScene(`/scene.glb${query}`, this.token, progress);
  }

  #lost(why: Error): void {
    if (!this.#client) return; // #refused handles a connection that was never open
    this.#client = null;
    void this.#refused(why);
  }

  async #refused(error: Error): Promise<void> {
    if (error instanceof ServerError) {
      const trouble = describeRefusal(error);
      if (trouble) return this.#listener.troubled(trouble);
      return this.#retry(error.message);
    }
    this.#retry(await explainFailure());
  }

  #retry(text: string): void {
    this.#listener.troubled({ kind: "waiting", text, seconds: this.#wait });
    this.#timer = window.setTimeout(() => void this.open(), this.#wait * 1000);
    this.#wait = Math.min(MAX_WAIT, this.#wait * 1.6);
  }
}

function describeRefusal(error: ServerError): Trouble | null {
  switch (error.code) {
    case "ERROR_UNAUTHENTICATED":
      return { kind: "token", text: "This server needs a token." };
    case "ERROR_VERSION":
      return { kind: "final", text: `The server speaks another version of the protocol than this page. Reload the page. (${error.message})` };
    case "ERROR_UNKNOWN_WORLD":
    case "ERROR_WORLD_DROPPED":
      return { kind: "final", text: error.message };
    default:
      return null;
  }
}

/** A browser hides why a WebSocket failed. A plain request distinguishes a refusal from an absent server. */
async function explainFailure(): Promise<string> {
  try {
    const { status } = await fetch("/healthz", { cache: "no-store", signal: AbortSignal.timeout(3000) });
    if (status === 403) {
      return `The server refuses this address (${location.host}). Start it with --allow-host or --allow-origin.`;
    }
    if (status === 503) return "The server is busy, or its world has failed.";
    return "The server refused the connection.";
  } catch {
    return "The server does not reply.";
  }
}
