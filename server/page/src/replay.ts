// The page of a recording in one file. Its data are blocks in the file: base64, compressed by gzip.
import type { App } from "./app";
import { button, element } from "./panels/dom";
import { clockTime } from "./panels/format";
import { startPage } from "./page";
import type { Tab } from "./panels/panel";
import { RecordedWorld, splitMessages } from "./world/recorded_world";
import type { Timeline } from "./panels/timeline";

interface Picture {
  avatar: string;
  tick: number;
  time: number; // seconds
  format: string; // "jpeg", "png"
  data: string; // base64
}

function textOf(name: string): string {
  const block = document.getElementById(`enfilade-${name}`);
  if (!block) throw new Error(`The file is damaged: it has no block '${name}'.`);
  return block.textContent ?? "";
}

async function unpack(name: string): Promise<ArrayBuffer> {
  const packed = Uint8Array.from(atob(textOf(name).trim()), (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return await new Response(stream).arrayBuffer();
}

function makePictures(pictures: Picture[], timeline: Timeline): Tab {
  const enlarged = element("img", { class: "picture", alt: "", hidden: true });
  const list = element("ul", { class: "pictures", label: "Recorded pictures" });
  for (const { avatar, tick, time, format, data } of pictures) {
    const name = `${avatar}, ${clockTime(time)}`;
    const image = element("img", { src: `data:image/${format};base64,${data}`, alt: name, loading: "lazy" });
    const show = () => {
      timeline.goToTick(tick);
      enlarged.src = image.src;
      enlarged.alt = name;
      enlarged.hidden = false;
    };
    const row = button("", show, { title: `Go to ${clockTime(time)}` });
    row.append(image, element("span", {}, name));
    list.append(element("li", {}, row));
  }
  return { name: "Pictures", content: element("div", { class: "stack" }, enlarged, list) };
}

function makeAbout(about: [string, string][]): Tab {
  return {
    name: "About",
    content: element(
      "div", { class: "stack" },
      element("dl", { class: "facts" }, ...about.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)])),
      element("details", {}, element("summary", {}, "Licences of the packages in this page"), element("pre", { class: "licences" }, textOf("licenses"))),
    ),
  };
}

async function begin(): Promise<void> {
  const messages = splitMessages(new Uint8Array(await unpack("messages")));
  const pictures = JSON.parse(textOf("pictures")) as Picture[];
  const about = JSON.parse(textOf("about")) as [string, string][];
  startPage({
    makeSource: (listener) => new RecordedWorld(listener, messages, () => unpack("scene")),
    furtherTabs: (_app: App, timeline) => [
      ...(pictures.length > 0 ? [makePictures(pictures, timeline)] : []), makeAbout(about),
    ],
  });
}

begin().catch((error: Error) => {
  document.body.append(element("p", { class: "trouble", role: "alert" }, `The recording cannot be shown: ${error.message}`));
});
