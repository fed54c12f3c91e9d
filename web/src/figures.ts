/** What is drawn of a view: robots, obstacles, targets, paths, a swarm's cloud, the closest pair, the grid. */
import * as THREE from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import type { Actor, Closest, Cloud, Geometry, Obstacle, Part, Robot, Target } from "./data";
import { intervalAt, matrixOf, Motion, type Placement, unpack, unpackShares } from "./kinematics";
import { costColor, SCENE, scaleColor, type SceneColors, type Theme, toneColor } from "./palette";
import { fadedDisc, gridLines, manySpheres, merged, type Solid, Solids, triad, vector } from "./solids";

const VEIL_VERTEX = `
varying vec3 vNormal;
varying vec3 vToEye;
void main() {
  vec4 at = vec4(position, 1.0);
  vec3 turned = normal;
  #ifdef USE_INSTANCING
    at = instanceMatrix * at;
    turned = mat3(instanceMatrix) * turned;
  #endif
  vec4 seen = modelViewMatrix * at;
  vNormal = normalMatrix * turned;
  vToEye = -seen.xyz;
  gl_Position = projectionMatrix * seen;
}`;
const VEIL_FRAGMENT = `
uniform vec3 color;
uniform float face;
uniform float rim;
varying vec3 vNormal;
varying vec3 vToEye;
void main() {
  float square = abs(dot(normalize(vNormal), normalize(vToEye)));
  float away = 1.0 - square;
  gl_FragColor = vec4(color * (0.7 + 0.3 * square), face + rim * away * away);
  #include <colorspace_fragment>
}`;

/** Darkens a material towards its outline, so that round shapes stand out from a ground of their own colour. */
function rimmed<M extends THREE.Material>(material: M): M {
  const rim = "outgoingLight *= mix(0.58, 1.0, smoothstep(0.0, 0.42, abs(dot(normalize(normal), normalize(vViewPosition)))));\n";
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace("#include <opaque_fragment>", rim + "#include <opaque_fragment>");
  };
  return material;
}

/** The materials of a scene; they are made anew for another theme. */
export class Materials {
  readonly colors: SceneColors;
  readonly solids: THREE.Material[]; // in turn along the chain: links that share a surface at a joint do not flicker
  readonly edges: THREE.LineBasicMaterial;
  readonly faded: THREE.MeshBasicMaterial;
  readonly fadedLines: THREE.LineBasicMaterial;
  readonly triad: THREE.Material;
  readonly inner: THREE.Material; // of a triad that is seen through what is around it
  readonly depth: THREE.Material; // draws the depth of a veil, so that only its outer face is seen
  private readonly made: THREE.Material[] = [];

  constructor(readonly theme: Theme) {
    this.colors = SCENE[theme];
    this.solids = [1, 3].map((polygonOffsetFactor) => {
      const offset = { polygonOffset: true, polygonOffsetFactor, polygonOffsetUnits: 1 };
      return this.keep(rimmed(new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0, ...offset })));
    });
    this.edges = this.keep(new THREE.LineBasicMaterial({ color: this.colors.edge, transparent: true, opacity: this.colors.edgeOpacity, depthWrite: false }));
    this.faded = this.keep(new THREE.MeshBasicMaterial({ vertexColors: true, transparent: true, side: THREE.DoubleSide, depthWrite: false }));
    this.fadedLines = this.keep(new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
    this.depth = this.veil("#000000", 1, 0);
    Object.assign(this.depth, { colorWrite: false, depthWrite: true });
    this.inner = this.keep(new THREE.MeshBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.75, depthTest: false }));
    this.triad = this.keep(new THREE.MeshBasicMaterial({ vertexColors: true }));
  }

  private keep<M extends THREE.Material>(material: M): M {
    this.made.push(material);
    return material;
  }

  /** Draws every second link deeper by a length, in the depth buffer's resolution [m]. */
  part(shift: number, resolution: number): void {
    this.solids[1].polygonOffsetUnits = Math.min(1e5, Math.max(1, shift / resolution));
  }

  /** Opaque, of one colour, for instanced spheres. */
  plain(color: THREE.Color): THREE.Material {
    return this.keep(rimmed(new THREE.MeshStandardMaterial({ color, roughness: 0.62, metalness: 0 })));
  }

  /** Seen through, denser towards the rim: `face` is the opacity where it is looked at squarely, `rim` what is added at its outline. */
  veil(color: string, face: number, rim: number): THREE.Material {
    const uniforms = { color: { value: new THREE.Color(color) }, face: { value: face }, rim: { value: rim } };
    return this.keep(new THREE.ShaderMaterial({ uniforms, vertexShader: VEIL_VERTEX, fragmentShader: VEIL_FRAGMENT, transparent: true, depthWrite: false }));
  }

  lines(color: string, opacity: number): THREE.Material {
    return this.keep(new THREE.LineBasicMaterial({ color, transparent: true, opacity, depthWrite: false }));
  }

  dispose(): void {
    for (const material of this.made) material.dispose();
  }
}

/** How a robot's or an obstacle's shapes look: as they are, as a veil of one colour, or as a veil over something else. */
type Look = { kind: "solid"; turn: number } | { kind: "veil"; material: THREE.Material; edges: THREE.Material | null; order: number };

interface Coloured {
  name: string; // what the pointer tells
  geometry: Geometry;
  color: THREE.Color;
  own: boolean; // whether a mesh's own colours are taken
}

/** Of a drawn mesh: the names of its triangles, as the number of the first one that is no more of it. */
export interface Named {
  names: { name: string; before: number }[];
}

/** Draws shapes into a group: one mesh and one set of edges for all solids, one instanced mesh for each sphere set. */
function addShapes(group: THREE.Object3D, shapes: Coloured[], solids: Solids, materials: Materials, look: Look): void {
  const pieces: { solid: Solid; color: THREE.Color; own: boolean }[] = [];
  const named: Named = { names: [] };
  let triangles = 0;
  for (const shape of shapes) {
    const solid = solids.of(shape.geometry);
    if (solid) {
      pieces.push({ ...shape, solid });
      triangles += solid.positions.length / 9;
      named.names.push({ name: shape.name, before: triangles });
    } else if (shape.geometry.kind === "spheres") {
      const [centers, radii] = [unpack(shape.geometry.centers), unpack(shape.geometry.radii)];
      if (radii.length === 0) continue;
      if (look.kind === "solid") group.add(cast(manySpheres(centers, radii, materials.plain(shape.color)), { names: [{ name: shape.name, before: Infinity }] }));
      else group.add(...[materials.depth, look.material].map((material, i) => ordered(manySpheres(centers, radii, material), look.order + i)));
    }
  }
  if (pieces.length === 0) return;
  const { faces, edges } = merged(pieces);
  if (look.kind === "solid") {
    group.add(cast(new THREE.Mesh(faces, materials.solids[look.turn % 2]), named));
    if (edges.getAttribute("position").count) group.add(new THREE.LineSegments(edges, materials.edges));
    return;
  }
  group.add(ordered(new THREE.Mesh(faces, materials.depth), look.order), ordered(new THREE.Mesh(faces, look.material), look.order + 1));
  if (look.edges && edges.getAttribute("position").count) group.add(ordered(new THREE.LineSegments(edges, look.edges), look.order + 2));
}

function cast<T extends THREE.Object3D>(object: T, named: Named): T {
  object.castShadow = object.receiveShadow = true;
  object.userData = named;
  return object;
}

function ordered<T extends THREE.Object3D>(object: T, order: number): T {
  object.renderOrder = order;
  return object;
}

const PANEL = /panel|solar|array|wing|sail/i;
const PAYLOAD = /payload|grasped|cargo|held/i;
const TOOL = /tool|gripper|hand|finger|effector|grapple|camera|jaw/i;

/** A calm colour for a link: light and grey in turn along the chain; base, panels, tool and payload have their own. */
function linkColor(part: Part, names: string[], colors: SceneColors): THREE.Color {
  if (PANEL.test(part.name)) return new THREE.Color(colors.panel);
  if (TOOL.test(part.name)) return new THREE.Color(colors.tool);
  if (part.held || PAYLOAD.test(part.name)) return new THREE.Color(colors.payload);
  if (part.joint < 0) return new THREE.Color(colors.base);
  return new THREE.Color(colors.links[names.indexOf(part.name) % 2]);
}

/** A robot in the scene. */
export class Body {
  readonly root = new THREE.Group();
  readonly motion: Motion;
  placement: Placement;
  private readonly nodes: THREE.Object3D[] = []; // the base's, then the joints'
  private readonly layers: { visuals: THREE.Object3D[]; shapes: THREE.Object3D[]; veil: THREE.Object3D[] } = { visuals: [], shapes: [], veil: [] };
  private readonly boxes: { part: Part; box: THREE.Box3 }[] = [];

  constructor(readonly actor: Actor, readonly robot: Robot, solids: Solids, private readonly materials: Materials) {
    this.motion = new Motion(robot, actor.knots);
    this.placement = this.motion.at(this.motion.start);
    for (let i = -1; i < robot.joints.length; i++) {
      const node = new THREE.Group();
      node.matrixAutoUpdate = false;
      this.nodes.push(node);
      this.root.add(node);
    }
    if (actor.ghost) this.addGhost(solids);
    else this.addSolid(solids);
    this.measure(solids);
    this.place(this.motion.start);
  }

  private addSolid(solids: Solids): void {
    const { materials, robot } = this;
    const { colors, theme } = materials;
    this.addLayer(this.layers.visuals, robot.visuals, solids, { kind: "solid", turn: 0 });
    this.addLayer(this.layers.shapes, robot.shapes, solids, { kind: "solid", turn: 0 });
    if (!robot.visuals.length) return;
    const veil = materials.veil(colors.envelope, theme === "light" ? 0.06 : 0.08, 0.55);
    const key = (part: Part) => `${part.joint} ${JSON.stringify(part.geometry)}`;
    const drawn = new Set(robot.visuals.map(key)); // a veil over the same shape would only tint it
    this.addLayer(this.layers.veil, robot.shapes.filter((part) => !drawn.has(key(part))), solids, { kind: "veil", material: veil, edges: materials.lines(colors.envelope, 0.35), order: 20 });
  }

  private addGhost(solids: Solids): void {
    const { materials, robot } = this;
    const tone = toneColor(this.actor.tone, materials.theme);
    const arm: Look = { kind: "veil", material: materials.veil(tone, 0.24, 0.6), edges: materials.lines(tone, 0.6), order: 10 };
    const base: Look = { kind: "veil", material: materials.veil(tone, 0.035, 0.16), edges: materials.lines(tone, 0.55), order: 10 };
    for (const [layer, parts] of [[this.layers.visuals, robot.visuals], [this.layers.shapes, robot.shapes]] as const) {
      this.addLayer(layer, parts.filter((part) => part.joint >= 0), solids, arm);
      this.addLayer(layer, parts.filter((part) => part.joint < 0), solids, base);
    }
  }

  private addLayer(layer: THREE.Object3D[], parts: Part[], solids: Solids, look: Look): void {
    const names = [...new Set(parts.filter((part) => part.joint >= 0).map((part) => part.name))];
    this.nodes.forEach((node, i) => {
      const own = parts.filter((part) => part.joint === i - 1);
      if (!own.length) return;
      const group = new THREE.Group();
      const shapes = own.map((part) => ({ name: `link ${part.name}`, geometry: part.geometry, color: stated(part.color) ?? linkColor(part, names, this.materials.colors), own: !part.color }));
      addShapes(group, shapes, solids, this.materials, look.kind === "solid" ? { ...look, turn: layer.length } : look);
      node.add(group);
      layer.push(group);
    });
  }

  private measure(solids: Solids): void {
    for (const part of this.robot.visuals.length ? this.robot.visuals : this.robot.shapes) {
      const box = boxOf(part.geometry, solids);
      if (!box.isEmpty()) this.boxes.push({ part, box });
    }
  }

  place(t: number): void {
    this.placement = this.motion.at(t);
    this.nodes.forEach((node, i) => {
      node.matrix.fromArray(i ? this.placement.joints[i - 1] : this.placement.base);
      node.matrixWorldNeedsUpdate = true;
    });
  }

  /** Hides what stands where the other body has the same part: a ghost would only tint it. */
  hideWhere(other: Body, near: number): void {
    this.nodes.forEach((node, i) => {
      const [a, b] = [node.matrix.elements, other.nodes[i]?.matrix.elements];
      const same = b && a.every((value, k) => Math.abs(value - b[k]) < (k >= 12 ? near : 2e-3));
      node.visible = !(same && this.robot === other.robot);
    });
  }

  tip(t: number): THREE.Matrix4 {
    return new THREE.Matrix4().fromArray(this.motion.tip(t));
  }

  /** Shows visuals and shapes; the shapes are a veil over visuals. */
  show(visuals: boolean, shapes: boolean): void {
    const drawn = this.robot.visuals.length > 0;
    const plain = drawn ? shapes && !visuals : shapes || visuals; // a robot without visuals has its shapes for them
    for (const group of this.layers.visuals) group.visible = visuals;
    for (const group of this.layers.shapes) group.visible = plain;
    for (const group of this.layers.veil) group.visible = shapes && visuals;
  }

  /** Corners of the boxes of the links that joints move, and the tip, at an instant, in the world. */
  corners(t: number): THREE.Vector3[] {
    const placement = this.motion.at(t);
    const points = this.boxes.filter(({ part }) => part.joint >= 0).flatMap(({ part, box }) => {
      const matrix = new THREE.Matrix4().fromArray(placement.joints[part.joint]);
      return cornersOf(box).map((point) => point.applyMatrix4(matrix));
    });
    return [...points, new THREE.Vector3().setFromMatrixPosition(this.tip(t))];
  }

  /** Points along the arm, now: what names keep off. */
  spine(): THREE.Vector3[] {
    const { placement, robot } = this;
    const place = (m: ArrayLike<number>) => new THREE.Vector3(m[12], m[13], m[14]);
    const ends: [THREE.Vector3, THREE.Vector3][] = robot.joints.flatMap(({ parent }, i) => (parent < 0 ? [] : [[place(placement.joints[parent]), place(placement.joints[i])]]));
    if (robot.tip.joint >= 0) ends.push([place(placement.joints[robot.tip.joint]), place(this.motion.tip(0, placement))]);
    return ends.flatMap(([a, b]) => [0, 0.2, 0.4, 0.6, 0.8, 1].map((share) => a.clone().lerp(b, share)));
  }

  /** The boxes of the base's parts in the world, from the beginning to the end of the motion. */
  baseParts(): THREE.Box3[] {
    const { start, end, moving } = this.motion;
    return this.boxes.filter(({ part }) => part.joint < 0).map(({ box }) => {
      const whole = new THREE.Box3();
      for (const t of moving ? [start, (start + end) / 2, end] : [start]) whole.union(box.clone().applyMatrix4(new THREE.Matrix4().fromArray(this.motion.base(t))));
      return whole;
    });
  }

  /** Points that are worth seeing at an instant: the tip and the joints' frames. */
  watched(t: number): THREE.Vector3[] {
    const placement = this.motion.at(t);
    const tip = this.motion.tip(t, placement);
    return [tip, tip, ...placement.joints].map((m) => new THREE.Vector3(m[12], m[13], m[14])); // the tip counts twice
  }

  /** The boxes of the base's shapes in the base's frame at an instant, and the way into it from the world. */
  baseBoxes(t: number): { box: THREE.Box3; inverse: THREE.Matrix4 }[] {
    const inverse = new THREE.Matrix4().fromArray(this.motion.base(t)).invert();
    return this.boxes.filter(({ part }) => part.joint < 0).map(({ box }) => ({ box, inverse }));
  }

  /** The links by name: the frame that each rides on, the middle of its first shape there, and its size. */
  links(): { name: string; joint: number; middle: THREE.Vector3; size: number }[] {
    const found = new Map<string, { name: string; joint: number; middle: THREE.Vector3; size: number }>();
    for (const { part, box } of this.boxes) {
      const size = box.getSize(new THREE.Vector3()).length();
      const known = found.get(part.name);
      if (!known || known.size < size) found.set(part.name, { name: part.name, joint: part.joint, middle: box.getCenter(new THREE.Vector3()), size });
    }
    return [...found.values()];
  }

  /** A point of a joint's moving frame (-1: the base's), now, in the world. */
  point(joint: number, at: THREE.Vector3): THREE.Vector3 {
    return at.clone().applyMatrix4(this.nodes[joint + 1].matrix);
  }
}

/** A CSS colour of a robot's file, or undefined where there is none. */
function stated(color: string | undefined): THREE.Color | undefined {
  return color ? new THREE.Color(color) : undefined;
}

export function cornersOf(box: THREE.Box3): THREE.Vector3[] {
  const { min, max } = box;
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => new THREE.Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
}

/** The box of a shape in its owner's frame; empty for a half-space. */
export function boxOf(shape: Geometry, solids: Solids): THREE.Box3 {
  const box = new THREE.Box3();
  if (shape.kind === "spheres") {
    const [centers, radii] = [unpack(shape.centers), unpack(shape.radii)];
    for (let i = 0; i < radii.length; i++) {
      const center = new THREE.Vector3().fromArray(centers, 3 * i);
      box.union(new THREE.Box3().setFromCenterAndSize(center, new THREE.Vector3().setScalar(2 * radii[i])));
    }
  } else if (shape.kind !== "halfspace") box.setFromArray(solids.of(shape)!.positions);
  return box;
}

/** An obstacle in the scene; a half-space is a large faded plane with lines. */
export class Thing {
  readonly root = new THREE.Group();
  readonly box = new THREE.Box3();
  readonly boxes: THREE.Box3[] = []; // of its parts
  readonly planes: { normal: THREE.Vector3; offset: number }[] = [];

  constructor(readonly obstacle: Obstacle, solids: Solids, materials: Materials) {
    const { colors } = materials;
    const color = new THREE.Color(PANEL.test(obstacle.name) ? colors.panel : colors.obstacle);
    addShapes(this.root, obstacle.parts.map((geometry) => ({ name: obstacle.name, geometry, color, own: true })), solids, materials, { kind: "solid", turn: 0 });
    for (const part of obstacle.parts) {
      const box = boxOf(part, solids);
      if (!box.isEmpty()) this.boxes.push(box);
      this.box.union(box);
      if (part.kind === "halfspace") this.planes.push(plane(part.normal, part.offset));
    }
  }

  /** Draws the half-spaces' faces near a place. */
  addPlanes(center: THREE.Vector3, radius: number, materials: Materials, floor: number | undefined): void {
    const color = new THREE.Color(materials.colors.obstacle);
    for (const { normal, offset } of this.planes) {
      const group = new THREE.Group();
      group.add(ordered(new THREE.Mesh(fadedDisc(2.4 * radius, color, 0.34), materials.faded), -2));
      const lines = gridLines(0, 0, 2.4 * radius, niceStep(radius / 4), new THREE.Color(materials.colors.grid), 0.4, 1);
      if (offset !== floor) group.add(ordered(new THREE.LineSegments(lines, materials.fadedLines), -1)); // the floor has the grid
      group.position.copy(center).addScaledVector(normal, offset - normal.dot(center));
      group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
      this.root.add(group);
    }
  }
}

function plane(normal: number[], offset: number): { normal: THREE.Vector3; offset: number } {
  const length = Math.hypot(normal[0], normal[1], normal[2]) || 1;
  return { normal: vector(normal).divideScalar(length), offset: offset / length };
}

/** 1, 2 or 5 times a power of ten, not below x. */
export function niceStep(x: number): number {
  const power = 10 ** Math.floor(Math.log10(x));
  return ([1, 2, 5].find((digit) => digit * power >= x * 0.999) ?? 10) * power;
}

/** A line of a width in pixels, through points, with a colour for each or one for all. */
export function wideLine(points: Float32Array, colors: Float32Array | null, color: string, width: number, opacity = 1, dashed = 0): Line2 {
  const geometry = new LineGeometry();
  geometry.setPositions(points);
  if (colors) geometry.setColors(colors);
  const material = new LineMaterial({ color: colors ? "#ffffff" : color, linewidth: width, vertexColors: colors !== null, transparent: opacity < 1, opacity });
  if (dashed) Object.assign(material, { dashed: true, dashSize: dashed, gapSize: dashed });
  const line = new Line2(geometry, material);
  if (dashed) line.computeLineDistances();
  return line;
}

/** The way of the tip: pale as a whole, strong as far as it has come. */
export class Path {
  readonly root = new THREE.Group();
  readonly fastest: number = 0; // m/s
  private readonly t: Float64Array;
  private readonly passed: Line2;

  constructor(body: Body, theme: Theme, bySpeed: boolean, of: "tip" | "base") {
    const { motion } = body;
    const count = Math.max(161, Math.min(481, 24 * (motion.q.t.length - 1) + 1));
    this.t = Float64Array.from({ length: count }, (_, i) => motion.start + ((motion.end - motion.start) * i) / (count - 1));
    const points = new Float32Array(3 * count);
    this.t.forEach((t, i) => points.set((of === "tip" ? motion.tip(t) : motion.base(t)).slice(12, 15), 3 * i));
    const colors = bySpeed ? new Float32Array(3 * count) : null;
    if (colors) this.fastest = speedColors(points, this.t, colors, theme);
    const tone = of === "base" ? SCENE[theme].basePath : toneColor(body.actor.tone, theme);
    const ghost = body.actor.ghost;
    this.root.add(ordered(wideLine(points, colors, tone, ghost ? 1.2 : 1.6, ghost ? 0.55 : 0.45), 5));
    this.passed = ordered(wideLine(points, colors, tone, ghost ? 1.8 : 3), 6);
    this.root.add(this.passed);
    if (of === "base") for (const line of this.root.children as Line2[]) Object.assign(line.material, { depthTest: false, transparent: true });
    this.seek(motion.start);
  }

  seek(t: number): void {
    const last = this.t.length - 1;
    const whole = t >= this.t[last] ? last : t <= this.t[0] ? 0 : intervalAt(this.t, t) + 1;
    this.passed.geometry.instanceCount = whole;
    this.passed.visible = whole > 0;
  }
}

/** Colours of points by their speed; returns the greatest [m/s]. */
function speedColors(points: Float32Array, t: Float64Array, colors: Float32Array, theme: Theme): number {
  const count = t.length;
  const speeds = Array.from({ length: count }, (_, i) => {
    const [a, b] = [Math.max(0, i - 1), Math.min(count - 1, i + 1)];
    return Math.hypot(...[0, 1, 2].map((k) => points[3 * b + k] - points[3 * a + k])) / Math.max(t[b] - t[a], 1e-12);
  });
  const fastest = Math.max(...speeds);
  const color = new THREE.Color();
  speeds.forEach((speed, i) => color.setRGB(...scaleColor(speed / (fastest || 1), theme), THREE.SRGBColorSpace).toArray(colors, 3 * i));
  return fastest;
}

/** A target: its axes where it is a pose, a sphere of its tolerance, and a ring that is always seen. */
export function targetMark(target: Target, size: number, materials: Materials): THREE.Group {
  const group = new THREE.Group();
  const tone = target.name.toLowerCase().startsWith("start") ? materials.colors.start : materials.colors.goal;
  group.applyMatrix4(new THREE.Matrix4().fromArray(matrixOf(target.T)));
  if (target.kind !== "position") {
    const axes = new THREE.Mesh(triad(materials.colors.axes), materials.triad);
    axes.scale.setScalar(0.085 * size);
    group.add(axes);
  }
  const radius = Math.max(target.radius, 0.007 * size);
  group.add(ordered(new THREE.Mesh(new THREE.SphereGeometry(radius, 24, 16), materials.veil(tone, 0.4, 0.3)), 8));
  for (const turn of [[0, 0], [Math.PI / 2, 0], [0, Math.PI / 2]]) {
    const ring = new THREE.EllipseCurve(0, 0, 0.03 * size, 0.03 * size).getPoints(48).flatMap((p) => [p.x, p.y, 0]);
    const line = wideLine(new Float32Array(ring), null, tone, 1.6);
    line.rotation.set(turn[0], turn[1], 0);
    group.add(line);
  }
  return group;
}

/** The particles of a swarm at an iteration, with those of a few iterations before, fainter. */
export class Particles {
  readonly points: THREE.Points;
  readonly box: THREE.Box3;
  private static readonly TAIL = 4;
  private readonly places: Float32Array;
  private readonly values: ArrayLike<number> | null;
  private readonly perIteration: number;
  private readonly iterations: number; // sets of points
  private readonly at: ArrayLike<number> | null; // the instants of the sets

  constructor(cloud: Cloud, private readonly clock: { duration: number; step?: number }, private readonly theme: Theme) {
    this.places = unpackShares(cloud.points, cloud.low, cloud.high);
    this.values = cloud.value ? unpack(cloud.value) : null;
    this.at = cloud.at ? unpack(cloud.at) : null;
    this.iterations = this.at?.length ?? Math.max(1, Math.round(clock.duration / (clock.step || 1)) + 1);
    this.perIteration = Math.floor(this.places.length / 3 / this.iterations);
    this.box = new THREE.Box3(vector(cloud.low), vector(cloud.high));
    const geometry = new THREE.BufferGeometry();
    const room = this.perIteration * (Particles.TAIL + 1);
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * room), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(4 * room), 4));
    this.points = new THREE.Points(geometry, dots(6.5));
    this.points.frustumCulled = false;
    this.points.renderOrder = 7;
    this.seek(0);
  }

  /** Some of the points, for the camera: all of the first set, which is the widest, and a share of the others. */
  some(): THREE.Vector3[] {
    const out: THREE.Vector3[] = [];
    const step = Math.max(1, Math.floor(this.places.length / 3 / 500));
    for (let i = 0; i < this.places.length / 3; i += i < this.perIteration ? 1 : step) out.push(new THREE.Vector3().fromArray(this.places, 3 * i));
    return out;
  }

  seek(t: number): void {
    const now = this.at ? lastAt(this.at, t) : Math.min(this.iterations - 1, Math.max(0, Math.round(t / (this.clock.step || 1))));
    const [positions, colors] = [this.points.geometry.getAttribute("position"), this.points.geometry.getAttribute("color")];
    const color = new THREE.Color();
    let at = 0;
    for (let back = Math.min(now, Particles.TAIL); back >= 0; back--) {
      for (let i = (now - back) * this.perIteration; i < (now - back + 1) * this.perIteration; i++) {
        positions.setXYZ(at, this.places[3 * i], this.places[3 * i + 1], this.places[3 * i + 2]);
        color.setRGB(...costColor(this.values ? this.values[i] / 255 : 0, this.theme), THREE.SRGBColorSpace);
        colors.setXYZW(at++, color.r, color.g, color.b, back ? 0.34 / back : 1);
      }
    }
    this.points.geometry.setDrawRange(0, at);
    positions.needsUpdate = colors.needsUpdate = true;
  }
}

/** The last of ascending instants that is not after t; 0 before the first. */
function lastAt(instants: ArrayLike<number>, t: number): number {
  let [low, high] = [0, instants.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (instants[middle] <= t + 1e-9) low = middle;
    else high = middle;
  }
  return low;
}

let disc: THREE.Texture | null = null; // one for all

/** Round points of a size in pixels with colours. */
function dots(size: number): THREE.PointsMaterial {
  if (!disc) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 32;
    const context = canvas.getContext("2d")!;
    context.fillStyle = "#ffffff";
    context.arc(16, 16, 14, 0, 2 * Math.PI);
    context.fill();
    disc = new THREE.CanvasTexture(canvas);
  }
  return new THREE.PointsMaterial({ size, map: disc, sizeAttenuation: false, vertexColors: true, transparent: true, depthWrite: false, alphaTest: 0.02 });
}

/** The closest pair at an instant: a line between two dots, seen through everything. */
export class ClosestPair {
  readonly root = new THREE.Group();
  readonly middle = new THREE.Vector3();
  distance = 0;
  name = "";
  private readonly t: ArrayLike<number>;
  private readonly distances: ArrayLike<number>;
  private readonly points: ArrayLike<number>;
  private readonly pairs: ArrayLike<number>;
  private readonly line: Line2;
  private readonly ends: THREE.Points;

  constructor(private readonly closest: Closest, color: string) {
    [this.t, this.distances, this.points, this.pairs] = [closest.t, closest.distance, closest.points, closest.pair].map(unpack);
    this.line = ordered(wideLine(new Float32Array(6), null, color, 2.4), 30);
    this.line.material.depthTest = false;
    this.line.material.transparent = true; // drawn after what is opaque
    const geometry = new THREE.BufferGeometry();
    const rgb = new THREE.Color(color);
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6), 3));
    geometry.setAttribute("color", new THREE.Float32BufferAttribute([rgb.r, rgb.g, rgb.b, 1, rgb.r, rgb.g, rgb.b, 1], 4));
    const material = dots(9);
    material.depthTest = false;
    this.ends = ordered(new THREE.Points(geometry, material), 31);
    this.line.frustumCulled = this.ends.frustumCulled = false;
    this.root.add(this.line, this.ends);
    this.seek(0);
  }

  /** Takes the pair at t: between two samples of the same pair in proportion, else the nearer one. */
  seek(t: number): void {
    if (this.t.length === 0) return;
    const i = intervalAt(this.t, t);
    const j = Math.min(i + 1, this.t.length - 1);
    let share = j > i && this.t[j] > this.t[i] ? Math.min(1, Math.max(0, (t - this.t[i]) / (this.t[j] - this.t[i]))) : 0;
    if (this.pairs[i] !== this.pairs[j]) share = Math.round(share);
    const between = (values: ArrayLike<number>, n: number, k: number) => values[n * i + k] + share * (values[n * j + k] - values[n * i + k]);
    this.distance = between(this.distances, 1, 0);
    this.name = this.closest.names[this.pairs[share < 0.5 ? i : j]] ?? "";
    const ends = [0, 1, 2, 3, 4, 5].map((k) => between(this.points, 6, k));
    this.root.visible = ends.every(Number.isFinite);
    if (!this.root.visible) return;
    this.line.geometry.setPositions(ends);
    this.ends.geometry.getAttribute("position").array.set(ends);
    this.ends.geometry.getAttribute("position").needsUpdate = true;
    this.middle.set((ends[0] + ends[3]) / 2, (ends[1] + ends[4]) / 2, (ends[2] + ends[5]) / 2);
  }
}

/** A length in words: "12.4 mm", "1.35 m". */
export function lengthText(x: number): string {
  if (!Number.isFinite(x)) return "–";
  const mm = Math.abs(1000 * x);
  const text = mm < 9.995 ? `${mm.toFixed(2)} mm` : mm < 99.95 ? `${mm.toFixed(1)} mm` : mm < 999.5 ? `${mm.toFixed(0)} mm` : `${(mm / 1000).toFixed(2)} m`;
  return x < 0 && Number(text.split(" ")[0]) > 0 ? `\u2212${text}` : text;
}
