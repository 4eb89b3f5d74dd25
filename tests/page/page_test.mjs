// Tests of the page in Chromium against a real server.
//   node page_test.mjs --server build/enfilade [--scene FILE.glb] [--glb FILE.glb] [--page build/page] [--out FOLDER] [--chromium PATH]
// A server without a page of its own is put behind page_proxy.mjs, which sends --glb (default: the scene). Screenshots are written to the folder of --out.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { startProxy } from "./page_proxy.mjs";
import { awaitReady, launchBrowser, LONG } from "./harness.mjs";

const { values: options } = parseArgs({
  options: {
    server: { type: "string" }, scene: { type: "string", default: "build/assets/building.glb" },
    page: { type: "string", default: "build/page" }, glb: { type: "string" }, out: { type: "string", default: "out/page" },
    chromium: { type: "string", default: "/usr/bin/chromium" }, only: { type: "string" },
    shared: { type: "string", default: "../shared/scenes" }, // real buildings; their tests are skipped without it, except in CI
  },
});
assert.ok(options.server, "--server names the program");
mkdirSync(options.out, { recursive: true });
const scratch = mkdtempSync(join(tmpdir(), "enfilade-page-"));
const WALK_SPEED = 1.4; // metres per second, of the page
const TICK = 1 / 60;

const browser = await launchBrowser(options.chromium);
const cleanups = [() => browser.close(), () => rmSync(scratch, { recursive: true })];

async function startServer(what, { port = 0, args = [] } = {}) {
  const child = spawn(options.server, ["serve", what, "--listen", `127.0.0.1:${port}`, ...args], { stdio: ["ignore", "pipe", "pipe"] });
  child.stderr.resume();
  const ready = await awaitReady(child);
  const server = {
    port: ready.port,
    async stop() {
      if (child.exitCode !== null) return;
      child.kill("SIGTERM");
      await new Promise((resolve) => child.once("exit", resolve));
    },
  };
  cleanups.unshift(() => server.stop());
  return server;
}

/** The address of the page: the server's own, or a proxy's. */
async function findAddress(server) {
  const own = `http://127.0.0.1:${server.port}/`;
  const reply = await fetch(own).catch(() => null);
  if (reply?.ok && (await reply.text()).includes("<title>Enfilade")) return own;
  const proxy = await startProxy(options.page, options.glb ?? options.scene, server.port);
  cleanups.unshift(() => proxy.close());
  return `http://127.0.0.1:${proxy.address().port}/`;
}

async function openPage(address, { width = 900, height = 620 } = {}) {
  const page = await browser.newPage({ viewport: { width, height } });
  page.setDefaultTimeout(LONG);
  page.problems = [];
  page.on("console", (message) => {
    if (message.type() === "error") page.problems.push(message.text());
  });
  page.on("pageerror", (error) => page.problems.push(error.message));
  await page.goto(address);
  return page;
}

const isReady = (page) => page.waitForFunction(() => globalThis.enfilade?.app.model && enfilade.app.connection.isOpen);
const shoot = (page, name) => page.screenshot({ path: join(options.out, `${name}.png`), timeout: LONG });

/** A second client in the page, over the page's copy of the JavaScript client: it records what the server reports. */
async function observe(page) {
  await page.evaluate(async () => {
    const { connect } = await import("/page/enfilade.js");
    const states = new Map();
    const client = await connect(`ws://${location.host}/`, {
      name: "observer", on: { state: (state) => states.set(Number(state.tick), state) },
    });
    await client.request("subscribe", { state: true });
    globalThis.observer = { client, states };
  });
}

async function enter(page) {
  await page.getByRole("button", { name: "Walk", exact: true }).click();
  await page.waitForFunction(() => enfilade.walk.isWalking && enfilade.app.avatarState(enfilade.walk.name)?.grounded);
  return await page.evaluate(() => enfilade.walk.name);
}

async function hold(page, keys, milliseconds) {
  for (const key of keys) await page.keyboard.down(key);
  await page.waitForTimeout(milliseconds);
  for (const key of [...keys].reverse()) await page.keyboard.up(key);
  // The avatar stands when a tick has not moved it.
  await page.waitForFunction(() => {
    const { made } = enfilade.app.avatarState(enfilade.walk.name)?.move ?? {};
    return made && Math.hypot(made.x, made.z) === 0;
  });
}

const tests = {
  async "the page opens without errors"({ page, picture = "1-opened" }) {
    await shoot(page, picture);
    assert.deepEqual(page.problems, []);
    const { triangles, calls } = await page.evaluate(() => enfilade.app.view.drawn);
    assert.ok(triangles > 1000, `${triangles} triangles are drawn`);
    assert.ok(calls <= 500, `${calls} draw calls`);
  },

  async "a pick names the object that the server's ray names"({ page }) {
    const result = await page.evaluate(async () => {
      let seed = 12345;
      const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
      const { app, rig } = enfilade;
      const { clientWidth: width, clientHeight: height } = app.view.canvas;
      const differences = [];
      let met = 0;
      for (let view = 0; view < 4; ++view) {
        rig.look(Math.PI / 2, 0);
        app.view.invalidate();
        await new Promise((resolve) => setTimeout(resolve, 400));
        const rays = Array.from({ length: 50 }, () => {
          const [x, y] = [random() * width, random() * height];
          const { origin, direction } = enfilade.computeRay(x, y);
          return { x, y, origin: { ...origin }, direction: { ...direction } };
        });
        const { hits } = await app.connection.request("rays", { rays: rays.map(({ origin, direction }) => ({ origin, direction })) });
        hits.forEach((hit, index) => {
          const picked = enfilade.pick(rays[index].x, rays[index].y);
          met += hit.met ? 1 : 0;
          if ((picked?.entity ?? 0) !== hit.entity) differences.push(`${hit.name} at ${hit.distance}, page: ${picked?.entity} ${app.table.findName(picked?.entity)}`);
        });
      }
      return { differences, met };
    });
    assert.ok(result.met > 100, `${result.met} of 200 rays hit something`);
    assert.ok(result.differences.length <= 2, `of 200 pixels differ: ${result.differences.join("; ")}`);
  },

  async "the drawn ids agree with the server's picture of ids"({ page }) {
    await observe(page);
    const results = await page.evaluate(async () => {
      const { pixels } = await import("/page/enfilade.js");
      const [width, height] = [400, 300];
      const { app, rig } = enfilade;
      if (!app.welcome.renderer) return [];
      const results = [];
      for (let view = 0; view < 4; ++view) {
        rig.look(Math.PI / 2, 0);
        app.view.invalidate();
        await new Promise((resolve) => setTimeout(resolve, 300));
        const { x, y, z } = rig.position;
        const { camera } = app.view;
        const { body, attachment } = await observer.client.request("frame", {
          view: { case: "free", value: {
            eye: { x, y, z }, gaze: { case: "forward", value: { ...rig.forward } },
            projection: { case: "fovY", value: camera.fov * Math.PI / 180 }, near: camera.near, far: camera.far,
          } },
          width, height, channels: [2], glass: 2,
        });
        const theirs = pixels(body, attachment).ids;
        const ours = enfilade.ids(width, height);
        let both = 0, either = 0;
        const known = (id) => (id <= app.welcome.scene.objects ? id : 0);
        ours.forEach((id, i) => {
          const other = known(theirs[i]);
          if (id === 0 && other === 0) return;
          both += id === other ? 1 : 0;
          either += 1;
        });
        results.push(both / either);
      }
      return results;
    });
    results.forEach((agreement) => assert.ok(agreement >= 0.99, `agreement of ids: ${results}`));
    console.log(`     agreement of ids: ${results.map((one) => one.toFixed(4)).join(", ")}`);
  },

  async "a click shows the card of the object"({ page }) {
    const canvas = await page.locator(".stage > canvas").boundingBox();
    await page.mouse.click(canvas.x + canvas.width * 0.6, canvas.y + canvas.height * 0.5);
    await page.waitForFunction(() => enfilade.app.selection > 0);
    const { path, card } = await page.evaluate(() => ({
      path: enfilade.app.table.findName(enfilade.app.selection), card: document.querySelector(".card").innerText,
    }));
    assert.ok(card.includes(path), `the card names ${path}`);
    await page.waitForFunction(() => /Touches (now|nothing)/.test(document.querySelector(".card h3").textContent));
    await shoot(page, "2-picked");
    await page.keyboard.press("Escape");
  },

  async "search, hide, isolate and show all"({ page }) {
    const search = page.getByRole("searchbox");
    await search.fill("picture01 canvas");
    await page.waitForFunction(() => document.querySelectorAll(".tree [role=treeitem]").length > 0);
    await page.locator(".tree [role=treeitem]").first().click();
    const hidden = () => page.evaluate(() => enfilade.app.model.flags.hiddenCount);
    await page.getByRole("button", { name: "Isolate" }).click();
    assert.ok(await hidden() > 100, "all others are hidden");
    await page.getByRole("button", { name: "Show all" }).click();
    assert.equal(await hidden(), 0);
    await page.getByRole("button", { name: "Hide", exact: true }).last().click();
    assert.equal(await hidden(), 1);
    await page.getByRole("button", { name: "Show all" }).click();
    await search.fill("");
    await page.keyboard.press("Escape");
    await page.evaluate(() => enfilade.app.select(0));
  },

  async "W held for two seconds moves the avatar as the server says"({ page }) {
    await observe(page);
    const name = await enter(page);
    const feet = () => page.evaluate((who) => {
      const { x, z } = enfilade.app.avatarState(who).feet;
      return [x, z];
    }, name);
    const start = await feet();
    await page.evaluate(() => observer.states.clear());
    await hold(page, ["w"], 2000);
    const end = await feet();
    const distance = Math.hypot(end[0] - start[0], end[1] - start[1]);
    // States are latest-only, so the sum over ticks would miss some: compare the ends.
    const server = await page.evaluate((who) => {
      const states = [...observer.states.values()].map((state) => state.avatars.find((avatar) => avatar.name === who));
      const moves = states.filter(({ move }) => Math.hypot(move.asked.x, move.asked.z) > 0);
      const ticks = [...observer.states.values()].filter((state) => moves.includes(state.avatars.find((avatar) => avatar.name === who)));
      const [first, last] = [ticks[0], ticks.at(-1)];
      const feet = states.at(-1).feet;
      return { feet: [feet.x, feet.z], asked: Number(last.tick - first.tick) + 1, blocked: moves.some(({ move }) => move.stoppedBy !== 0) };
    }, name);
    const moved = Math.hypot(server.feet[0] - start[0], server.feet[1] - start[1]);
    assert.ok(distance > 1, `the avatar moved ${distance} m`);
    assert.ok(Math.abs(distance - moved) < 1e-9, `page ${distance}, server ${moved}`);
    if (!server.blocked) assert.ok(Math.abs(distance / (server.asked * WALK_SPEED * TICK) - 1) < 0.03, `${distance} m in ${server.asked} ticks`);
    // The camera is at the eyes of the avatar.
    await page.waitForTimeout(500);
    const eyes = await page.evaluate(() => enfilade.rig.position.toArray());
    assert.ok(Math.hypot(eyes[0] - end[0], eyes[2] - end[1]) < 0.01, "the camera follows");
    await shoot(page, "3-walked");
  },

  async "walking into a wall stops and lists a contact"({ page }) {
    await page.getByRole("tab", { name: "Contacts" }).click();
    await page.locator(".stage > canvas").focus();
    // Face the nearest object that stands still.
    await page.evaluate(async () => {
      const { app, rig, walk } = enfilade;
      const { feet } = app.avatarState(walk.name);
      const rays = Array.from({ length: 24 }, (_, i) => ({
        origin: { ...feet, y: feet.y + 1 }, direction: { x: Math.cos(i * Math.PI / 12), y: 0, z: -Math.sin(i * Math.PI / 12) },
      }));
      const { hits } = await app.connection.request("rays", { rays, throughAvatar: walk.name });
      const distance = ({ met, entity, distance }) => (met && !app.table.bodyByObject.has(entity) ? distance : Infinity);
      const nearest = hits.indexOf(hits.toSorted((a, b) => distance(a) - distance(b))[0]);
      rig.look(nearest * Math.PI / 12 - rig.yaw, -rig.pitch);
    });
    await page.keyboard.down("Shift");
    await page.keyboard.down("w");
    await page.waitForFunction(() => enfilade.app.avatarState(enfilade.walk.name)?.move?.stoppedBy > 0);
    await page.waitForFunction(() => document.querySelector(".events .touching"));
    // It slides along what it met: the list follows what stops it now.
    await page.waitForFunction(() => {
      const by = enfilade.app.avatarState(enfilade.walk.name)?.move?.stoppedByName.split("/").at(-1);
      return by && document.querySelector(".events").innerText.includes(by);
    });
    const listed = await page.evaluate(() => document.querySelector(".events").innerText);
    await page.waitForFunction(() => document.querySelector(".marker:not([hidden])"));
    await shoot(page, "4-wall");
    await page.keyboard.up("w");
    await page.keyboard.up("Shift");
    assert.match(listed, /blocked|contact/);
    const { body } = await page.evaluate(async () => {
      const { body: metrics } = await observer.client.request("metrics");
      return { body: metrics.worstPenetration };
    });
    assert.equal(body, 0, "nothing was penetrated");
  },

  async "jump, crouch, fly and third person"({ page }) {
    const state = (field) => page.evaluate((name) => enfilade.app.avatarState(enfilade.walk.name)[name], field);
    await page.locator(".stage > canvas").focus();
    await page.keyboard.press("Space");
    await page.waitForFunction(() => !enfilade.app.avatarState(enfilade.walk.name).grounded);
    await page.waitForFunction(() => enfilade.app.avatarState(enfilade.walk.name).grounded);
    await page.keyboard.press("c");
    await page.waitForFunction(() => enfilade.app.avatarState(enfilade.walk.name).height < 1.5);
    await page.waitForFunction(() => enfilade.walk.isCrouched);
    await page.keyboard.press("c");
    await page.waitForFunction(() => enfilade.app.avatarState(enfilade.walk.name).height > 1.5);
    await page.keyboard.press("f");
    await page.waitForFunction(() => enfilade.walk.isFlying);
    assert.equal(await state("flying"), true);
    await page.keyboard.press("f");
    await page.waitForFunction(() => !enfilade.walk.isFlying);
    await page.evaluate(() => enfilade.rig.look(Math.PI, 0));
    await hold(page, ["w"], 800);
    await page.keyboard.press("v");
    await page.waitForFunction(() => enfilade.rig.mode === "third");
    await page.waitForTimeout(1000);
    await shoot(page, "5-third-person");
  },

  async "a second page sees the avatar of the first one"({ page, address }) {
    const other = await openPage(address);
    await isReady(other);
    const name = await page.evaluate(() => enfilade.walk.name);
    await other.waitForFunction((who) => enfilade.app.avatarState(who), name);
    await other.getByRole("tab", { name: "Avatars" }).click();
    await other.getByRole("button", { name: "Follow" }).first().click();
    await other.waitForFunction((who) => enfilade.app.focus === who && enfilade.rig.mode === "third", name);
    const places = await Promise.all([page, other].map((one) => one.evaluate((who) => {
      const { x, y, z } = enfilade.app.avatarState(who).feet;
      return [x, y, z];
    }, name)));
    assert.deepEqual(places[0], places[1]);
    await other.getByRole("button", { name: "Leave view" }).click();
    const second = await enter(other);
    await page.waitForFunction((who) => enfilade.app.avatarState(who), second);
    await other.waitForTimeout(1000);
    await shoot(other, "6-second-page");
    assert.deepEqual(other.problems, []);
    await other.close();
    await page.waitForFunction((who) => !enfilade.app.avatarState(who), second);
  },

  async "a click on the plan walks there"({ page }) {
    // Two metres along the longest free view.
    const { before, direction } = await page.evaluate(async () => {
      const { app, walk } = enfilade;
      const feet = { ...app.avatarState(walk.name).feet };
      const rays = Array.from({ length: 24 }, (_, i) => ({
        origin: { ...feet, y: feet.y + 0.4 }, direction: { x: Math.cos(i * Math.PI / 12), y: 0, z: -Math.sin(i * Math.PI / 12) },
      }));
      const { hits } = await app.connection.request("rays", { rays, throughAvatar: walk.name });
      const distances = hits.map(({ met, distance }) => (met ? distance : 100));
      return { before: feet, direction: rays[distances.indexOf(Math.max(...distances))].direction };
    });
    const plan = await page.locator(".minimap canvas").boundingBox();
    await page.mouse.click(plan.x + plan.width / 2 + 14 * direction.x, plan.y + plan.height / 2 + 14 * direction.z);
    await page.waitForFunction(({ x, z }) => {
      const { feet } = enfilade.app.avatarState(enfilade.walk.name);
      return Math.hypot(feet.x - x, feet.z - z) > 0.3;
    }, before);
    await page.waitForTimeout(1500);
    await shoot(page, "7-plan");
  },

  async "the card of a body has its commands, and a door moves"({ page }) {
    const bodies = await page.evaluate(() => enfilade.app.welcome.scene.bodies.map(
      ({ id, kind, objects, stops, closed }) => ({ id, kind, object: objects[0], levels: [...stops.keys()], closed })));
    const byKind = new Map(bodies.map((body) => [body.kind, body]));
    const buttons = page.locator(".card > .row").first().getByRole("button", { includeHidden: true });
    const DOOR = ["Open", "Close door"];
    for (const { kind, object, levels } of byKind.values()) {
      await page.evaluate((id) => enfilade.app.select(id), object);
      const wanted = { hinged: DOOR, sliding: DOOR, path: ["Run", "Stop"] }[kind] ?? levels.map((level) => `Level ${level}`);
      assert.deepEqual(await buttons.allTextContents(), wanted, kind);
    }
    const door = byKind.get("hinged");
    await page.evaluate((id) => enfilade.app.select(id), door.object);
    const isMoving = () => page.evaluate((id) => enfilade.app.state.latest.bodies.some((body) => body.id === id), door.id);
    assert.equal(await isMoving(), false, "the door rests at first");
    await page.getByRole("button", { name: DOOR[door.closed === 0 ? 0 : 1], exact: true }).click(); // it stands at 0
    await page.waitForFunction((id) => enfilade.app.state.latest.bodies.some((body) => body.id === id), door.id);
    await page.evaluate(() => enfilade.app.select(0));
  },

  async "pause, step and play"({ page }) {
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play" }).waitFor();
    await page.waitForTimeout(600);
    const before = await page.evaluate(() => enfilade.app.tick);
    await page.getByRole("button", { name: "One tick" }).click();
    await page.waitForFunction((tick) => enfilade.app.tick === tick + 1, before);
    await page.getByRole("button", { name: "Play" }).click();
    await page.waitForFunction((tick) => enfilade.app.tick > tick + 20, before);
    assert.deepEqual(page.problems, []);
  },

  async "the page survives a restart of the server"({ page, server, restart }) {
    const before = await page.evaluate(() => ({ ...enfilade.app.avatarState(enfilade.walk.name).feet }));
    await server.stop();
    await page.getByText("The server does not reply.").waitFor();
    await shoot(page, "8-server-gone");
    await restart();
    await page.waitForFunction(() => enfilade.app.connection.isOpen && document.querySelector(".trouble").hidden);
    await page.waitForFunction(() => enfilade.walk.isWalking && enfilade.app.avatarState(enfilade.walk.name));
    const after = await page.evaluate(() => ({ ...enfilade.app.avatarState(enfilade.walk.name).feet }));
    assert.ok(Math.hypot(after.x - before.x, after.z - before.z) < 3, "the avatar is back near its old place");
  },
};

async function testLive() {
  const record = join(scratch, "walk.mcap");
  const args = ["--near-miss", "0.1", "--record", record];
  const first = await startServer(options.scene, { args });
  const address = await findAddress(first);
  const page = await openPage(address);
  await isReady(page);
  await page.waitForTimeout(1500);
  let server = first;
  const context = {
    page, address,
    get server() { return server; },
    async restart() { server = await startServer(options.scene, { port: first.port, args: ["--near-miss", "0.1"] }); },
  };
  for (const [name, test] of Object.entries(tests)) await run(name, () => test(context));
  await page.close();
  await server.stop();
  return record;
}

async function testReplay(record) {
  const server = await startServer(record);
  const page = await openPage(await findAddress(server), { width: 1100, height: 700 });
  await isReady(page);
  let marked = 0;
  await run("all events have a mark before the recording plays", async () => {
    await page.waitForFunction(() => enfilade.timeline.markedEvents > 0);
    marked = await page.evaluate(() => enfilade.timeline.markedEvents);
  });
  await run("scrubbing to a tick shows the recorded poses", async () => {
    const { first, last } = await page.evaluate(() => ({ first: Number(enfilade.app.replay.firstTick), last: Number(enfilade.app.replay.lastTick) }));
    assert.ok(last - first > 200, `${last} ticks`);
    const tick = Math.round(first + 0.3 * (last - first));
    const placesAt = async (wanted) => {
      await page.getByRole("slider").fill(String(wanted));
      await page.waitForFunction((at) => enfilade.app.tick === at && Number(enfilade.app.state.latest?.tick) === at, wanted);
      return await page.evaluate(() => enfilade.app.state.latest.avatars.map(({ name, feet }) => [name, feet.x, feet.y, feet.z]));
    };
    const once = await placesAt(tick);
    await placesAt(last - 5);
    const again = await placesAt(tick);
    assert.ok(once.length > 0);
    assert.deepEqual(once, again);
    const drawn = await page.evaluate(async () => {
      await new Promise((resolve) => setTimeout(resolve, 500));
      return enfilade.app.state.getAvatars().map(({ state, feet }) => [state.name, feet.x, feet.y, feet.z]);
    });
    assert.deepEqual(drawn, again);
  });
  await run("play brings no further events, and take over continues from there", async () => {
    await page.getByRole("combobox", { name: "Speed" }).selectOption("4");
    await page.getByRole("slider").fill("1");
    await page.getByRole("button", { name: "Play" }).click();
    await page.waitForFunction(() => enfilade.app.tick > 200);
    assert.equal(await page.evaluate(() => enfilade.timeline.markedEvents), marked);
    // A seek ends the near misses of the moment with their minima so far: these are not of the recording.
    const distances = await page.evaluate(async () => {
      const { contacts } = await enfilade.app.connection.request("recordedEvents", { afterTick: 0n });
      const minima = contacts.filter((event) => event.phase === 2 && Number(event.tick) > enfilade.app.replay.firstTick);
      for (const event of minima) await enfilade.app.connection.request("seek", { tick: event.tick - 1n });
      await enfilade.app.connection.request("seek", { tick: enfilade.app.replay.firstTick });
      return minima.map((event) => event.separation);
    });
    assert.ok(distances.length > 0, "the walk has no near miss");
    assert.equal(await page.evaluate(() => enfilade.timeline.markedEvents), marked);
    await page.getByRole("button", { name: "Play" }).click();
    await page.waitForFunction(() => enfilade.app.tick > 200);
    await page.getByRole("tab", { name: "Avatars" }).click();
    await page.getByRole("button", { name: "Follow" }).first().click();
    await page.waitForTimeout(1500);
    await page.getByRole("button", { name: "Pause" }).click();
    await shoot(page, "9-replay");
    await page.getByRole("button", { name: "Take over" }).click();
    await page.waitForFunction(() => enfilade.app.replay.branched && enfilade.walk.isWalking);
    assert.deepEqual(page.problems, []);
  });
  await page.close();
  await server.stop();
}

/** Real buildings: an IFC house with storeys, and an estate of 16,395 objects. */
async function testSharedScene(name, file, check) {
  const path = join(options.shared, file);
  if (!existsSync(path)) {
    assert.ok(!process.env.CI, `${path} is missing`);
    return console.log(`skip ${name}: ${path} is missing`);
  }
  const server = await startServer(path);
  const page = await openPage(await findAddress(server));
  const start = Date.now();
  await isReady(page);
  const seconds = ((Date.now() - start) / 1000).toFixed(1);
  await run(`${name}: the page opens without errors`, async () => {
    await tests["the page opens without errors"]({ page, picture: `scene-${name}` });
    await check(page);
    console.log(`     ready after ${seconds} s, ${await page.evaluate(() => enfilade.app.view.drawn.calls)} draw calls`);
  });
  await run(`${name}: a pick names the object that the server's ray names`, () => tests["a pick names the object that the server's ray names"]({ page }));
  await run(`${name}: the drawn ids agree with the server's picture of ids`, () => tests["the drawn ids agree with the server's picture of ids"]({ page }));
  await page.close();
  await server.stop();
}

async function testSharedScenes() {
  await testSharedScene("duplex", "duplex/Duplex_A_20110907.ifc", async (page) => {
    for (const storey of ["Level 1", "Level 2", "Roof"]) await page.getByRole("treeitem").filter({ hasText: storey }).first().waitFor();
    const storeys = await page.evaluate(() => new Set([...enfilade.app.table.byId.values()].map(({ storey }) => storey)).size);
    assert.ok(storeys >= 4, `${storeys} storeys`);
  });
  await testSharedScene("estate", "schependomlaan/schependomlaan_estate.glb", async (page) => {
    assert.equal(await page.evaluate(() => enfilade.app.table.byId.size), 16_395);
  });
}

/** A scan of a floor and one wall: the page opens with the wall in view, and not with the sky beyond the floor. */
async function testOpenScan() {
  const file = join(scratch, "open.ply");
  const corners = [[-3, 0, -3], [-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 3, -3], [-3, 3, 3]];
  writeFileSync(file, ["ply", "format ascii 1.0", `element vertex ${corners.length}`, "property float x", "property float y", "property float z",
    "element face 2", "property list uchar int vertex_indices", "property uchar red", "property uchar green", "property uchar blue", "end_header",
    ...corners.map((corner) => corner.join(" ")), "4 0 1 2 3 90 90 90", "4 0 4 5 1 20 160 60", ""].join("\n"));
  const server = await startServer(file);
  const page = await openPage(await findAddress(server));
  await isReady(page);
  await run("a scan that is open to the sides is in view", async () => {
    const forward = await page.evaluate(() => enfilade.app.view.camera.matrixWorld.elements.slice(8, 11).map((x) => -x));
    assert.ok(forward[0] < -0.8, `the view is along ${forward}`);
    await shoot(page, "open-scan");
  });
  await page.close();
  await server.stop();
}

/** A tablet: the left half of the picture walks, the right half looks. */
async function testTouch() {
  const server = await startServer(options.scene);
  const context = await browser.newContext({ viewport: { width: 1024, height: 768 }, hasTouch: true });
  const page = await context.newPage();
  page.setDefaultTimeout(LONG);
  await page.goto(await findAddress(server));
  await isReady(page);
  await run("touch walks and looks, and a button jumps", async () => {
    await page.getByRole("button", { name: "Walk", exact: true }).tap();
    await page.waitForFunction(() => enfilade.walk.isWalking && enfilade.app.avatarState(enfilade.walk.name)?.grounded);
    const getPlace = () => page.evaluate(() => {
      const { feet } = enfilade.app.avatarState(enfilade.walk.name);
      return { ...feet, yaw: enfilade.rig.yaw };
    });
    const before = await getPlace();
    const drag = (from, to, milliseconds) => page.evaluate(async ([[x0, y0], [x1, y1], wait]) => {
      const { canvas } = enfilade.app.view;
      const box = canvas.getBoundingClientRect();
      const send = (type, x, y) => canvas.dispatchEvent(new PointerEvent(type, {
        pointerId: 7, pointerType: "touch", isPrimary: true, bubbles: true, clientX: box.left + x * box.width, clientY: box.top + y * box.height, buttons: type === "pointerup" ? 0 : 1,
      }));
      send("pointerdown", x0, y0);
      for (let step = 1; step <= 5; ++step) send("pointermove", x0 + ((x1 - x0) * step) / 5, y0 + ((y1 - y0) * step) / 5);
      await new Promise((resolve) => setTimeout(resolve, wait));
      send("pointerup", x1, y1);
    }, [from, to, milliseconds]);
    await drag([0.25, 0.6], [0.25, 0.45], 1500);
    const walked = await getPlace();
    assert.ok(Math.hypot(walked.x - before.x, walked.z - before.z) > 0.3, `from ${JSON.stringify(before)} to ${JSON.stringify(walked)}`);
    await drag([0.75, 0.5], [0.6, 0.5], 100);
    const looked = await getPlace();
    assert.ok(Math.abs(looked.yaw - walked.yaw) > 0.05, `${walked.yaw} to ${looked.yaw}`);
    const jump = page.getByRole("button", { name: "Jump" });
    if (await jump.isVisible()) {
      await jump.tap();
      await page.waitForFunction((height) => enfilade.app.avatarState(enfilade.walk.name).feet.y > height + 0.1, looked.y);
    }
    await shoot(page, "touch");
  });
  await context.close();
  await server.stop();
}

async function testWithoutWebGl() {
  const server = await startServer(options.scene);
  const page = await browser.newPage();
  await page.addInitScript(() => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
      return kind === "webgl2" ? null : getContext.call(this, kind, ...more);
    };
  });
  await page.goto(await findAddress(server));
  await run("without WebGL 2 the page says so", () => page.getByRole("alert").filter({ hasText: "WebGL 2" }).waitFor());
  await page.close();
  await server.stop();
}

async function testToken() {
  const tokens = join(scratch, "tokens");
  writeFileSync(tokens, "observe see-only-0123456789\ndrive may-walk-0123456789\n", { mode: 0o600 });
  const server = await startServer(options.scene, { args: ["--token-file", tokens] });
  const page = await openPage(await findAddress(server));
  await run("a token is asked for, and its role is respected", async () => {
    const field = page.getByPlaceholder("Token");
    await field.fill("wrong-token-00000");
    await field.press("Enter");
    await page.getByText("needs a token").waitFor();
    await field.fill("see-only-0123456789");
    await field.press("Enter");
    await isReady(page);
    await page.waitForFunction(() => document.querySelector(".trouble").hidden);
    assert.ok(await page.getByRole("button", { name: "Walk", exact: true }).isDisabled(), "an observer cannot walk");
  });
  await page.close();
  await server.stop();
}

let failures = 0;
async function run(name, test) {
  if (options.only && !name.includes(options.only)) return;
  const start = Date.now();
  try {
    await test();
    console.log(`ok   ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failures;
    console.log(`FAIL ${name}: ${error.stack}`);
    await Promise.allSettled(browser.contexts().flatMap((one) => one.pages()).map((page, index) => shoot(page, `failed-${failures}-${index}`)));
  }
}

try {
  const record = await testLive();
  await testReplay(record);
  await testToken();
  await testSharedScenes();
  await testOpenScan();
  await testTouch();
  await testWithoutWebGl();
} catch (error) {
  ++failures;
  console.log(`FAIL ${error.stack}`);
} finally {
  for (const cleanup of cleanups) await cleanup();
}
process.exit(failures === 0 ? 0 : 1);
