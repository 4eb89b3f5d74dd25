// Tests of the page of a recording in Chromium: one file, no server, no network.
//   node replay_page_test.mjs --server build/enfilade [--scene FILE.glb] [--walk FILE.jsonl] [--out FOLDER] [--chromium PATH]
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { parseArgs } from "node:util";
import { launchBrowser, LONG, runTests } from "./harness.mjs";

const { values: options } = parseArgs({
  options: {
    server: { type: "string" }, scene: { type: "string", default: "build/assets/building.glb" },
    walk: { type: "string", default: "assets/tour.jsonl" }, out: { type: "string", default: "out/page" },
    chromium: { type: "string", default: "/usr/bin/chromium" },
  },
});
assert.ok(options.server, "--server names the program");
mkdirSync(options.out, { recursive: true });
const scratch = mkdtempSync(join(tmpdir(), "enfilade-replay-"));
const recording = join(scratch, "tour.mcap");
const file = join(scratch, "tour.html");
const run = (...args) => execFileSync(options.server, args, { stdio: ["ignore", "pipe", "ignore"] }).toString();

run("replay", options.scene, options.walk, "--out", join(scratch, "out"), "--record", recording, "--record-channels", "foxglove", "--record-frames", "0");
run("export", recording, "--out", join(scratch, "texts"));
const report = JSON.parse(run("export", recording, "--html", file));
const lines = (name) => readFileSync(join(scratch, "texts", name), "utf8").trim().split("\n");
const contacts = lines("contacts.jsonl").map((line) => JSON.parse(line));

const browser = await launchBrowser(options.chromium);
const page = await browser.newPage({ viewport: { width: 1200, height: 760 } });
page.setDefaultTimeout(LONG);
const problems = [];
const requests = [];
page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
page.on("pageerror", (error) => problems.push(error.message));
page.on("request", (request) => requests.push(request.url()));
await page.goto(pathToFileURL(file).href);
const shoot = (name) => page.screenshot({ path: join(options.out, `${name}.png`), timeout: LONG });

/** The eyes of an avatar after a tick, as `export --out` writes them: metres. */
function recordedEyes(avatar, tick) {
  const line = lines(`${avatar}.tum`).find((one) => !one.startsWith("#") && Math.abs(Number(one.split(" ")[0]) - tick / 60) < 1e-6);
  return line.split(" ").slice(1, 4).map(Number);
}

const tests = {
  async "the file opens without errors, and requests nothing"() {
    await page.waitForFunction(() => globalThis.enfilade?.app.model && enfilade.app.state.latest);
    assert.deepEqual(problems, []);
    const foreign = requests.filter((url) => !/^(file|blob|data):/.test(url));
    assert.deepEqual(foreign, []);
    assert.equal(await page.evaluate(() => enfilade.app.replay.lastTick.toString()), String(report.ticks));
  },

  async "scrubbing to a tick shows the recorded poses"() {
    for (const tick of [1200, 300, 3000]) {
      const shown = await page.evaluate(async (wanted) => {
        const slider = document.querySelector("input[type=range]");
        slider.value = String(wanted);
        slider.dispatchEvent(new Event("input"));
        slider.dispatchEvent(new Event("change"));
        while (enfilade.app.tick !== wanted) await new Promise((resolve) => setTimeout(resolve, 10));
        return enfilade.app.state.latest.avatars.map(({ name, feet, eyeHeight }) => ({ name, eyes: [feet.x, feet.y + eyeHeight, feet.z] }));
      }, tick);
      assert.ok(shown.length >= 5, `${shown.length} avatars`);
      for (const { name, eyes } of shown) {
        const recorded = recordedEyes(name, tick);
        eyes.forEach((value, axis) => assert.ok(Math.abs(value - recorded[axis]) < 1e-9, `${name}, tick ${tick}: ${value} instead of ${recorded[axis]}`));
      }
    }
  },

  async "all events have a mark, and a mark leads to its tick"() {
    const events = contacts.filter(({ event, normal }) => event === "blocked" || event === "near" || event === "enter" || (event === "begin" && (normal?.[1] ?? 0) > -0.7));
    assert.equal(await page.evaluate(() => enfilade.timeline.markedEvents), events.length);
    assert.ok(events.length > 10, `${events.length}`);
    await page.evaluate(() => document.querySelector(".mark.touching").click());
    const first = events.find(({ event }) => event === "begin").tick;
    await page.waitForFunction((tick) => enfilade.app.tick === tick, first);
    const active = await page.evaluate(() => enfilade.contacts.liveCount);
    const live = new Set();
    for (const { event, a, b, tick: at } of contacts) {
      if (at > first) break;
      if (event === "begin") live.add(`${a} ${b}`);
      if (event === "end") live.delete(`${a} ${b}`);
    }
    assert.equal(active, live.size);
  },

  async "the recording plays, and an avatar can be followed"() {
    await page.getByRole("tab", { name: "Avatars" }).click();
    await page.getByRole("listitem").filter({ hasText: "ann" }).getByRole("button", { name: "Follow" }).click();
    const before = await page.evaluate(() => enfilade.app.tick);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await page.waitForFunction((from) => enfilade.app.tick > from + 60, before);
    await page.getByRole("button", { name: "Pause", exact: true }).click();
    await page.waitForTimeout(800); // the still picture
    await shoot("replay-followed");
    assert.equal(await page.getByRole("button", { name: "Walk", exact: true }).count(), 0);
  },

  async "pictures and licences are in the file"() {
    await page.getByRole("tab", { name: "Pictures" }).click();
    assert.equal(await page.locator(".pictures li").count(), report.pictures);
    await page.locator(".pictures button").nth(6).click();
    await page.waitForTimeout(800);
    await shoot("replay-pictures");
    await page.getByRole("tab", { name: "About" }).click();
    assert.match(await page.locator(".licences").textContent(), /three .*MIT/);
    assert.deepEqual(problems, []);
  },
};

const failures = await runTests(tests, (number) => shoot(`replay-failed-${number}`).catch(() => {}));
await browser.close();
rmSync(scratch, { recursive: true });
process.exit(failures > 0 ? 1 : 0);
