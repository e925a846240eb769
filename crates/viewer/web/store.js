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

// What goes from one server to the next is a cookie: these know no ports, and every server has its own.
const COOKIE = "vastlight_settings";
const YEAR = 365 * 24 * 3600;

export function recallSettings() {
  const found = document.cookie.split("; ").find((pair) => pair.startsWith(`${COOKIE}=`));
  try {
    const value = JSON.parse(decodeURIComponent(found?.slice(COOKIE.length + 1) ?? "{}"));
    return value && typeof value === "object" ? value : {};
  } catch {
    return {};
  }
}

export function rememberSetting(name, value) {
  const text = encodeURIComponent(JSON.stringify({ ...recallSettings(), [name]: value }));
  document.cookie = `${COOKIE}=${text}; Path=/; Max-Age=${YEAR}; SameSite=Strict`;
}
