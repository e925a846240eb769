// What the browser remembers. A browser that remembers nothing works as well.

const KEY = "vastlight";

function read() {
  try {
    const value = JSON.parse(localStorage.getItem(KEY) ?? "{}");
    return value && typeof value === "object" ? value : {};
  } catch {
    return {};
  }
}

const known = read();

export function recall(name, otherwise) {
  return known[name] ?? otherwise;
}

export function remember(name, value) {
  known[name] = value;
  try {
    localStorage.setItem(KEY, JSON.stringify(known));
  } catch {
    // No place, or not allowed.
  }
}
