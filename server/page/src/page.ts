// Puts the page together: of a live world, or of a recording in a file.
import { App } from "./app";
import { Avatars } from "./view/avatars";
import { CameraRig } from "./view/camera_rig";
import { Contacts } from "./panels/contacts";
import { isTyping, makeButton, makeElement, setText } from "./panels/dom";
import { Input } from "./walk/input";
import { MetricsPanel } from "./panels/metrics";
import { Minimap } from "./panels/minimap";
import { renderIds } from "./view/offscreen";
import { makeHelp, makeTabs, makeToasts, makeTroubleDialog, type Tab } from "./panels/panel";
import { People } from "./panels/people";
import { Card, computeRay, pick } from "./panels/pick";
import { makeShareLink, readSharedView } from "./panels/share";
import type { MakeSource } from "./world/source";
import { proposeStarts } from "./walk/start_place";
import "./style.css";
import { Timeline } from "./panels/timeline";
import { Tree } from "./panels/tree";
import { NoWebGl } from "./view/view";
import { Walk } from "./walk/walk";

interface PageOptions {
  makeSource: MakeSource;
  /** Keeps the token that the user typed. */
  rememberToken?: (token: string) => void;
  /** Panels after those of every page. */
  furtherTabs?: (app: App, timeline: Timeline) => Tab[];
}

function begin({ makeSource, rememberToken, furtherTabs }: PageOptions): void {
  const app = new App(makeSource);
  const { isFile } = app.connection;
  const { view } = app;
  const input = new Input(view.canvas);
  const rig = new CameraRig(app, input);
  const walk = new Walk(app, input, rig);
  const avatars = new Avatars(app, rig);
  const card = new Card(app, rig, walk);
  const contacts = new Contacts(app, rig);
  const minimap = new Minimap(app, rig, walk);
  const timeline = new Timeline(app, walk);

  const title = makeElement("span", { class: "scene-name" });
  const walkButton = makeButton("Walk", () => (walk.isWalking ? walk.leave() : void walk.start()), { class: "primary" });
  const flyButton = makeButton("Fly", () => walk.act("fly"), { title: "Fly (F)" });
  const crouchButton = makeButton("Crouch", () => walk.act("crouch"), { title: "Crouch (C)" });
  // Touch screens have no space bar.
  const jumpButton = makeButton("Jump", () => walk.act("jump"), { class: "touch-only" });
  const viewButton = makeButton("Third person", () => toggleView(), { title: "First or third person (V)" });
  const header = makeElement(
    "header", { class: "top" },
    makeElement("strong", {}, "Enfilade"), title, makeElement("span", { class: "spacer" }), walkButton, jumpButton, flyButton, crouchButton, viewButton,
    makeButton("Screenshot", () => void saveScreenshot(), { title: "Save the picture" }),
    makeButton("Share", () => void share(), { title: "Copy a link to this view", hidden: isFile }),
  );
  const panel = makeTabs([
    { name: "Objects", content: new Tree(app).root }, { name: "Contacts", content: contacts.root },
    { name: "Avatars", content: new People(app, rig, walk, avatars).root },
    ...(isFile ? [] : [{ name: "Server", content: new MetricsPanel(app).root }]),
    ...(furtherTabs?.(app, timeline) ?? []),
    { name: "Keys", content: makeHelp(isFile) },
  ]);
  const fold = makeButton("☰", () => document.body.classList.toggle("folded"), { class: "fold", label: "Show or hide the panel" });
  header.append(fold);
  const trouble = makeTroubleDialog(app, (token) => {
    rememberToken?.(token);
    app.connection.token = token;
    void app.connection.open();
  });
  const stage = makeElement("main", { class: "stage" }, view.canvas, contacts.labels, card.root, minimap.root, makeToasts(app), trouble);
  view.canvas.setAttribute("aria-label", "View of the scene");
  document.body.append(header, stage, panel, timeline.root);

  function toggleView(): void {
    if (app.focus) rig.setMode(rig.mode === "first" ? "third" : "first");
  }

  function updateButtons(): void {
    setText(walkButton, walk.isStarting ? "Entering …" : walk.isWalking ? "Leave" : "Walk");
    walkButton.hidden = isFile;
    walkButton.disabled = walk.isStarting || (!walk.isWalking && !walk.canWalk) || !app.model;
    for (const one of [jumpButton, flyButton, crouchButton]) one.hidden = !walk.isWalking;
    flyButton.setAttribute("aria-pressed", String(walk.isFlying));
    crouchButton.setAttribute("aria-pressed", String(walk.isCrouched));
    viewButton.hidden = !app.focus;
    setText(viewButton, rig.mode === "first" ? "Third person" : "First person");
  }

  async function saveScreenshot(): Promise<void> {
    const link = makeElement("a", { href: URL.createObjectURL(await view.screenshot()), download: `enfilade-tick-${app.tick}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  async function share(): Promise<void> {
    const link = makeShareLink(rig, app.tick);
    history.replaceState(null, "", link);
    try {
      await navigator.clipboard.writeText(link);
      app.say("The link to this view is copied.");
    } catch {
      app.say("The link to this view is in the address bar.");
    }
  }

  input.onLook = (yaw, pitch) => rig.look(yaw, pitch);
  input.onZoom = (steps) => rig.zoom(steps);
  input.onClick = (x, y) => {
    const picked = pick(app, avatars, x, y);
    card.setPlace(picked);
    app.select(picked?.entity ?? 0);
  };
  input.onAction = (action) => {
    if (action === "walk" && !walk.isWalking) void walk.start();
    else if (action === "view") toggleView();
    else if (action === "pause") timeline.toggle();
    else if (action === "leave") (app.selection ? app.select(0) : walk.leave());
    else walk.act(action);
  };
  window.addEventListener("keydown", (event) => {
    if (event.code === "KeyM" && !isTyping(event) && !event.ctrlKey) input.toggleLock();
  });
  walk.onChanged = rig.onModeChanged = updateButtons;
  app.focused.listen(updateButtons);
  app.timeChanged.listen(updateButtons);

  let isFirstScene = true;
  app.sceneLoaded.listen((model) => {
    setText(title, app.welcome?.scene?.source ?? "");
    document.title = `${app.welcome?.scene?.source ?? "Scene"} – Enfilade`;
    if (model.withoutEntity > 0) app.say(`${model.withoutEntity} meshes of the file belong to no object and are not shown.`);
    const shared = isFirstScene ? readSharedView() : null;
    isFirstScene = false;
    if (shared) {
      Object.assign(rig, { yaw: shared.yaw, pitch: shared.pitch });
      rig.position.copy(shared.position);
      if (shared.tick !== null && app.replay) timeline.goToTick(shared.tick);
      return;
    }
    const start = proposeStarts(model, null)[0];
    if (!start) return rig.showBox(model.bounds);
    rig.position.copy(start.feet).setY(start.feet.y + 1.6);
    rig.lookAlong(start.facing);
  });
  app.opened.listen(() => {
    updateButtons();
    view.invalidate();
  });
  updateButtons();
  // For tests: they compare the page with the server's own replies.
  Object.assign(window, {
    enfilade: {
      app, rig, walk, contacts, timeline,
      pick: (x: number, y: number) => pick(app, avatars, x, y),
      computeRay: (x: number, y: number) => computeRay(app, x, y),
      ids: (width: number, height: number) => renderIds(view.renderer, app.model!, view.camera, width, height),
    },
  });
  void app.connection.open();
}

export function startPage(options: PageOptions): void {
  try {
    begin(options);
  } catch (error) {
    const text = error instanceof NoWebGl
      ? "This browser offers no WebGL 2, which the page needs to draw. Enable hardware acceleration, or use a current Firefox, Chrome, Edge or Safari."
      : `The page could not start: ${(error as Error).message}`;
    document.body.append(makeElement("p", { class: "trouble", role: "alert" }, text));
  }
}
