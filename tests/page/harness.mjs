// Code that the tests of this folder share.

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
