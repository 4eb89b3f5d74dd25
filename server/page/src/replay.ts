// The page of a recording in one file. Its data are blocks in the file: base64, compressed by gzip.
import type { App } from "./app";
import { makeButton, makeElement, makeFacts } from "./panels/dom";
import { formatTime } from "./panels/format";
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

function readBlock(name: string): string {
  const block = document.getElementById(`enfilade-${name}`);
  if (!block) throw new Error(`The file is damaged: it has no block '${name}'.`);
  return block.textContent ?? "";
}

async function unpack(name: string): Promise<ArrayBuffer> {
  const packed = Uint8Array.from(atob(readBlock(name).trim()), (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return await new Response(stream).arrayBuffer();
}

function makePictures(pictures: Picture[], timeline: Timeline): Tab {
  const enlarged = makeElement("img", { class: "picture", alt: "", hidden: true });
  const list = makeElement("ul", { class: "pictures", label: "Recorded pictures" });
  for (const { avatar, tick, time, format, data } of pictures) {
    const name = `${avatar}, ${formatTime(time)}`;
    const image = makeElement("img", { src: `data:image/${format};base64,${data}`, alt: name, loading: "lazy" });
    const show = () => {
      timeline.goToTick(tick);
      enlarged.src = image.src;
      enlarged.alt = name;
      enlarged.hidden = false;
    };
    const row = makeButton("", show, { title: `Go to ${formatTime(time)}` });
    row.append(image, makeElement("span", {}, name));
    list.append(makeElement("li", {}, row));
  }
  return { name: "Pictures", content: makeElement("div", { class: "stack" }, enlarged, list) };
}

function makeAbout(about: [string, string][]): Tab {
  return {
    name: "About",
    content: makeElement(
      "div", { class: "stack" },
      makeElement("dl", { class: "facts" }, ...makeFacts(about)),
      makeElement("details", {}, makeElement("summary", {}, "Licences of the packages in this page"), makeElement("pre", { class: "licences" }, readBlock("licenses"))),
    ),
  };
}

async function begin(): Promise<void> {
  const messages = splitMessages(new Uint8Array(await unpack("messages")));
  const pictures = JSON.parse(readBlock("pictures")) as Picture[];
  const about = JSON.parse(readBlock("about")) as [string, string][];
  startPage({
    makeSource: (listener) => new RecordedWorld(listener, messages, () => unpack("scene")),
    furtherTabs: (_app: App, timeline) => [
      ...(pictures.length > 0 ? [makePictures(pictures, timeline)] : []), makeAbout(about),
    ],
  });
}

begin().catch((error: Error) => {
  document.body.append(makeElement("p", { class: "trouble", role: "alert" }, `The recording cannot be shown: ${error.message}`));
});
