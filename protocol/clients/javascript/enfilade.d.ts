// Types of enfilade.js for TypeScript. Message bodies are typed by the program's own generated code.

export const PROTOCOL_VERSION: string;

export class ServerError extends Error {
  code: string;
  field: string;
  fatal: boolean;
}

export class ConnectionFailed extends Error {}

export interface Schemas {
  readonly [name: string]: unknown;
}

export interface Listeners {
  events?(body: any): void;
  state?(body: any): void;
  frame?(body: any, attachment: Uint8Array): void;
  replay?(body: any): void;
  clock?(body: any): void;
  navigationProgress?(body: any): void;
  bye?(body: any): void;
  error?(body: any): void;
  closed?(why: Error): void;
}

export interface Reply {
  body: any;
  attachment: Uint8Array;
}

export interface ConnectOptions {
  name?: string;
  token?: string;
  world?: string;
  on?: Listeners;
  schemas?: Schemas;
}

export function loadSchemas(): Promise<Schemas>;
export function makeSchemas(registry: object): Schemas;
export function connect(url: string, options?: ConnectOptions): Promise<Client>;
export function pixels(frame: any, attachment: Uint8Array): Record<string, ArrayBufferView>;

export class Client {
  welcome: any;
  readonly schemas: Schemas;
  request(what: string, fields?: object): Promise<Reply>;
  command(avatar: string, order: string, fields?: object, tag?: bigint): Promise<Reply>;
  step(ticks?: number, avatars?: boolean): Promise<any>;
  seek(tick: number | bigint): Promise<any>;
  takeOver(avatar?: string): Promise<any>;
  close(): void;
}
