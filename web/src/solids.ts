/** Shapes as triangles and outline edges for three.js: primitives, meshes with creased normals, many spheres, half-spaces. */
import * as THREE from "three";
import type { Geometry, Mesh, Page, Transform } from "./data";
import { matrixOf, unpack, unpackShares } from "./kinematics";

/** Triangles (three points each, not indexed) and the edges that are drawn as lines (two points each). */
export interface Solid {
  positions: Float32Array;
  normals: Float32Array;
  colors?: Float32Array; // linear RGB of the points, where the mesh has its own
  edges: Float32Array;
}

const CREASE = Math.cos((30 * Math.PI) / 180);
const SHARP = Math.cos((38 * Math.PI) / 180); // edges flatter than this are not drawn
const MOST_EDGES = 6000; // of a mesh: more would be a grey blot

/** Makes solids; those of the page's meshes are kept. */
export class Solids {
  private readonly meshes: (Solid | undefined)[] = [];
  constructor(private readonly page: Page) {}

  /** A shape in its owner's frame; null for those that are no solid (many spheres, half-spaces). */
  of(shape: Geometry): Solid | null {
    switch (shape.kind) {
      case "box":
        return placed(box(shape.size), shape.T);
      case "cylinder":
        return placed(cylinder(shape.radius, shape.length), shape.T);
      case "sphere":
        return moved(smooth(new THREE.SphereGeometry(shape.radius, 32, 20)), new THREE.Matrix4().makeTranslation(vector(shape.center)));
      case "capsule":
        return capsule(shape.radius, vector(shape.a), vector(shape.b));
      case "mesh": {
        const solid = (this.meshes[shape.mesh] ??= creased(this.page.meshes[shape.mesh]));
        return placed(solid, shape.T, shape.scale);
      }
      default:
        return null;
    }
  }
}

export function vector(values: ArrayLike<number>): THREE.Vector3 {
  return new THREE.Vector3(values[0], values[1], values[2]);
}

function placed(solid: Solid, T: Transform, scale?: number[]): Solid {
  const matrix = new THREE.Matrix4().fromArray(matrixOf(T));
  if (scale) matrix.scale(vector(scale));
  return moved(solid, matrix);
}

function moved(solid: Solid, matrix: THREE.Matrix4): Solid {
  const normal = new THREE.Matrix3().getNormalMatrix(matrix);
  const apply = (values: Float32Array, by: THREE.Matrix4) => new THREE.BufferAttribute(values.slice(), 3).applyMatrix4(by).array as Float32Array;
  const positions = apply(solid.positions, matrix);
  const normals = new THREE.BufferAttribute(solid.normals.slice(), 3).applyNormalMatrix(normal).array as Float32Array;
  const colors = solid.colors?.slice();
  if (matrix.determinant() < 0) for (const values of [positions, normals, ...(colors ? [colors] : [])]) turnOver(values);
  return { positions, normals, colors, edges: apply(solid.edges, matrix) };
}

/** Swaps the second and third point of every triangle: a mirror turns the triangles inside out. */
function turnOver(values: Float32Array): void {
  for (let i = 0; i < values.length; i += 9) {
    for (let k = 0; k < 3; k++) [values[i + 3 + k], values[i + 6 + k]] = [values[i + 6 + k], values[i + 3 + k]];
  }
}

function smooth(geometry: THREE.BufferGeometry, edges: Float32Array = new Float32Array()): Solid {
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  const [positions, normals] = ["position", "normal"].map((name) => flat.getAttribute(name).array as Float32Array);
  return { positions, normals, edges };
}

function box(size: number[]): Solid {
  const geometry = new THREE.BoxGeometry(size[0], size[1], size[2]);
  const edges: number[] = [];
  for (let axis = 0; axis < 3; axis++) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (const [a, b] of [[-1, -1], [-1, 1], [1, -1], [1, 1]]) {
      for (const end of [-1, 1]) {
        const corner = [0, 0, 0];
        corner[axis] = (end * size[axis]) / 2;
        corner[u] = (a * size[u]) / 2;
        corner[v] = (b * size[v]) / 2;
        edges.push(...corner);
      }
    }
  }
  return smooth(geometry, new Float32Array(edges));
}

function cylinder(radius: number, length: number): Solid {
  const around = 40;
  const geometry = new THREE.CylinderGeometry(radius, radius, length, around).rotateX(Math.PI / 2);
  const edges: number[] = [];
  for (const end of [-1, 1]) {
    for (let i = 0; i < around; i++) {
      for (const k of [i, i + 1]) {
        const angle = (2 * Math.PI * k) / around;
        edges.push(radius * Math.cos(angle), radius * Math.sin(angle), (end * length) / 2);
      }
    }
  }
  return smooth(geometry, new Float32Array(edges));
}

function capsule(radius: number, a: THREE.Vector3, b: THREE.Vector3): Solid {
  const along = b.clone().sub(a);
  const length = along.length();
  const turn = length > 0 ? new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize()) : new THREE.Quaternion();
  const middle = a.clone().add(b).multiplyScalar(0.5);
  const matrix = new THREE.Matrix4().compose(middle, turn, new THREE.Vector3(1, 1, 1));
  return moved(smooth(new THREE.CapsuleGeometry(radius, length, 8, 28)), matrix);
}

/** A mesh with normals that are smooth over edges of less than 30 degrees, and its sharp edges. */
export function creased(mesh: Mesh): Solid {
  const points = unpackShares(mesh.positions, mesh.low, mesh.high);
  const corners = unpack(mesh.indices);
  const welded = weld(points, mesh);
  const faces = faceNormals(points, corners);
  const { starts, around } = facesAround(welded, corners);
  const [positions, normals] = [new Float32Array(3 * corners.length), new Float32Array(3 * corners.length)];
  for (let c = 0; c < corners.length; c++) {
    const face = Math.floor(c / 3);
    const point = corners[c];
    const [ux, uy, uz] = [faces.unit[3 * face], faces.unit[3 * face + 1], faces.unit[3 * face + 2]];
    let [x, y, z] = [0, 0, 0];
    for (let k = starts[welded[point]]; k < starts[welded[point] + 1]; k++) {
      const f = 3 * around[k];
      if (ux * faces.unit[f] + uy * faces.unit[f + 1] + uz * faces.unit[f + 2] < CREASE) continue;
      x += faces.area[f];
      y += faces.area[f + 1];
      z += faces.area[f + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    normals.set(length > 1e-30 ? [x / length, y / length, z / length] : [ux, uy, uz], 3 * c);
    for (let k = 0; k < 3; k++) positions[3 * c + k] = points[3 * point + k];
  }
  return { positions, normals, colors: cornerColors(mesh, corners.length), edges: sharpEdges(points, corners, welded, faces.unit) };
}

/** For every point the first with the same place (in the mesh's 16 bits). */
function weld(points: Float32Array, mesh: Mesh): Uint32Array {
  const shares = unpack(mesh.positions);
  const first = new Map<number, number>();
  const welded = new Uint32Array(points.length / 3);
  for (let i = 0; i < welded.length; i++) {
    const key = (shares[3 * i] * 65536 + shares[3 * i + 1]) * 65536 + shares[3 * i + 2];
    const known = first.get(key);
    if (known === undefined) first.set(key, i);
    welded[i] = known ?? i;
  }
  return welded;
}

function faceNormals(points: Float32Array, corners: ArrayLike<number>): { unit: Float32Array; area: Float32Array } {
  const [unit, area] = [new Float32Array(corners.length), new Float32Array(corners.length)];
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  for (let i = 0; i < corners.length; i += 3) {
    a.fromArray(points, 3 * corners[i]);
    b.fromArray(points, 3 * corners[i + 1]).sub(a);
    c.fromArray(points, 3 * corners[i + 2]).sub(a);
    b.cross(c).toArray(area, i);
    b.normalize().toArray(unit, i);
  }
  return { unit, area };
}

function facesAround(welded: Uint32Array, corners: ArrayLike<number>): { starts: Uint32Array; around: Uint32Array } {
  const starts = new Uint32Array(welded.length + 1);
  for (let c = 0; c < corners.length; c++) starts[welded[corners[c]] + 1]++;
  for (let i = 0; i < welded.length; i++) starts[i + 1] += starts[i];
  const next = starts.slice();
  const around = new Uint32Array(corners.length);
  for (let c = 0; c < corners.length; c++) around[next[welded[corners[c]]]++] = Math.floor(c / 3);
  return { starts, around };
}

function cornerColors(mesh: Mesh, count: number): Float32Array | undefined {
  if (!mesh.colors) return undefined;
  const bytes = unpack(mesh.colors);
  const colors = new Float32Array(3 * count);
  const color = new THREE.Color();
  for (let c = 0; c < count; c++) {
    const face = 3 * Math.floor(c / 3);
    color.setRGB(bytes[face] / 255, bytes[face + 1] / 255, bytes[face + 2] / 255, THREE.SRGBColorSpace).toArray(colors, 3 * c);
  }
  return colors;
}

/** Edges between faces that meet at an angle, and borders; none where there are so many that they would hide the mesh. */
function sharpEdges(points: Float32Array, corners: ArrayLike<number>, welded: Uint32Array, unit: Float32Array): Float32Array {
  const faces = new Map<number, number>(); // of an edge: its first face, or -1 once it has a second
  const sharp: number[] = [];
  const total = welded.length;
  for (let c = 0; c < corners.length; c++) {
    const face = Math.floor(c / 3);
    const [a, b] = [welded[corners[c]], welded[corners[c % 3 === 2 ? c - 2 : c + 1]]];
    if (a === b) continue;
    const key = Math.min(a, b) * total + Math.max(a, b);
    const other = faces.get(key);
    if (other === undefined) faces.set(key, face);
    else if (other >= 0) {
      faces.set(key, -1);
      const [f, g] = [3 * face, 3 * other];
      if (unit[f] * unit[g] + unit[f + 1] * unit[g + 1] + unit[f + 2] * unit[g + 2] < SHARP) sharp.push(a, b);
    }
  }
  for (const [key, face] of faces) if (face >= 0) sharp.push(Math.floor(key / total), key % total);
  if (sharp.length > 2 * MOST_EDGES) return new Float32Array();
  const edges = new Float32Array(3 * sharp.length);
  sharp.forEach((point, i) => edges.set(points.subarray(3 * point, 3 * point + 3), 3 * i));
  return edges;
}

/** Solids as one geometry with colours, and their edges as another. */
export function merged(solids: { solid: Solid; color: THREE.Color; own: boolean }[]): { faces: THREE.BufferGeometry; edges: THREE.BufferGeometry } {
  const joined = (pieces: Float32Array[]) => {
    const out = new Float32Array(pieces.reduce((sum, piece) => sum + piece.length, 0));
    let at = 0;
    for (const piece of pieces) {
      out.set(piece, at);
      at += piece.length;
    }
    return new THREE.BufferAttribute(out, 3);
  };
  const plain = (count: number, color: THREE.Color) => {
    const out = new Float32Array(count);
    for (let i = 0; i < count; i += 3) color.toArray(out, i);
    return out;
  };
  const faces = new THREE.BufferGeometry();
  faces.setAttribute("position", joined(solids.map(({ solid }) => solid.positions)));
  faces.setAttribute("normal", joined(solids.map(({ solid }) => solid.normals)));
  faces.setAttribute("color", joined(solids.map(({ solid, color, own }) => (own && solid.colors) || plain(solid.positions.length, color))));
  const edges = new THREE.BufferGeometry();
  edges.setAttribute("position", joined(solids.map(({ solid }) => solid.edges)));
  return { faces, edges };
}

/** Many spheres of one material: an instanced mesh, coarser where they are many. */
export function manySpheres(centers: ArrayLike<number>, radii: ArrayLike<number>, material: THREE.Material): THREE.InstancedMesh {
  const count = radii.length;
  const detail = count <= 12 ? 6 : count <= 60 ? 4 : count <= 250 ? 2 : 1; // 980, 500, 180, 80 triangles each
  const mesh = new THREE.InstancedMesh(new THREE.IcosahedronGeometry(1, detail), material, count);
  const matrix = new THREE.Matrix4();
  for (let i = 0; i < count; i++) {
    const r = radii[i];
    matrix.set(r, 0, 0, centers[3 * i], 0, r, 0, centers[3 * i + 1], 0, 0, r, centers[3 * i + 2], 0, 0, 0, 1);
    mesh.setMatrixAt(i, matrix);
  }
  mesh.computeBoundingSphere();
  return mesh;
}

/** A disc that fades out, in the plane z = 0: a half-space's face. */
export function fadedDisc(radius: number, color: THREE.Color, opacity: number): THREE.BufferGeometry {
  const [rings, around] = [10, 64];
  const geometry = new THREE.RingGeometry(0, radius, around, rings);
  const places = geometry.getAttribute("position");
  const colors = new Float32Array(4 * places.count);
  for (let i = 0; i < places.count; i++) {
    const share = Math.hypot(places.getX(i), places.getY(i)) / radius;
    colors.set([color.r, color.g, color.b, opacity * (1 - share) ** 1.5], 4 * i);
  }
  geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
  return geometry;
}

/** Lines of a square grid in the plane z = 0 around (x, y), fading out, at multiples of the step; `every` so many one is strong. */
export function gridLines(x: number, y: number, radius: number, step: number, color: THREE.Color, opacity: number, every: number): THREE.BufferGeometry {
  const [positions, colors]: [number[], number[]] = [[], []];
  const count = Math.ceil(radius / step);
  const [i0, j0] = [Math.round(x / step), Math.round(y / step)];
  const push = (px: number, py: number, major: boolean) => {
    const share = Math.min(1, Math.hypot(px - x, py - y) / radius);
    positions.push(px, py, 0);
    colors.push(color.r, color.g, color.b, opacity * (major ? 1 : 0.5) * (1 - share) ** 1.2);
  };
  for (let i = -count; i <= count; i++) {
    for (let j = -count; j < count; j++) {
      for (const k of [j, j + 1]) push((i0 + i) * step, (j0 + k) * step, (i0 + i) % every === 0);
      for (const k of [j, j + 1]) push((i0 + k) * step, (j0 + i) * step, (j0 + i) % every === 0);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("color", new THREE.Float32BufferAttribute(colors, 4));
  return geometry;
}

/** Three arrows of length 1 along x, y, z. */
export function triad(colors: [string, string, string]): THREE.BufferGeometry {
  const pieces = colors.map((color, axis) => {
    const shaft = smooth(new THREE.CylinderGeometry(0.022, 0.022, 0.8, 12).translate(0, 0.4, 0));
    const head = smooth(new THREE.ConeGeometry(0.065, 0.22, 16).translate(0, 0.89, 0));
    const turn = [new THREE.Matrix4().makeRotationZ(-Math.PI / 2), new THREE.Matrix4(), new THREE.Matrix4().makeRotationX(Math.PI / 2)][axis];
    return [shaft, head].map((solid) => ({ solid: moved(solid, turn), color: new THREE.Color(color), own: false }));
  });
  return merged(pieces.flat()).faces;
}
