// Numbers of the server and of the page.
import type { App } from "../app";
import { makeElement, makeFacts } from "./dom";
import { formatLength } from "./format";

const SECONDS = 1; // between requests while the panel is visible

export class MetricsPanel {
  readonly root = makeElement("div", { class: "stack" });
  #facts = makeElement("dl", { class: "facts" });
  #app: App;
  #frames = 0;

  constructor(app: App) {
    this.#app = app;
    this.root.append(this.#facts, makeElement("p", { class: "quiet" },
      "The page contains open-source packages: ", makeElement("a", { href: "/page/licenses.txt", target: "_blank" }, "licences"), "."));
    app.view.updaters.push(() => {
      ++this.#frames;
      return false;
    });
    setInterval(() => void this.#ask(), SECONDS * 1000);
  }

  async #ask(): Promise<void> {
    const frames = this.#frames;
    this.#frames = 0;
    const { connection, welcome } = this.#app;
    if (this.root.offsetParent === null || document.hidden || !connection.isOpen || !welcome) return;
    try {
      const metrics = await connection.request("metrics", {});
      const { drawn } = this.#app.view;
      const { tick } = metrics;
      this.#facts.replaceChildren(...makeFacts([
        ["Scene", `${welcome.scene?.source ?? ""}, ${welcome.scene?.objects ?? 0} objects`],
        ["World", `${welcome.world}, server ${welcome.serverVersion}`],
        ["Clients", String(metrics.clients)],
        ["Avatars", String(metrics.avatars)],
        ["Tick time, median", `${((tick?.medianUs ?? 0) / 1000).toFixed(2)} ms`],
        ["Tick time, 99 %", `${((tick?.p99Us ?? 0) / 1000).toFixed(2)} ms`],
        ["Ticks", `${metrics.ticks} (${Math.round(metrics.ticksPerSecond)} per second of work)`],
        ["Contacts now", String(metrics.liveContacts)],
        ["Worst penetration", metrics.worstPenetration === 0 ? "0 (never)" : formatLength(metrics.worstPenetration)],
        ["Recording", metrics.recording ? `${metrics.recording.ticks} ticks, ${(Number(metrics.recording.bytes) / 1e6).toFixed(1)} MB` : "none"],
        ["Page", `${frames} frames/s, ${drawn.triangles.toLocaleString("en")} triangles, ${drawn.calls} draw calls`],
        ["Server draws with", welcome.renderer || "nothing"],
      ]));
    } catch {
      // The connection reports its own end.
    }
  }
}
