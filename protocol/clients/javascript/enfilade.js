// Client of Enfilade over WebSocket, for browsers and Node.js. The messages are those of
// enfilade.proto: `client.request("step", { ticks: 60 })`, with fields in camelCase and 64-bit numbers
// as BigInt. Their descriptor is the file of the Python client, which the build keeps up to date.
// A browser without a bundler imports /page/enfilade.js of a running server: this file with its
// dependencies in one module.
import { create, createFileRegistry, fromBinary, toBinary } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";

export const PROTOCOL_VERSION = "1.0.0";
const LENGTHS = 8; // bytes before a message: total, header_length
const MAX_MESSAGE = 1 << 28; // bytes, as in the other clients

/** An error that the server reported. `fatal`: the connection ended with it. */
export class ServerError extends Error {
  constructor(code, message, field = "", fatal = false) {
    super(`${code}: ${message}` + (field ? ` (field: ${field})` : ""));
    Object.assign(this, { name: "ServerError", code, field, fatal });
  }
}

/** The connection could not be made, or broke. */
export class ConnectionFailed extends Error {
  name = "ConnectionFailed";
}

/** The schemas of enfilade.proto, by name: schemas.ServerMessage, schemas.ErrorCode, ... */
export async function loadSchemas() {
  const where = new URL("../python/enfilade/messages.desc", import.meta.url);
  const bytes = where.protocol === "file:"
    ? new Uint8Array(await (await import("node:fs/promises")).readFile(where))
    : new Uint8Array(await (await fetch(where)).arrayBuffer());
  return makeSchemas(createFileRegistry(fromBinary(FileDescriptorSetSchema, bytes)));
}

/** The same of a registry that a program has already, for example from generated code. */
export function makeSchemas(registry) {
  const prefix = "enfilade.v1.";
  return new Proxy({}, {
    get: (_, name) => registry.getMessage(prefix + name) ?? registry.getEnum(prefix + name),
  });
}

async function loadWebSocketClass() {
  if (globalThis.WebSocket) return globalThis.WebSocket;
  return (await import("ws")).WebSocket; // Node.js before version 22
}

/**
 * Connects, for example to "ws://127.0.0.1:7878", and enters a world. Events go to
 * `on.events`, `on.state`, `on.frame` (with its attachment), `on.replay`, `on.clock`, `on.navigationProgress` and
 * `on.bye`, in their order.
 * `on.closed` gets the reason once the connection has ended.
 */
export async function connect(
  url, { name = "enfilade javascript", token = "", world = "main", on = {}, schemas } = {},
) {
  schemas ??= await loadSchemas();
  const Socket = await loadWebSocketClass();
  const socket = new Socket(url);
  socket.binaryType = "arraybuffer";
  await new Promise((resolve, reject) => {
    socket.addEventListener("open", resolve, { once: true });
    socket.addEventListener("error", (event) => reject(new ConnectionFailed(
      `cannot connect to ${url}: ${event.message ?? "refused"}; is \`enfilade serve\` running there?`,
    )), { once: true });
  });
  const client = new Client(socket, schemas, on);
  const hello = { protocolVersion: PROTOCOL_VERSION, clientName: name, token, world };
  try {
    client.welcome = (await client.request("hello", hello)).body;
  } catch (refusal) {
    client.close();
    throw refusal;
  }
  return client;
}

export class Client {
  #socket;
  #schemas;
  #on;
  #lastId = 0n;
  #waiting = new Map();
  #unread = new Uint8Array(0);
  #ended = null;

  constructor(socket, schemas, on) {
    this.#socket = socket;
    this.#schemas = schemas;
    this.#on = on;
    socket.addEventListener("message", (event) => this.#hear(new Uint8Array(event.data)));
    socket.addEventListener("close", () => {
      this.#end(new ConnectionFailed("the connection closed"));
      this.#on.closed?.(this.#ended);
    });
    socket.addEventListener("error", () => {}); // "close" follows
  }

  get schemas() {
    return this.#schemas;
  }

  /**
   * Sends one request, named as in ClientMessage, and resolves to { body, attachment }. Several may be
   * pending. Rejects with a ServerError if the server refuses.
   */
  request(what, fields = {}) {
    if (this.#ended) return Promise.reject(this.#ended);
    const requestId = ++this.#lastId;
    const member = this.#schemas.ClientMessage.fields.find((field) => field.localName === what);
    if (!member) return Promise.reject(new TypeError(`ClientMessage has no ${what}`));
    const header = toBinary(this.#schemas.ClientMessage, create(this.#schemas.ClientMessage, {
      requestId, body: { case: what, value: create(member.message, fields) },
    }));
    const bytes = new Uint8Array(LENGTHS + header.length);
    const view = new DataView(bytes.buffer);
    view.setUint32(0, 4 + header.length, true);
    view.setUint32(4, header.length, true);
    bytes.set(header, LENGTHS);
    return new Promise((resolve, reject) => {
      this.#waiting.set(requestId, { resolve, reject });
      this.#socket.send(bytes);
    });
  }

  /** Commands an avatar: command("ann", "walk", { along: [{ x: 6, y: 0, z: 0 }] }). */
  command(avatar, order, fields = {}, tag = 0n) {
    const member = this.#schemas.Command.fields.find((field) => field.localName === order);
    if (!member) return Promise.reject(new TypeError(`Command has no ${order}`));
    return this.request("command", {
      avatar, tag, order: { case: order, value: create(member.message, fields) },
    });
  }

  step(ticks = 1, avatars = false) {
    return this.request("step", { ticks, avatars }).then((reply) => reply.body);
  }

  /** Moves a world that plays a recording to another tick. */
  seek(tick) {
    return this.request("seek", { tick: BigInt(tick) }).then((reply) => reply.body);
  }

  /** Leaves the recording at the present tick; `avatar`, if given, then belongs to this client. */
  takeOver(avatar = "") {
    return this.request("takeOver", { avatar }).then((reply) => reply.body);
  }

  close() {
    this.#socket.close(1000);
  }

  /** Takes the complete messages of the stream and keeps the rest for later. */
  #hear(bytes) {
    let data = bytes;
    if (this.#unread.length > 0) {
      data = new Uint8Array(this.#unread.length + bytes.length);
      data.set(this.#unread);
      data.set(bytes, this.#unread.length);
    }
    let start = 0;
    while (data.length - start >= LENGTHS) {
      const view = new DataView(data.buffer, data.byteOffset + start);
      const total = view.getUint32(0, true);
      const headerLength = view.getUint32(4, true);
      if (total > MAX_MESSAGE || headerLength + 4 > total) {
        this.#end(new ConnectionFailed(`a message claims ${total} bytes`));
        return this.#socket.close();
      }
      if (data.length - start < 4 + total) break;
      const header = data.subarray(start + LENGTHS, start + LENGTHS + headerLength);
      const attachment = data.slice(start + LENGTHS + headerLength, start + 4 + total);
      this.#take(fromBinary(this.#schemas.ServerMessage, header), attachment);
      start += 4 + total;
    }
    this.#unread = data.slice(start);
  }

  #take(message, attachment) {
    const { case: what, value } = message.body;
    if (message.replyTo !== 0n) {
      const waiting = this.#waiting.get(message.replyTo);
      this.#waiting.delete(message.replyTo);
      const refused = what === "error" ? value : what === "command" && !value.accepted && value.error;
      if (refused) waiting?.reject(this.#makeError(refused));
      else waiting?.resolve({ body: value, attachment });
      return;
    }
    if (what === "error") this.#end(this.#makeError(value, true));
    if (what === "bye") this.#end(this.#makeError({ code: value.code, message: value.reason }, true));
    this.#on[what]?.(value, attachment);
  }

  #makeError(error, fatal = false) {
    const code = this.#schemas.ErrorCode.value[error.code]?.name ?? `ERROR_${error.code}`;
    return new ServerError(code, error.message, error.field, fatal);
  }

  #end(why) {
    this.#ended ??= why;
    for (const { reject } of this.#waiting.values()) reject(this.#ended);
    this.#waiting.clear();
  }
}

/** Returns a frame's channels as typed arrays: pixels(frame, attachment).rgb, .depth, .ids. */
export function pixels(frame, attachment) {
  const kinds = { 1: ["rgb", Uint8Array], 2: ["ids", Uint32Array], 3: ["depth", Float32Array],
    4: ["normals", Float32Array], 5: ["range", Float32Array] };
  const found = {};
  for (const plane of frame.planes) {
    const [name, Kind] = kinds[plane.channel] ?? [];
    if (!name) continue;
    const start = Number(plane.offset);
    const bytes = attachment.slice(start, start + Number(plane.length)); // aligned
    found[name] = plane.encoding > 1 ? bytes : new Kind(bytes.buffer);
  }
  return found;
}
