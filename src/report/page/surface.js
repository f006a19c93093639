// A mesh over time: positions, normals, colours.
import { BufferAttribute, BufferGeometry, Color, DoubleSide, Mesh, MeshLambertMaterial } from 'three';
import { Track } from './blocks.js';
import { kColorings, paint } from './colors.js';

/** Distinct edges of 3 × F corners as pairs of vertices. */
function edgesOf(faces, numVertices) {
  const seen = new Set();
  const edges = [];
  for (let f = 0; f < faces.length; f += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = faces[f + k];
      const b = faces[f + ((k + 1) % 3)];
      const key = Math.min(a, b) * numVertices + Math.max(a, b);
      if (seen.has(key)) continue;
      seen.add(key);
      edges.push(a, b);
    }
  }
  return Uint32Array.from(edges);
}

function lengthsOf(edges, positions) {
  const lengths = new Float32Array(edges.length / 2);
  for (let e = 0; e < lengths.length; ++e) {
    const a = 3 * edges[2 * e];
    const b = 3 * edges[2 * e + 1];
    lengths[e] = Math.hypot(
      positions[a] - positions[b], positions[a + 1] - positions[b + 1], positions[a + 2] - positions[b + 2]);
  }
  return lengths;
}

/** Area-weighted vertex normals. */
function updateNormals(faces, p, n) {
  n.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      n[corner] += x;
      n[corner + 1] += y;
      n[corner + 2] += z;
    }
  }
  for (let v = 0; v < n.length; v += 3) {
    const length = Math.hypot(n[v], n[v + 1], n[v + 2]) || 1;
    n[v] /= length;
    n[v + 1] /= length;
    n[v + 2] /= length;
  }
}

/** Light of a display value (sRGB), which materials count in. */
function linear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

const kTrueColor = [0.13, 0.64, 0.36];

export class Surface {
  /** `errors`: descriptions of the tracks depthError and truthError, where there are any. */
  constructor(part, errors = {}) {
    this.name = part.name;
    this.kind = part.kind;
    this.part = part;
    this.tracks = { positions: part.positions, ...errors };
    if (part.provenance) this.tracks.provenance = part.provenance;
  }

  async load() {
    for (const [name, description] of Object.entries(this.tracks)) {
      this.tracks[name] = await new Track(description).load();
    }
    const numVertices = this.tracks.positions.points;
    this.faces = (await new Track(this.part.faces).load()).at(0).values;
    this.positions = new Float32Array(3 * numVertices);
    this.normals = new Float32Array(3 * numVertices);
    this.colors = new Float32Array(3 * numVertices);
    if (this.part.vertex_colors) {
      const values = (await new Track(this.part.vertex_colors).load()).at(0).values;
      this.ownColors = Float32Array.from(values, (value) => linear(value / 255));
    }
    if (this.kind === 'garment') await this.loadCloth(numVertices);
    this.makeMesh();
    return this;
  }

  /** What strain and material are seen by. */
  async loadCloth(numVertices) {
    const rest = this.part.rest ? await new Track(this.part.rest).load() : this.tracks.positions;
    this.edges = edgesOf(this.faces, numVertices);
    this.restLengths = lengthsOf(this.edges, rest.positions(0, new Float32Array(3 * numVertices)));
    if (this.part.stiffness) {
      const values = (await new Track(this.part.stiffness).load()).at(0).values;
      this.stiffness = Float32Array.from(values, (value) => value / 1000);
    } else if (this.part.material) {
      this.stiffness = new Float32Array(numVertices).fill(Math.log10(Math.max(1, this.part.material.stretch_k)));
    }
  }

  makeMesh() {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.positions, 3));
    geometry.setAttribute('normal', new BufferAttribute(this.normals, 3));
    geometry.setAttribute('color', new BufferAttribute(this.colors, 3));
    geometry.setIndex(new BufferAttribute(this.faces, 1));
    const isTruth = this.kind === 'truth';
    const material = new MeshLambertMaterial({
      vertexColors: true,
      side: DoubleSide,
      transparent: isTruth,
      opacity: isTruth ? 0.55 : 1,
      polygonOffset: this.kind === 'body',
      polygonOffsetFactor: 2,
      polygonOffsetUnits: 2,
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
  }

  /** Can it be coloured by this? */
  has(needs) {
    if (needs === 'strain') return this.edges !== undefined;
    if (needs === 'stiffness') return this.stiffness !== undefined;
    return this.tracks[needs] !== undefined;
  }

  ownColor() {
    const color = this.kind === 'truth' ? kTrueColor : this.part.color ?? [0.45, 0.55, 0.7];
    return new Color().setRGB(...color, 'srgb');
  }

  strain() {
    const numVertices = this.positions.length / 3;
    this.strains ??= new Float32Array(numVertices);
    const counts = new Float32Array(numVertices);
    this.strains.fill(0);
    const lengths = lengthsOf(this.edges, this.positions);
    for (let e = 0; e < lengths.length; ++e) {
      const strain = Math.abs(lengths[e] / this.restLengths[e] - 1);
      for (const v of [this.edges[2 * e], this.edges[2 * e + 1]]) {
        this.strains[v] += strain;
        ++counts[v];
      }
    }
    for (let v = 0; v < numVertices; ++v) this.strains[v] /= counts[v] || 1;
    return this.strains;
  }

  values(needs, frame) {
    if (needs === 'strain') return this.strain();
    if (needs === 'stiffness') return this.stiffness;
    return this.tracks[needs].at(frame).values;
  }

  show(frame, coloring) {
    this.tracks.positions.positions(frame, this.positions);
    updateNormals(this.faces, this.positions, this.normals);
    this.color(frame, coloring);
    for (const attribute of ['position', 'normal']) this.mesh.geometry.attributes[attribute].needsUpdate = true;
  }

  color(frame, name) {
    const { needs } = kColorings[name];
    if (needs && this.has(needs)) {
      paint(kColorings[name], this.values(needs, frame), this.colors);
    } else if (this.ownColors?.length === this.colors.length) {
      this.colors.set(this.ownColors);
    } else {
      const { r, g, b } = this.ownColor();
      for (let i = 0; i < this.colors.length; i += 3) this.colors.set([r, g, b], i);
    }
    this.mesh.geometry.attributes.color.needsUpdate = true;
  }
}
