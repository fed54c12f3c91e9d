/** The 3-D picture of a view: scene, camera, layers that can be switched. It draws when something has changed, and only then. */
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Page, View } from "./data";
import { Body, ClosestPair, cornersOf, lengthText, Materials, type Named, niceStep, Particles, Path, targetMark, Thing } from "./figures";
import { Motion } from "./kinematics";
import { type Label, Overlay } from "./overlay";
import { costColor, scaleColor, SCENE, SIGNALS, type Theme, toneColor } from "./palette";
import { gridLines, Solids, triad, vector } from "./solids";

export type Toggle = "visuals" | "shapes" | "path" | "basePath" | "axes" | "names" | "closest" | "ghosts" | "targets" | "cloud" | "grid";
export type Viewpoint = "top" | "front" | "side" | "corner" | "tool";

const TOGGLES: Toggle[] = ["visuals", "shapes", "path", "basePath", "axes", "names", "closest", "ghosts", "targets", "cloud", "grid"];
const FROM: Record<Exclude<Viewpoint, "tool">, [number, number, number]> = {
  top: [0, -0.0005, 1],
  front: [1, 0, 0],
  side: [0, -1, 0],
  corner: [0.62, -1, 0.62],
};
// from which the corner is chosen: the first from which most of the motion is seen
const CORNERS = [[0.62, -1, 0.62], [-0.62, -1, 0.62], [1, -0.62, 0.62], [-1, -0.62, 0.62], [1, 0.62, 0.62], [-1, 0.62, 0.62], [0.62, 1, 0.62], [-0.62, 1, 0.62], [0.62, -1, 1.1], [0.62, 1, 1.1]];
const FOV = 28;
const TOOL_FOV = 60;
const NEAR = 2; // times the size of the arm's motion: what is further away may be cut off by the picture's border
const MOST_NAMES = 12; // of obstacles: more are shown only when asked for

/** What a view has in the scene. */
interface Content {
  view: View;
  bodies: Body[];
  motions: Motion[];
  things: Thing[];
  paths: { path: Path; ghost: boolean }[];
  basePath: Path | null;
  closest: ClosestPair | null;
  cloud: Particles | null;
  triads: { tip: THREE.Mesh; base: THREE.Mesh; body: Body }[];
  targets: THREE.Group;
  grid: THREE.Group;
  points: THREE.Vector3[]; // that the camera has to see
  sphere: THREE.Sphere; // around them
  everything: THREE.Sphere;
  labels: { label: Label; toggles: Toggle[]; follow?: () => THREE.Vector3 | undefined }[];
  distanceLabel: Label | null;
  gridNote: string;
  corner: THREE.Vector3; // where the picture is first looked at from
}

export class Stage {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly camera = new THREE.PerspectiveCamera(FOV, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly overlay: Overlay;
  private readonly solids: Solids;
  private readonly key = new THREE.DirectionalLight();
  private readonly fill = new THREE.DirectionalLight();
  private readonly chosen: Partial<Record<Toggle, boolean>> = {};
  private readonly state = {} as Record<Toggle, boolean>;
  private scene = new THREE.Scene();
  private materials: Materials;
  private content: Content | null = null;
  private time = 0;
  private frame = 0;
  private from: Viewpoint | null = "corner"; // null once the user has moved the camera
  private toolUp = new THREE.Vector3();
  private hovering = 0;
  private readonly ray = new THREE.Raycaster();
  private readonly resized: ResizeObserver;

  /** Whether the browser has what the picture needs. */
  static available(): boolean {
    try {
      const context = document.createElement("canvas").getContext("webgl2");
      context?.getExtension("WEBGL_lose_context")?.loseContext();
      return context !== null;
    } catch {
      return false;
    }
  }

  constructor(readonly canvas: HTMLCanvasElement, readonly page: Page, private theme: Theme) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true, powerPreference: "low-power" });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.autoClear = false;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false; // made anew when something has moved, not when the camera has
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.solids = new Solids(page);
    this.materials = new Materials(theme);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("start", () => this.leave());
    this.controls.addEventListener("change", () => this.request());
    this.overlay = new Overlay(canvas, (axis) => this.look((["front", "side", "top"] as const)[axis]));
    this.overlay.fit(canvas, theme);
    this.resized = new ResizeObserver(() => this.resize());
    this.resized.observe(canvas);
    canvas.addEventListener("webglcontextrestored", () => this.request());
    canvas.addEventListener("pointermove", this.hover);
    canvas.addEventListener("pointerleave", this.hover);
    canvas.addEventListener("dblclick", this.centre);
  }

  get closest(): { name: string; distance: number } | null {
    const pair = this.content?.closest;
    return pair ? { name: pair.name, distance: pair.distance } : null;
  }

  show(view: View): void {
    this.build(view);
    this.time = 0;
    this.from = "corner";
    this.resize();
    this.seek(0);
  }

  seek(t: number): void {
    this.time = t;
    const { content } = this;
    if (!content) return;
    for (const body of content.bodies) body.place(t);
    const [first] = content.bodies;
    for (const body of content.bodies) if (body.actor.ghost) body.hideWhere(first, 2e-3 * this.size);
    for (const { path } of content.paths) path.seek(t);
    content.basePath?.seek(t);
    content.cloud?.seek(t);
    content.closest?.seek(t);
    for (const { tip, base, body } of content.triads) {
      set(tip, body.tip(t), 0.11 * this.size);
      set(base, new THREE.Matrix4().fromArray(body.placement.base), 0.13 * this.size);
    }
    this.writeDistance();
    this.renderer.shadowMap.needsUpdate = true;
    this.request();
  }

  has(toggle: Toggle): boolean {
    const { content } = this;
    if (!content) return false;
    const { view, bodies } = content;
    switch (toggle) {
      case "visuals":
        return bodies.some((body) => body.robot.visuals.length > 0);
      case "shapes":
        return bodies.some((body) => body.robot.shapes.length > 0);
      case "path":
        return content.paths.length > 0;
      case "basePath":
        return content.basePath !== null;
      case "axes":
        return bodies.length > 0;
      case "names":
        return content.labels.some(({ toggles }) => toggles[0] === "names");
      case "closest":
        return content.closest !== null;
      case "ghosts":
        return view.actors.some((actor) => actor.ghost);
      case "targets":
        return view.targets.length > 0;
      case "cloud":
        return content.cloud !== null;
      case "grid":
        return true;
    }
  }

  get(toggle: Toggle): boolean {
    return this.state[toggle] ?? false;
  }

  set(toggle: Toggle, on: boolean): void {
    this.chosen[toggle] = on;
    this.switch();
    this.request();
  }

  look(from: Viewpoint): void {
    this.from = from;
    const { content } = this;
    if (from === "tool" && content) {
      const { x, y } = axesOf(this.toolMatrix());
      const [a, b] = Math.abs(x.z) >= Math.abs(y.z) ? [x, 0] : [y, 1];
      this.toolUp.set(b ? 0 : 1, b ? 1 : 0, 0).multiplyScalar(a.z < 0 ? -1 : 1);
    }
    this.fit();
    this.request();
  }

  setTheme(theme: Theme): void {
    if (theme === this.theme) return;
    this.theme = theme;
    this.overlay.fit(this.canvas, theme);
    if (this.content) this.build(this.content.view);
    this.seek(this.time);
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.overlay.fit(this.canvas, this.theme);
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.from) this.fit();
    this.request();
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    cancelAnimationFrame(this.hovering);
    this.canvas.removeEventListener("pointermove", this.hover);
    this.canvas.removeEventListener("pointerleave", this.hover);
    this.canvas.removeEventListener("dblclick", this.centre);
    this.resized.disconnect();
    this.controls.dispose();
    this.overlay.dispose();
    this.clear();
    this.materials.dispose();
    this.renderer.dispose();
  }

  tip(actor: number, t: number): number[] {
    return Array.from(this.content!.motions[actor].tip(t));
  }

  draw(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    const { content, camera } = this;
    if (!content) return;
    if (this.from === "tool") this.ride();
    const distance = camera.position.distanceTo(content.everything.center);
    camera.near = Math.max(distance - 1.05 * content.everything.radius, 0.004 * this.size);
    camera.far = distance + 1.05 * content.everything.radius + 3 * this.size;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    const eye = camera.position.distanceTo(content.sphere.center);
    this.materials.part(0.0012 * this.size, (eye * eye) / (camera.near * 2 ** 24));
    clear(this.renderer, SCENE[this.theme].top, SCENE[this.theme].bottom);
    this.renderer.render(this.scene, camera);
    for (const { label, follow } of content.labels) {
      if (!label.shown || !follow) continue;
      const at = follow();
      label.hidden = !at;
      if (at) label.at.copy(at);
    }
    this.overlay.place(camera, this.canvas.clientWidth, this.canvas.clientHeight, content.bodies.filter((body) => body.root.visible).flatMap((body) => body.spine()));
  }

  private get size(): number {
    return this.content?.sphere.radius ?? 1;
  }

  private request(): void {
    if (!this.frame) this.frame = requestAnimationFrame(() => this.draw());
  }

  private clear(): void {
    this.overlay.clear();
    this.scene.traverse((object) => {
      const { geometry, material } = object as THREE.Mesh;
      geometry?.dispose();
      if (object instanceof THREE.InstancedMesh) object.dispose();
      if (material) for (const one of Array.isArray(material) ? material : [material]) one.dispose();
    });
    this.scene = new THREE.Scene();
  }

  // ---------------------------------------------------------------- building

  private build(view: View): void {
    this.clear();
    this.materials.dispose();
    this.materials = new Materials(this.theme);
    const { materials, solids, page, scene } = this;
    const bodies = view.actors.map((actor) => new Body(actor, page.robots[actor.robot], solids, materials));
    const things = view.obstacles.map((obstacle) => new Thing(obstacle, solids, materials));
    const cloud = view.cloud ? new Particles(view.cloud, view.clock, this.theme) : null;
    const points = seen(bodies, things, cloud, view);
    const sphere = new THREE.Box3().setFromPoints(points).getBoundingSphere(new THREE.Sphere());
    const whole = new THREE.Box3().setFromPoints(points);
    for (const box of [...bodies.flatMap((body) => body.baseParts()), ...things.map((thing) => thing.box)]) whole.union(box);
    const closest = view.closest ? new ClosestPair(view.closest, materials.colors.closest) : null;
    const solidBodies = bodies.filter((body) => !body.actor.ghost);
    const moving = bodies.filter((body) => body.motion.end > body.motion.start);
    const paths = moving.map((body) => ({ path: new Path(body, this.theme, moving.length === 1 && !cloud, "tip"), ghost: body.actor.ghost }));
    const drifting = solidBodies.find((body) => body.motion.moving && body.motion.end > body.motion.start);
    const content: Content = {
      view, bodies, things, cloud, points, sphere, closest, paths, //
      motions: bodies.map((body) => body.motion),
      basePath: drifting ? new Path(drifting, this.theme, false, "base") : null,
      triads: solidBodies.map((body) => ({ tip: this.newTriad(true), base: this.newTriad(false), body })),
      targets: new THREE.Group(),
      grid: new THREE.Group(),
      everything: whole.getBoundingSphere(new THREE.Sphere()),
      labels: [],
      distanceLabel: null,
      gridNote: "",
      corner: clearest(bodies[0], things, points, sphere),
    };
    this.content = content;
    for (const target of view.targets) content.targets.add(targetMark(target, sphere.radius, materials));
    const floor = this.addGrid(content);
    for (const thing of things) thing.addPlanes(sphere.center, sphere.radius, materials, floor);
    scene.add(content.targets, content.grid, ...content.triads.flatMap(({ tip, base }) => [tip, base]));
    for (const { root } of [...bodies, ...things, ...paths.map(({ path }) => path)]) scene.add(root);
    for (const object of [content.basePath?.root, closest?.root, cloud?.points]) if (object) scene.add(object);
    this.addLight(sphere);
    this.addLabels(content);
    this.switch();
  }

  /** Axes; those of a base are seen through it. */
  private newTriad(behind: boolean): THREE.Mesh {
    const mesh = new THREE.Mesh(triad(this.materials.colors.axes), behind ? this.materials.triad : this.materials.inner);
    mesh.matrixAutoUpdate = false;
    return mesh;
  }

  private addLight(sphere: THREE.Sphere): void {
    const colors = SCENE[this.theme];
    const hemisphere = new THREE.HemisphereLight(colors.sky, colors.ground, colors.skyIntensity);
    hemisphere.position.set(0, 0, 1);
    const { key, fill, camera, scene } = this;
    key.intensity = colors.keyIntensity;
    key.position.copy(sphere.center).addScaledVector(new THREE.Vector3(0.5, -0.85, 1.5).normalize(), 3 * sphere.radius);
    key.target.position.copy(sphere.center);
    key.castShadow = true;
    key.shadow.mapSize.set(1024, 1024);
    const box = key.shadow.camera;
    [box.left, box.right, box.bottom, box.top] = [-1, 1, -1, 1].map((sign) => 1.05 * sign * sphere.radius);
    [box.near, box.far] = [1.5 * sphere.radius, 4.5 * sphere.radius];
    box.updateProjectionMatrix();
    key.shadow.normalBias = 0.004 * sphere.radius;
    key.shadow.bias = -0.0008;
    key.shadow.intensity = 0.55;
    fill.intensity = colors.fillIntensity;
    fill.position.set(-0.4, 0.3, 1);
    fill.target.position.set(0, 0, 0);
    camera.clear();
    camera.add(fill, fill.target);
    scene.add(hemisphere, key, key.target, camera);
  }

  /** Draws the grid, below everything or on a floor; returns the floor's height where there is one. */
  private addGrid(content: Content): number | undefined {
    const { sphere, things, grid } = content;
    const box = new THREE.Box3().setFromPoints(content.points);
    const step = niceStep(sphere.radius / 7);
    const floors = things.flatMap(({ planes }) => planes.filter(({ normal }) => normal.z > 0.9999).map(({ offset }) => offset));
    const floor = floors.find((z) => Math.abs(z - box.min.z) < 0.6 * sphere.radius);
    const level = floor ?? Math.floor(box.min.z / step - 0.25) * step;
    const every = Math.round(step * 10 ** -Math.floor(Math.log10(step) + 1e-9)) === 5 ? 2 : 5;
    const colors = SCENE[this.theme];
    const { x, y } = sphere.center;
    const radius = 1.7 * sphere.radius;
    const lines = gridLines(x, y, radius, step, new THREE.Color(colors.grid), colors.gridOpacity, every);
    grid.add(new THREE.LineSegments(lines, this.materials.fadedLines));
    grid.position.z = level + (floor === undefined ? 0 : 0.001 * sphere.radius);
    const tell = (x: number) => Number(x.toPrecision(6)).toString().replace("-", "\u2212");
    content.gridNote = `grid ${tell(step)} m at z = ${tell(level)} m`;
    this.addMarks(content, step, level, radius);
    return floor;
  }

  /** Marks of the grid's lines: each follows the place where its line leaves the picture, nearest to the eye. */
  private addMarks(content: Content, step: number, level: number, radius: number): void {
    const { center } = content.sphere;
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const count = Math.floor((0.62 * radius) / step);
    for (const along of [0, 1]) {
      const nearest = Math.round(center.getComponent(1 - along) / step);
      for (let i = nearest - count; i <= nearest + count; i++) {
        const text = `${"yx"[along]} ${(i * step).toFixed(digits)}`.replace("-", "\u2212").replace(/\u2212(0(\.0*)?)$/, "$1");
        const label = this.overlay.label(text, "mark", 80 + (i % 2 ? 1 : 0), "centred");
        const ends = [-1, 1].map((sign) => {
          const at = new THREE.Vector3(0, 0, level).setComponent(1 - along, i * step);
          const half = Math.sqrt(Math.max(0, (0.7 * radius) ** 2 - (i * step - center.getComponent(1 - along)) ** 2));
          return at.setComponent(along, center.getComponent(along) + sign * half);
        });
        content.labels.push({ label, toggles: ["grid"], follow: () => this.leaving(ends[0], ends[1]) });
      }
    }
  }

  /** The place of a line that is seen and lies lowest in the picture, a little inside it. */
  private leaving(a: THREE.Vector3, b: THREE.Vector3): THREE.Vector3 | undefined {
    const { camera } = this;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const at = (share: number) => a.clone().lerp(b, share);
    const low = (share: number) => {
      const p = at(share).project(camera);
      return Math.abs(p.z) < 1 && Math.abs(p.x) < 1 - 36 / width && Math.abs(p.y) < 1 - 18 / height ? p.y : Infinity;
    };
    let [best, least] = [-1, Infinity];
    for (let i = 0; i <= 32; i++) {
      const y = low(i / 32);
      if (y < least) [best, least] = [i / 32, y];
    }
    if (best < 0) return undefined;
    for (let reach = 1 / 64; reach > 1e-3; reach /= 2) {
      for (const share of [best - reach, best + reach]) {
        const y = share >= 0 && share <= 1 ? low(share) : Infinity;
        if (y < least) [best, least] = [share, y];
      }
    }
    return at(best);
  }

  private addLabels(content: Content): void {
    const { overlay } = this;
    const { view } = content;
    const add = (text: string, kind: "name" | "value", rank: number, toggles: Toggle[], follow: () => THREE.Vector3 | undefined) => {
      const label = overlay.label(text, kind, rank, rank === 40 ? "beside" : "above");
      content.labels.push({ label, toggles, follow });
      return label;
    };
    content.targets.children.forEach((mark, i) => add(view.targets[i].name, "name", 10, ["targets"], () => this.above(mark.position, 0.03 * this.size)));
    for (const thing of content.things) {
      const at = anchor(thing, content.sphere);
      add(thing.obstacle.name, "name", 30, ["names"], () => at);
    }
    const several = content.bodies.length > 1;
    for (const body of content.bodies) {
      const where = () => new THREE.Vector3().setFromMatrixPosition(body.tip(this.time));
      if (several) {
        const label = add(body.actor.name, "name", body.actor.ghost ? 12 : 11, [view.actors.some((actor) => actor.ghost) ? "ghosts" : "names"], where);
        label.element.style.color = toneColor(body.actor.tone, this.theme);
      }
      if (body.actor.ghost) continue;
      for (const { name, joint, middle, size } of body.links()) add(name, "name", 40, ["names"], () => body.point(joint, middle)).extent = size;
    }
    if (content.closest) content.distanceLabel = add("", "value", 0, ["closest"], () => content.closest!.middle);
  }

  /** A place higher in the picture. */
  private above(place: THREE.Vector3, by: number): THREE.Vector3 {
    return place.clone().addScaledVector(new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1), by);
  }

  /** Makes visible what is wanted. */
  private switch(): void {
    const { content, state } = this;
    if (!content) return;
    for (const toggle of TOGGLES) state[toggle] = this.has(toggle) && (this.chosen[toggle] ?? this.byDefault(toggle));
    for (const body of content.bodies) {
      body.root.visible = !body.actor.ghost || state.ghosts;
      body.show(state.visuals, state.shapes);
    }
    for (const { path, ghost } of content.paths) path.root.visible = state.path && (!ghost || state.ghosts);
    if (content.basePath) content.basePath.root.visible = state.basePath;
    if (content.closest) content.closest.root.visible = state.closest;
    if (content.cloud) content.cloud.points.visible = state.cloud;
    for (const { tip, base } of content.triads) tip.visible = base.visible = state.axes;
    content.targets.visible = state.targets;
    content.grid.visible = state.grid;
    for (const { label, toggles } of content.labels) label.shown = toggles.every((toggle) => state[toggle]);
    this.renderer.shadowMap.needsUpdate = true;
    this.writeDistance();
    this.writeLegend();
  }

  private byDefault(toggle: Toggle): boolean {
    if (toggle === "shapes") return !this.has("visuals");
    if (toggle === "names") return this.content!.things.length <= MOST_NAMES;
    return true;
  }

  private writeDistance(): void {
    const { content } = this;
    const pair = content?.closest;
    if (!content?.distanceLabel || !pair) return;
    pair.root.visible &&= this.state.closest;
    content.distanceLabel.shown = this.state.closest && Number.isFinite(pair.distance);
    this.overlay.write(content.distanceLabel, lengthText(pair.distance), pair.distance < 0 ? SIGNALS[this.theme].bad : "");
  }

  private writeLegend(): void {
    const { content, state } = this;
    const cloud = content?.view.cloud;
    const single = content?.paths.length === 1 ? content.paths[0].path : null;
    if (content?.cloud && state.cloud && cloud?.value) this.overlay.setLegend(cloud.legend ?? cloud.name, "best", "worst", costColor);
    else if (single?.fastest && state.path) this.overlay.setLegend(speedTitle(content!.view.clock.unit), "0", single.fastest.toPrecision(2), scaleColor);
    else this.overlay.hideLegend();
    this.overlay.setNote(state.grid ? content!.gridNote : "");
  }

  // ---------------------------------------------------------------- camera

  /** What is under the pointer: its name and place. */
  private under(event: MouseEvent): { name: string; point: THREE.Vector3 } | null {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const place = new THREE.Vector2((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height);
    this.ray.setFromCamera(place, this.camera);
    const meshes: THREE.Object3D[] = [];
    this.scene.traverseVisible((object) => void ((object.userData as Named).names && meshes.push(object)));
    const hit = this.ray.intersectObjects(meshes, false)[0];
    if (!hit) return null;
    const { names } = hit.object.userData as Named;
    return { name: names.find(({ before }) => (hit.faceIndex ?? 0) < before)?.name ?? "", point: hit.point };
  }

  private readonly hover = (event: PointerEvent): void => {
    cancelAnimationFrame(this.hovering);
    if (event.type === "pointerleave" || event.buttons || event.pointerType !== "mouse") return this.overlay.tell("", 0, 0);
    this.hovering = requestAnimationFrame(() => {
      const { left, top } = this.canvas.getBoundingClientRect();
      this.overlay.tell(this.under(event)?.name ?? "", event.clientX - left, event.clientY - top);
    });
  };

  /** Turns the picture about what was clicked twice. */
  private readonly centre = (event: MouseEvent): void => {
    const hit = this.under(event);
    if (!hit) return;
    this.leave();
    const shift = hit.point.clone().sub(this.controls.target);
    this.controls.target.add(shift);
    this.camera.position.add(shift);
    this.controls.update();
    this.request();
  };

  private leave(): void {
    if (this.from === "tool") {
      const ahead = new THREE.Vector3();
      this.camera.getWorldDirection(ahead);
      this.camera.up.set(0, 0, 1);
      this.controls.target.copy(this.camera.position).addScaledVector(ahead, 0.9 * this.size);
    }
    this.from = null;
  }

  private fit(): void {
    const { content, camera, controls, from } = this;
    if (!content || !from) return;
    if (from === "tool") return this.ride();
    camera.fov = FOV;
    camera.up.set(0, 0, 1);
    const direction = from === "corner" ? content.corner : new THREE.Vector3(...FROM[from]).normalize();
    camera.position.copy(content.sphere.center).add(direction);
    camera.lookAt(content.sphere.center);
    frame(camera, content.points, 1.07);
    const depth = camera.position.clone().sub(content.sphere.center).dot(direction);
    controls.target.copy(camera.position).addScaledVector(direction, -depth);
    controls.minDistance = 0.02 * content.sphere.radius;
    controls.maxDistance = 40 * content.sphere.radius;
    controls.update();
  }

  private toolMatrix(): THREE.Matrix4 {
    const body = this.content?.bodies[0];
    return body ? body.tip(this.time) : new THREE.Matrix4();
  }

  /** Sets the camera behind the tool, looking where its z axis points. */
  private ride(): void {
    const { camera, content } = this;
    if (!content?.bodies.length) return;
    const { x, y, z, origin } = axesOf(this.toolMatrix());
    const up = x.clone().multiplyScalar(this.toolUp.x).addScaledVector(y, this.toolUp.y);
    const reach = 0.3 * content.sphere.radius;
    camera.fov = TOOL_FOV;
    camera.up.copy(up);
    camera.position.copy(origin).addScaledVector(z, -1.3 * reach).addScaledVector(up, 0.75 * reach);
    camera.lookAt(origin.clone().addScaledVector(z, 1.6 * reach));
    camera.updateProjectionMatrix();
  }
}

function set(mesh: THREE.Mesh, matrix: THREE.Matrix4, length: number): void {
  mesh.matrix.copy(matrix).scale(new THREE.Vector3(length, length, length));
  mesh.matrixWorldNeedsUpdate = true;
}

function axesOf(matrix: THREE.Matrix4): { x: THREE.Vector3; y: THREE.Vector3; z: THREE.Vector3; origin: THREE.Vector3 } {
  const [x, y, z] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  matrix.extractBasis(x, y, z);
  return { x, y, z, origin: new THREE.Vector3().setFromMatrixPosition(matrix) };
}

function speedTitle(unit: string): string {
  return unit === "s" || unit === "" ? "tip speed [m/s]" : `tip speed [m per ${unit}]`;
}

/** Where an obstacle's name stands: over its top, or where a half-space's face is near. */
function anchor(thing: Thing, sphere: THREE.Sphere): THREE.Vector3 {
  if (thing.box.isEmpty()) {
    const face = thing.planes[0];
    return face ? sphere.center.clone().addScaledVector(face.normal, face.offset - face.normal.dot(sphere.center)) : sphere.center.clone();
  }
  const at = thing.box.getCenter(new THREE.Vector3());
  if (at.distanceTo(sphere.center) < 1.6 * sphere.radius) at.z = Math.min(thing.box.max.z, sphere.center.z + sphere.radius);
  return at;
}

/** Points that the camera has to see: the arms on their way, the targets, the cloud; of base and obstacles what is near them. */
function seen(bodies: Body[], things: Thing[], cloud: Particles | null, view: View): THREE.Vector3[] {
  const instants = ({ start, end }: Motion) => Array.from({ length: end > start ? 13 : 1 }, (_, i) => start + ((end - start) * i) / 12);
  const points = bodies.flatMap((body) => instants(body.motion).flatMap((t) => body.corners(t)));
  const { min, max } = new THREE.Box3().setFromPoints(points);
  const room = points.length ? 0.07 * min.distanceTo(max) : 0.1;
  for (const { T } of view.targets) points.push(...cornersOf(new THREE.Box3().setFromCenterAndSize(new THREE.Vector3(T[3], T[7], T[11]), new THREE.Vector3().setScalar(room))));
  if (cloud) points.push(...cloud.some());
  const boxes = [...bodies.flatMap((body) => body.baseParts()), ...things.flatMap((thing) => thing.boxes)];
  const near = new THREE.Box3();
  if (points.length) {
    const { center, radius } = new THREE.Box3().setFromPoints(points).getBoundingSphere(new THREE.Sphere());
    near.setFromCenterAndSize(center, new THREE.Vector3().setScalar(2 * NEAR * radius));
  } else for (const box of boxes) near.union(box);
  for (const box of boxes) {
    const cut = box.clone().intersect(near);
    if (!cut.isEmpty()) points.push(...cornersOf(cut));
  }
  return points.length ? points : cornersOf(new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1)));
}

/** The corner from which most of a body's motion is seen past the obstacles and its own base, near, and not end on; the first of equals. */
function clearest(body: Body | undefined, things: Thing[], points: THREE.Vector3[], sphere: THREE.Sphere): THREE.Vector3 {
  const [first, ...others] = CORNERS.map((corner) => vector(corner).normalize());
  if (!body) return first;
  const { start, end } = body.motion;
  const instants = Array.from({ length: end > start ? 9 : 1 }, (_, i) => start + ((end - start) * i) / 8);
  const moving = instants.map((t) => ({ points: body.watched(t), base: body.baseBoxes(t) }));
  const boxes = things.flatMap((thing) => thing.boxes);
  const ray = new THREE.Ray();
  const watched = moving.flatMap(({ points }) => points);
  const middle = watched.reduce((sum, point) => sum.add(point), new THREE.Vector3()).divideScalar(watched.length);
  const spread = watched.reduce((sum, point) => sum + point.distanceToSquared(middle), 0) || 1;
  const cost = (direction: THREE.Vector3) => {
    const front = points.reduce((most, point) => Math.max(most, point.dot(direction)), -Infinity) - sphere.center.dot(direction);
    const back = sphere.center.dot(direction) - middle.dot(direction);
    const along = watched.reduce((sum, point) => sum + (point.dot(direction) - middle.dot(direction)) ** 2, 0) / spread;
    let hidden = watched.length * ((0.25 * front + 0.12 * back) / sphere.radius + 0.5 * along); // what stands in front is large
    for (const { points, base } of moving) {
      for (const point of points) {
        ray.origin.copy(point).addScaledVector(direction, 0.01 * sphere.radius);
        ray.direction.copy(direction);
        if (boxes.some((box) => ray.intersectsBox(box))) hidden++;
        else if (base.some(({ box, inverse }) => ray.clone().applyMatrix4(inverse).intersectsBox(box))) hidden++;
      }
    }
    return hidden;
  };
  let [best, least] = [first, cost(first) - 0.06 * watched.length]; // another one has to be clearly better
  for (const direction of others) {
    const found = cost(direction);
    if (found < least) [best, least] = [direction, found];
  }
  return best;
}

/** Moves the camera, without turning it, so near that all points are just seen. */
function frame(camera: THREE.PerspectiveCamera, points: THREE.Vector3[], margin: number): void {
  camera.updateProjectionMatrix();
  camera.updateMatrixWorld();
  const [x, y, z] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  camera.matrixWorld.extractBasis(x, y, z);
  const v = Math.tan(((camera.fov / 2) * Math.PI) / 180) / margin;
  const h = v * camera.aspect;
  const most = (f: (p: THREE.Vector3) => number) => points.reduce((best, p) => Math.max(best, f(p)), -Infinity);
  // a point is seen where |its x - the camera's| <= h (camera's z - its z): four planes whose supports give the place
  const [right, left] = [most((p) => p.dot(x) + h * p.dot(z)), most((p) => -p.dot(x) + h * p.dot(z))];
  const [top, bottom] = [most((p) => p.dot(y) + v * p.dot(z)), most((p) => -p.dot(y) + v * p.dot(z))];
  const depth = Math.max((right + left) / (2 * h), (top + bottom) / (2 * v));
  camera.position.set(0, 0, 0).addScaledVector(x, (right - left) / 2).addScaledVector(y, (top - bottom) / 2).addScaledVector(z, depth);
}

/** Clears the picture with a gradient from top to bottom, in as many bands as it has shades: cheaper than a textured square. */
function clear(renderer: THREE.WebGLRenderer, top: string, bottom: string): void {
  const size = renderer.getSize(new THREE.Vector2());
  const [from, to] = [new THREE.Color(top), new THREE.Color(bottom)];
  const bands = Math.min(48, Math.ceil(size.y / 4));
  renderer.setScissorTest(true);
  for (let i = 0; i < bands; i++) {
    const [y0, y1] = [Math.round((size.y * i) / bands), Math.round((size.y * (i + 1)) / bands)];
    renderer.setScissor(0, y0, size.x, y1 - y0);
    renderer.setClearColor(to.clone().lerp(from, bands > 1 ? i / (bands - 1) : 0), 1);
    renderer.clear(true, false, false);
  }
  renderer.setScissorTest(false);
  renderer.clear(false, true, true);
}
