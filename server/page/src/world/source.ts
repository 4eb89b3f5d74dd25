// The source of the page's world: a server, or a recording in the page's own file.
import type { MessageInitShape } from "@bufbuild/protobuf";
import type {
  ClientMessageSchema, ClockChange, ContactEvent, NavigationProgress, Replay, ServerMessage, State, TickEvents, Welcome,
} from "../generated/enfilade_pb";

type RequestBody = NonNullable<MessageInitShape<typeof ClientMessageSchema>["body"]>;
export type RequestName = Exclude<NonNullable<RequestBody["case"]>, "hello" | "bye">;
export type RequestFields<K> = Extract<RequestBody, { case: K }>["value"];
type ReplyBody = ServerMessage["body"];
// Replies have the names of their requests, with two exceptions.
type ReplyName = { [K in RequestName]: K extends "describe" ? "names" : K extends "listWorlds" ? "worlds" : K };
export type ReplyOf<K extends RequestName> = Extract<ReplyBody, { case: ReplyName[K] }>["value"];
export type CommandFields = NonNullable<RequestFields<"command">>;

export type Trouble =
  | { kind: "token"; text: string } // the user must give one
  | { kind: "final"; text: string } // retrying cannot help
  | { kind: "waiting"; text: string; seconds: number };

export interface Listener {
  opened(welcome: Welcome): void;
  troubled(trouble: Trouble): void;
  events(events: TickEvents): void;
  state(state: State): void;
  replay(replay: Replay): void;
  clock(change: ClockChange): void;
  navigationProgress(progress: NavigationProgress): void;
}

export interface WorldSource {
  token: string;
  readonly world: string;
  readonly isOpen: boolean;
  /** The world is a recording in this file: nothing can be commanded. */
  readonly isFile: boolean;
  /** All contacts of a recording, if the page has them. */
  readonly recordedEvents?: ContactEvent[];
  open(): Promise<void>;
  request<K extends RequestName>(name: K, fields: RequestFields<K>): Promise<ReplyOf<K>>;
  command(avatar: string, order: CommandFields["order"], tag?: bigint): Promise<ReplyOf<"command">>;
  /** The scene as binary glTF; `progress` gets the received bytes. */
  fetchScene(progress: (bytes: number) => void): Promise<ArrayBuffer>;
}

export type MakeSource = (listener: Listener) => WorldSource;
