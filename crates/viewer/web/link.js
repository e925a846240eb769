// The connection to the server: commands go out, pictures and news come in, and it comes back when it breaks.

const CONFIRMATION = 1;
const COMMAND = 2;
const PICTURE = 1;
const HEADER = 24;
const LONGEST_WAIT = 5000;

export class Link extends EventTarget {
  #socket = null;
  #wait = 250;
  #encoder = new TextEncoder();
  #decoder = new TextDecoder();
  #drawn = Promise.resolve();
  ended = false;
  received = 0;

  constructor(token) {
    super();
    this.token = token;
    this.#open();
  }

  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  // Sends a command; says whether there was somebody to send it to.
  send(command) {
    if (!this.isOpen) return false;
    const text = this.#encoder.encode(JSON.stringify(command));
    const message = new Uint8Array(text.length + 1);
    message[0] = COMMAND;
    message.set(text, 1);
    this.#socket.send(message);
    return true;
  }

  #confirm(frame) {
    if (!this.isOpen) return;
    const message = new DataView(new ArrayBuffer(5));
    message.setUint8(0, CONFIRMATION);
    message.setUint32(1, frame, true);
    this.#socket.send(message.buffer);
  }

  #open() {
    const address = new URL("ws", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    address.search = new URLSearchParams({ token: this.token });
    address.hash = "";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#wait = 250;
      this.#tell("online");
    };
    socket.onmessage = ({ data }) => this.#take(data);
    socket.onclose = () => this.#lost(socket);
    this.#socket = socket;
  }

  #lost(socket) {
    if (socket !== this.#socket) return;
    this.#tell("offline", { ended: this.ended });
    setTimeout(() => this.#open(), this.#wait);
    this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT);
  }

  #take(data) {
    this.received += data.byteLength;
    if (new Uint8Array(data, 0, 1)[0] === PICTURE) {
      // One after the other, in the order in which they came.
      this.#drawn = this.#drawn.then(() => this.#picture(data)).catch((error) => console.error(error));
      return;
    }
    const news = JSON.parse(this.#decoder.decode(new Uint8Array(data, 1)));
    if (news.kind === "closed") this.ended = true;
    if (news.kind === "hello") this.ended = false;
    this.#tell(news.kind, news);
  }

  async #picture(data) {
    const header = new DataView(data, 0, HEADER);
    const number = header.getUint32(4, true);
    const isFinal = header.getUint8(2) === 1;
    const type = header.getUint8(1) === 1 ? "image/png" : "image/jpeg";
    const blob = new Blob([new Uint8Array(data, HEADER)], { type });
    try {
      const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
      this.#tell("picture", {
        bitmap,
        number,
        isFinal,
        bytes: data.byteLength,
        input: header.getUint32(8, true),
        spp: header.getUint32(12, true),
        size: [header.getUint16(16, true), header.getUint16(18, true)],
        full: [header.getUint16(20, true), header.getUint16(22, true)],
      });
      bitmap.close();
    } finally {
      this.#confirm(number);
    }
  }

  #tell(kind, detail = {}) {
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}
