// The window that opens scenes: demos, and files of the shared folder.

import { bytes } from "./plots.js";

export class Scenes {
  constructor(link, open) {
    this.link = link;
    this.open = open;
    this.dialog = document.getElementById("scenes");
    link.addEventListener("hello", ({ detail }) => this.#hello(detail));
    link.addEventListener("files", ({ detail }) => this.#list(detail.listing));
  }

  show() {
    if (this.hasFolder) this.link.send({ do: "files", folder: this.folder ?? "" });
    this.dialog.showModal();
  }

  #hello({ demos, folder }) {
    this.hasFolder = folder;
    document.getElementById("folder-part").hidden = !folder;
    const list = document.getElementById("demos");
    list.replaceChildren(...demos.map((name) => this.#entry(name, () => this.#choose(`demo:${name}`))));
  }

  #list({ folder, folders, files, cut }) {
    this.folder = folder;
    const inside = (name) => (folder ? `${folder}/${name}` : name);
    const entries = [];
    if (folder) entries.push(this.#entry("↑ Up", () => this.#enter(folder.split("/").slice(0, -1).join("/"))));
    for (const name of folders) entries.push(this.#entry(`${name}/`, () => this.#enter(inside(name))));
    for (const file of files) entries.push(this.#entry(file.name, () => this.#choose(inside(file.name)), bytes(file.bytes)));
    if (entries.length === 0) entries.push(Object.assign(document.createElement("li"), { textContent: "No scenes here." }));
    if (cut) entries.push(Object.assign(document.createElement("li"), { textContent: "There is more than is listed." }));
    document.getElementById("files").replaceChildren(...entries);
    document.getElementById("folder-title").textContent = folder ? `Files in ${folder}` : "Files";
  }

  #enter(folder) {
    this.link.send({ do: "files", folder });
  }

  #choose(source) {
    this.dialog.close();
    this.open(source);
  }

  #entry(text, act, note) {
    const item = document.createElement("li");
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: text });
    button.addEventListener("click", act);
    if (note) button.append(Object.assign(document.createElement("small"), { textContent: note }));
    item.append(button);
    return item;
  }
}
