// Looks for what people cannot use: controls without a name, doubled ids, text with too little contrast (WCAG 2.2, 4.5 : 1).
window.inaccessible = () => {
  const problems = [];
  let checked = 0;
  const shown = (node) => node.checkVisibility({ checkVisibilityCSS: true }) && node.getClientRects().length > 0;
  const named = (node) =>
    [node.getAttribute("aria-label"), ...(node.getAttribute("aria-labelledby") ?? "").split(" ").map((id) => document.getElementById(id)?.textContent),
      ...[...(node.labels ?? [])].map((label) => label.textContent), node.tagName === "INPUT" ? "" : node.textContent].some((name) => name?.trim());
  for (const node of document.querySelectorAll("button, input, select, textarea, summary, a[href], canvas, progress, [role=progressbar], dialog, fieldset, img")) {
    checked += 1;
    if (node.tagName === "IMG" ? !node.hasAttribute("alt") : !named(node)) problems.push(`no name: ${node.outerHTML.slice(0, 120)}`);
  }
  const ids = [...document.querySelectorAll("[id]")].map((node) => node.id);
  for (const id of new Set(ids)) if (ids.filter((other) => other === id).length > 1) problems.push(`twice: ${id}`);
  for (const label of document.querySelectorAll("label[for]")) if (!document.getElementById(label.htmlFor)) problems.push(`label for nothing: ${label.htmlFor}`);
  if (!document.documentElement.lang || !document.title || document.querySelectorAll("h1").length !== 1 || document.querySelectorAll("main").length !== 1) problems.push("language, title, h1 or main");

  const numbers = (color) => (color.match(/[\d.]+/g) ?? []).map(Number);
  const light = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const behind = (node) => {
    for (let at = node; at; at = at.parentElement) {
      const color = numbers(getComputedStyle(at).backgroundColor);
      if (color.length === 3 || color[3] === 1) return color;
    }
    return [255, 255, 255];
  };
  for (const node of document.querySelectorAll("body *")) {
    const text = [...node.childNodes].some((child) => child.nodeType === 3 && child.textContent.trim());
    if (!text || !shown(node) || node.closest(".visually-hidden, .skip, :disabled, canvas")) continue;
    checked += 1;
    const [a, b] = [light(numbers(getComputedStyle(node).color)), light(behind(node))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) problems.push(`contrast ${contrast.toFixed(2)}: ${node.tagName} ${node.textContent.trim().slice(0, 40)}`);
  }
  return { problems, checked };
};
