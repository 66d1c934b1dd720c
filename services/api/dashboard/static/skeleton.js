// Draws the 21 keypoints of a label over its picture. Everything comes from the label itself.
const SVG = "http://www.w3.org/2000/svg";
const BEHIND_CAMERA = 0;
const VISIBLE = 3;

const main = document.querySelector("main[data-skeleton]");
const BONES = main ? JSON.parse(main.dataset.skeleton) : [];

const waiting = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    waiting.unobserve(entry.target);
    draw(entry.target);
  }
}, { rootMargin: "200px" });

export function watchSkeletons() {
  for (const svg of document.querySelectorAll("svg[data-labels]:not([data-watched])")) {
    svg.dataset.watched = "";
    waiting.observe(svg);
  }
}

async function draw(svg) {
  const response = await fetch(svg.dataset.labels);
  if (!response.ok) return;
  const { keypoints, width_px: width } = await response.json();
  if (!keypoints) return;
  const radius = width / 85;
  const bones = BONES.filter((bone) => bone.every((point) => placed(keypoints[point])));
  svg.replaceChildren(
    ...bones.map(([a, b]) => line(keypoints[a], keypoints[b], "halo")),
    ...bones.map(([a, b]) => line(keypoints[a], keypoints[b], finger(b))),
    ...keypoints.flatMap((point, number) => (placed(point) ? [dot(point, number, radius)] : [])),
  );
}

function placed(point) {
  return point.image_px !== null && point.visibility !== BEHIND_CAMERA;
}

function finger(number) {
  return number === 0 ? "palm" : `finger-${Math.floor((number - 1) / 4)}`;
}

function line(a, b, name) {
  return shape("line", { x1: a.image_px[0], y1: a.image_px[1], x2: b.image_px[0], y2: b.image_px[1], class: name });
}

function dot(point, number, radius) {
  const hidden = point.visibility === VISIBLE ? "" : " hidden-point";
  return shape("circle", { cx: point.image_px[0], cy: point.image_px[1], r: radius, class: finger(number) + hidden });
}

function shape(name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}
