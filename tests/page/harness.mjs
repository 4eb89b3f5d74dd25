// Code that the tests of this folder share.
import { existsSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

export const LONG = 90_000; // milliseconds: software rendering on a busy machine is slow

export function launchBrowser(executablePath) {
  return chromium.launch({
    executablePath,
    args: ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--no-sandbox"],
  });
}

/** Our own scenes and, if the folder is there, the shared ones. Under CI its absence is a failure. */
export function listScenes(own, folder, shared) {
  if (existsSync(folder)) return [...own, ...shared.map((name) => join(folder, name))];
  if (process.env.CI) throw new Error(`${folder} is missing`);
  console.log(`skipped  ${folder} is missing: our own scenes only`);
  return own;
}

/** The line with which `enfilade serve` says that it is ready. */
export function awaitReady(child) {
  return new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (data) => {
      text += data;
      if (text.includes("\n")) resolve(JSON.parse(text.split("\n")[0]));
    });
    child.once("exit", (code) => reject(new Error(`the server ended with ${code}`)));
  });
}

/** Runs tests, given by name, one after another, and returns how many failed. */
export async function runTests(tests, onFailure = async () => {}) {
  let failures = 0;
  for (const [name, test] of Object.entries(tests)) {
    try {
      await test();
      console.log(`ok      ${name}`);
    } catch (error) {
      failures += 1;
      console.log(`FAILED  ${name}\n${error.stack}`);
      await onFailure(failures);
    }
  }
  return failures;
}
