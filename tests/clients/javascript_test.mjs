// The JavaScript client against the real server. Run by `node --test`.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { connect, ConnectionFailed, pixels, ServerError } from "../../protocol/clients/javascript/enfilade.js";

// A floor, and a wall at x = 5.
function makeBox(name, [x0, y0, z0], [x1, y1, z1], first) {
  const corners = [];
  for (let i = 0; i < 8; ++i)
    corners.push(`v ${i & 1 ? x1 : x0} ${i & 2 ? y1 : y0} ${i & 4 ? z1 : z0}`);
  const faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
  return [`o ${name}`, ...corners, ...faces.map((face) => `f ${face.map((i) => i + first).join(" ")}`),
    ""].join("\n");
}

let folder, server, port;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "enfilade-js-"));
  const scene = join(folder, "room.obj");
  writeFileSync(scene, makeBox("floor", [-10, -0.5, -10], [10, 0, 10], 1) +
    makeBox("wall", [5, 0, -4], [5.2, 3, 4], 9));
  server = spawn(process.env.ENFILADE, ["serve", scene, "--listen", "127.0.0.1:0",
    "--stop-at-end-of-input"], { stdio: ["pipe", "pipe", "inherit"] });
  const ready = await new Promise((resolve, reject) => {
    server.stdout.once("data", (line) => resolve(JSON.parse(line)));
    server.once("exit", () => reject(new Error("the server ended")));
  });
  port = ready.port;
});

after(() => {
  server.kill("SIGTERM");
  rmSync(folder, { recursive: true });
});

test("a walk over a WebSocket reports contact with the wall", async () => {
  const heard = [];
  const client = await connect(`ws://127.0.0.1:${port}`,
    { on: { events: (events) => heard.push(...events.contacts) } });
  assert.equal(client.welcome.scene.source, "room.obj");
  await client.request("subscribe", { contacts: true });
  await client.command("ann", "spawn", { at: { x: 0, y: 0.01, z: 0 } });
  await client.command("ann", "walk", { along: [{ x: 8, y: 0, z: 0 }] });
  let step = await client.step(60, true);
  for (let i = 0; i < 30 && !step.idle; ++i) step = await client.step(60, true);
  assert.ok(Math.abs(step.avatars[0].feet.x - 4.7) < 0.05);
  const begin = client.schemas.ContactEvent.nestedEnums[0].values.find((v) => v.name === "KIND_BEGIN");
  assert.deepEqual(heard.filter((c) => c.kind === begin.number).map((c) => c.bName), ["floor", "wall"]);
  client.close();
});

/** A server of its own; resolves to it and its port. */
async function serve(...what) {
  const process_ = spawn(process.env.ENFILADE, ["serve", ...what, "--listen", "127.0.0.1:0",
    "--stop-at-end-of-input"], { stdio: ["pipe", "pipe", "ignore"] });
  const [line] = await once(process_.stdout, "data");
  return { process_, url: `ws://127.0.0.1:${JSON.parse(line).port}` };
}

async function stop(process_) {
  process_.kill("SIGTERM");
  await once(process_, "exit");
}

test("a recording is played, sought and taken over", async () => {
  const walk = join(folder, "walk.mcap");
  const recording = await serve(join(folder, "room.obj"), "--record", walk);
  const walker = await connect(recording.url);
  await walker.command("ann", "spawn", { at: { x: 0, y: 0.01, z: 0 } });
  const recorded = (await walker.step(100)).stateHash;
  await walker.step(50);
  walker.close();
  await stop(recording.process_);

  const replays = [];
  const played = await serve(walk);
  const client = await connect(played.url, { on: { replay: (replay) => replays.push(replay) } });
  assert.equal(client.welcome.replay.lastTick, 150n);
  assert.equal((await client.seek(100)).stateHash, recorded);
  assert.equal((await client.step(1)).tick, 101n);
  await assert.rejects(client.command("ann", "walk", { along: [{ x: 3, y: 0, z: 0 }] }), /TakeOver/);
  assert.equal((await client.takeOver("ann")).tick, 101n);
  await client.command("ann", "walk", { along: [{ x: 3, y: 0, z: 0 }] });
  assert.deepEqual(replays.map((replay) => [replay.tick, replay.branched]), [[100n, false], [101n, true]]);
  client.close();
  await stop(played.process_);
});

test("several requests are under way, and refusals carry their code", async () => {
  const client = await connect(`ws://127.0.0.1:${port}`);
  const [first, refused, third] = await Promise.allSettled(
    [client.step(2), client.step(0), client.request("metrics")]);
  assert.equal(first.status, "fulfilled");
  assert.ok(refused.reason instanceof ServerError);
  assert.deepEqual([refused.reason.code, refused.reason.field], ["ERROR_BAD_MESSAGE", "step.ticks"]);
  assert.ok(third.value.body.ticks >= first.value.tick);
  client.close();
});

test("a picture comes as typed arrays, and a watch sends more", async (t) => {
  const watched = [];
  let wake = () => {};
  const client = await connect(`ws://127.0.0.1:${port}`,
    { on: { frame: (frame) => { watched.push(frame.tick); wake(); } } });
  if (!client.welcome.renderer) return t.skip("no EGL device");
  const view = { view: { case: "free", value: { eye: { x: 0, y: 1, z: 0 },
    gaze: { case: "forward", value: { x: 1, y: 0, z: 0 } } } }, width: 9, height: 7,
    channels: [1, 2, 3] };
  const { body, attachment } = await client.request("frame", view);
  const { rgb, ids, depth } = pixels(body, attachment);
  assert.equal(rgb.length, 9 * 7 * 3);
  assert.equal(ids[3 * 9 + 4], 2);
  assert.ok(Math.abs(depth[3 * 9 + 4] - 5) < 1e-3);
  const came = new Promise((resolve) => { wake = resolve; });
  await client.request("watchFrames", { watch: 1, frame: view });
  await came;
  assert.equal(watched.length, 1);
  client.close();
});

test("a world is made, entered and dropped", async () => {
  const main = await connect(`ws://127.0.0.1:${port}`);
  const { body } = await main.request("createWorld", { name: "attic" });
  assert.equal(body.world.scene, "room");
  let bye;
  const ended = new Promise((resolve) => { bye = resolve; });
  const attic = await connect(`ws://127.0.0.1:${port}`, { world: "attic", on: { bye } });
  assert.equal(attic.welcome.world, "attic");
  assert.equal((await attic.step(3)).tick, 3n);
  const { body: list } = await main.request("listWorlds");
  assert.deepEqual(list.worlds.map((world) => world.name), ["main", "attic"]);
  await main.request("dropWorld", { name: "attic" });
  assert.match((await ended).reason, /'attic' was dropped/);
  await assert.rejects(connect(`ws://127.0.0.1:${port}`, { world: "attic" }), ServerError);
  main.close();
});

test("a refused connection is reported", async () => {
  await assert.rejects(connect("ws://127.0.0.1:1"), ConnectionFailed);
});
