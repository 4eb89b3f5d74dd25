// Tests of the live channels for viewers, with Foxglove's own client against a real server.
//   node foxglove_test.mjs --server build/enfilade [--scene FILE.glb] [--walk FILE.jsonl]
// Every message is decoded with the schema that its channel advertises.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { createFileRegistry, fromBinary } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import foxglove from "@foxglove/ws-protocol"; // a CommonJS module
import { WebSocket } from "ws";
import { connect } from "../../protocol/clients/javascript/enfilade.js";
import { awaitReady, runTests } from "./harness.mjs";

globalThis.WebSocket ??= WebSocket; // for the client of the protocol

const { values: options } = parseArgs({
  options: {
    server: { type: "string" }, scene: { type: "string", default: "build/assets/building.glb" },
    walk: { type: "string", default: "assets/tour.jsonl" },
  },
});
assert.ok(options.server, "--server names the program");
const scratch = mkdtempSync(join(tmpdir(), "enfilade-foxglove-"));
const SUBPROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
const PLAYBACK_CONTROL = 3, PLAYBACK_STATE = 5; // operations that @foxglove/ws-protocol 0.8 lacks
const PLAYING = 0, PAUSED = 1, ENDED = 3;
const SECOND = 1_000_000_000n;
const cleanups = [() => rmSync(scratch, { recursive: true })];

async function startServer(what, args = []) {
  const child = spawn(options.server, ["serve", what, "--listen", "127.0.0.1:0", ...args], { stdio: ["ignore", "pipe", "ignore"] });
  cleanups.unshift(() => child.kill("SIGKILL"));
  const ready = await awaitReady(child);
  return ready.port;
}

async function until(what, condition) {
  for (let waited = 0; waited < 20_000; waited += 10) {
    const value = condition();
    if (value) return value;
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
  assert.fail(`no ${what} within 20 s`);
}

/** A viewer: channels, statuses and decoded messages by topic. */
class Viewer {
  channels = new Map();
  messages = new Map();
  statuses = [];
  times = [];
  playback = [];

  constructor(url, protocols = SUBPROTOCOLS) {
    this.socket = new WebSocket(url, protocols);
    this.socket.binaryType = "arraybuffer";
    // States of playback are kept from the client, which would refuse them.
    const socket = this.socket;
    const viewer = this;
    const filtered = {
      get protocol() { return socket.protocol; },
      set binaryType(_) {},
      set onopen(handler) { socket.on("open", () => handler()); },
      set onerror(handler) { socket.on("error", (error) => handler(error)); },
      set onclose(handler) { socket.on("close", () => handler()); },
      set onmessage(handler) {
        socket.on("message", (data, isBinary) => {
          const bytes = new Uint8Array(data);
          if (isBinary && bytes[0] === PLAYBACK_STATE) viewer.addPlayback(bytes);
          else handler({ data: isBinary ? bytes.buffer : new TextDecoder().decode(bytes) });
        });
      },
      send: (data) => socket.send(data),
      close: () => socket.close(),
    };
    this.client = new foxglove.FoxgloveClient({ ws: filtered });
    this.client.on("serverInfo", (info) => { this.info = info; });
    this.client.on("status", (status) => this.statuses.push(status));
    this.client.on("time", ({ timestamp }) => this.times.push(timestamp));
    this.client.on("advertise", (channels) => channels.forEach((channel) => this.channels.set(channel.topic, channel)));
    this.client.on("unadvertise", (ids) => {
      for (const [topic, { id }] of this.channels) if (ids.includes(id)) this.channels.delete(topic);
    });
    this.client.on("error", (error) => { this.error = error; });
    this.client.on("message", ({ subscriptionId, timestamp, data }) => {
      const { schema, list } = this.subscriptions.get(subscriptionId);
      const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
      list.push({ timestamp, message: fromBinary(schema, bytes) });
    });
  }
  subscriptions = new Map();

  async subscribe(topic) {
    const channel = await until(`channel ${topic}`, () => this.channels.get(topic));
    assert.equal(channel.encoding, "protobuf");
    const registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, new Uint8Array(Buffer.from(channel.schema, "base64"))));
    const schema = registry.getMessage(channel.schemaName);
    assert.ok(schema, `${topic}: the schema has no ${channel.schemaName}`);
    const list = [];
    const id = this.client.subscribe(channel.id);
    this.subscriptions.set(id, { schema, list });
    return { id, list };
  }

  addPlayback(bytes) {
    const view = new DataView(bytes.buffer);
    const length = view.getUint32(14, true);
    this.playback.push({
      status: view.getUint8(1), time: view.getBigUint64(2, true), speed: view.getFloat32(10, true),
      requestId: new TextDecoder().decode(bytes.subarray(18, 18 + length)),
    });
  }

  control({ play, speed = 1, seekTo, requestId = "" }) {
    const id = new TextEncoder().encode(requestId);
    const view = new DataView(new ArrayBuffer(19 + id.length));
    view.setUint8(0, PLAYBACK_CONTROL);
    view.setUint8(1, play ? 0 : 1);
    view.setFloat32(2, speed, true);
    view.setUint8(6, seekTo === undefined ? 0 : 1);
    view.setBigUint64(7, seekTo ?? 0n, true);
    view.setUint32(15, id.length, true);
    new Uint8Array(view.buffer).set(id, 19);
    this.socket.send(view.buffer);
  }

  close() { this.client.close(); }
}

const at = (x, y, z) => ({ x, y, z });
const entities = ({ list }) => list.flatMap(({ message }) => message.entities);

const tests = {
  async "the channels of recordings are live, and decode with their schemas"() {
    const port = await startServer(options.scene);
    const viewer = new Viewer(`ws://127.0.0.1:${port}/`);
    await until("greeting", () => viewer.info);
    assert.deepEqual(viewer.info.capabilities, ["time"]);
    const [tf, scene, state, events] = await Promise.all(
      ["/tf", "/scene", "/enfilade/state", "/enfilade/events"].map((topic) => viewer.subscribe(topic)));

    const client = await connect(`ws://127.0.0.1:${port}`, { name: "driver" });
    await client.request("command", { avatar: "ann", order: { case: "spawn", value: { at: at(-6, 0, 0) } } });
    await client.request("step", { ticks: 30 });
    const image = await viewer.subscribe("/frames/ann/image");
    const calibration = await viewer.subscribe("/frames/ann/calibration");
    await client.request("command", { avatar: "ann", order: { case: "walk", value: { along: [at(-4, 0, 0)] } } });
    const { body: step } = await client.request("step", { ticks: 120 });

    const model = await until("model", () => entities(scene).find(({ models }) => models.length > 0)?.models[0]);
    assert.equal(new TextDecoder().decode(model.data.subarray(0, 4)), "glTF");
    assert.equal(model.mediaType, "model/gltf-binary");
    await until("avatar", () => entities(scene).some(({ id }) => id === "avatar/ann"));
    await until("bodies", () => entities(scene).some(({ id }) => id.startsWith("body/")));
    const root = tf.list.flatMap(({ message }) => message.transforms).find(({ parentFrameId }) => parentFrameId === "map");
    assert.equal(root.childFrameId, "scene");

    // The last state is that of the last tick, at its time.
    const last = await until("state", () => state.list.find(({ message }) => message.tick === step.tick));
    assert.equal(last.message.avatars[0].name, "ann");
    assert.equal(last.timestamp, BigInt(Math.round(last.message.time * 1e9)));
    await until("clock", () => viewer.times.includes(last.timestamp));
    const pose = await until("transform", () => tf.list.flatMap(({ message }) => message.transforms)
      .filter(({ childFrameId }) => childFrameId === "avatar/ann").at(-1)?.translation);
    assert.ok(Math.abs(pose.x - last.message.avatars[0].feet.x) < 0.2, `${pose.x}`);
    assert.ok(events.list.some(({ message }) => message.notices.length > 0));

    const picture = await until("picture", () => image.list.at(-1)?.message);
    assert.equal(picture.format, "jpeg");
    assert.deepEqual([...picture.data.subarray(0, 2)], [0xff, 0xd8]);
    assert.equal((await until("calibration", () => calibration.list.at(-1)?.message)).width, 640);

    // A viewer that comes later gets the present at once, without a tick.
    const late = new Viewer(`ws://127.0.0.1:${port}/`, ["foxglove.websocket.v1"]);
    const [lateScene, lateTf, lateState] = await Promise.all(["/scene", "/tf", "/enfilade/state"].map((topic) => late.subscribe(topic)));
    await until("avatar", () => entities(lateScene).some(({ id }) => id === "avatar/ann"));
    await until("transform", () => lateTf.list.some(({ message }) => message.transforms.some(({ childFrameId }) => childFrameId === "avatar/ann")));
    assert.equal((await until("state", () => lateState.list[0])).message.tick, step.tick);

    await client.request("command", { avatar: "ann", order: { case: "leave", value: {} } });
    await client.request("step", { ticks: 1 });
    await until("withdrawn channel", () => !viewer.channels.has("/frames/ann/image"));
    viewer.client.subscribe(999);
    await until("status", () => viewer.statuses.some(({ message }) => message.includes("no channel 999")));
    assert.equal(viewer.error, undefined);
    for (const one of [viewer, late, client]) one.close();
  },

  async "a recording is played, paused and sought"() {
    const recording = join(scratch, "tour.mcap");
    execFileSync(options.server, ["replay", options.scene, options.walk, "--out", join(scratch, "out"), "--record", recording], { stdio: "ignore" });
    const port = await startServer(recording);
    const viewer = new Viewer(`ws://127.0.0.1:${port}/`);
    await until("greeting", () => viewer.info);
    assert.ok(viewer.info.capabilities.includes("playbackControl"));
    assert.equal(viewer.info.dataStartTime, 0);
    assert.ok(viewer.info.dataEndTime > 10e9, `${viewer.info.dataEndTime}`);
    const state = await viewer.subscribe("/enfilade/state");
    assert.equal((await until("playback", () => viewer.playback[0])).status, PAUSED);

    viewer.control({ play: false, seekTo: 5n * SECOND, requestId: "seek" });
    const sought = await until("answer", () => viewer.playback.find(({ requestId }) => requestId === "seek"));
    assert.deepEqual([sought.status, sought.time], [PAUSED, 5n * SECOND]);
    await until("state", () => state.list.at(-1)?.timestamp === 5n * SECOND);
    assert.equal(state.list.at(-1).message.tick, 300n);

    viewer.control({ play: true, speed: 4, requestId: "play" });
    const playing = await until("answer", () => viewer.playback.find(({ requestId }) => requestId === "play"));
    assert.deepEqual([playing.status, playing.speed], [PLAYING, 4]);
    await until("progress", () => viewer.times.at(-1) > 6n * SECOND);

    viewer.control({ play: true, seekTo: BigInt(viewer.info.dataEndTime) - SECOND / 2n, speed: 8 });
    await until("end", () => viewer.playback.at(-1).status === ENDED);
    viewer.control({ play: false, speed: -1 });
    await until("refusal", () => viewer.statuses.some(({ message }) => message.includes("speed")));
    assert.equal(viewer.error, undefined);
    viewer.close();
  },

  async "hostile input is refused in words, and the server stays"() {
    const port = await startServer(options.scene);
    const viewer = new Viewer(`ws://127.0.0.1:${port}/`);
    await until("greeting", () => viewer.info);
    for (const text of ["", "[", "[[[[[[[[[[[[[[[[[[[[[[1]]]", '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":2}]}', '{"op":"fetchAsset"}', '{"op":7}']) {
      const before = viewer.statuses.length;
      viewer.socket.send(text);
      await until(`refusal of ${text}`, () => viewer.statuses.length > before);
    }
    viewer.socket.send(new Uint8Array([PLAYBACK_CONTROL, 0]));
    await until("refusal", () => viewer.statuses.at(-1).message.includes("too short"));
    viewer.control({ play: true });
    await until("refusal", () => viewer.statuses.at(-1).message.includes("recording"));
    const huge = new Viewer(`ws://127.0.0.1:${port}/`);
    await until("greeting", () => huge.info);
    huge.socket.send("x".repeat(70_000));
    await until("end", () => huge.socket.readyState === WebSocket.CLOSED);
    const { status } = await fetch(`http://127.0.0.1:${port}/healthz`);
    assert.equal(status, 200);
    viewer.close();
  },

  async "another page's origin is refused"() {
    const port = await startServer(options.scene, ["--allow-origin", "https://app.foxglove.dev"]);
    const outcome = (origin) => new Promise((resolve) => {
      const socket = new WebSocket(`ws://127.0.0.1:${port}/`, SUBPROTOCOLS, { origin });
      socket.on("open", () => { socket.close(); resolve("open"); });
      socket.on("unexpected-response", (_, response) => resolve(response.statusCode));
      socket.on("error", () => resolve("error"));
    });
    assert.equal(await outcome("https://evil.example"), 403);
    assert.equal(await outcome("https://app.foxglove.dev"), "open");
  },
};

const failures = await runTests(tests);
for (const cleanup of cleanups) cleanup();
process.exit(failures > 0 ? 1 : 0);
