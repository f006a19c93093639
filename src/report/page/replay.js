// The 3D view: surfaces and depth points in the capture's world, and the same from its camera.
import {
  Box3, BufferAttribute, BufferGeometry, Color, DirectionalLight, GridHelper, HemisphereLight, Matrix4,
  PerspectiveCamera, Points, PointsMaterial, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { Track } from './blocks.js';

/** three.js' camera with the intrinsics of OpenCV's (pixel centres at integers, y down, z ahead). */
export function recordingCamera({ width, height, fx, fy, cx, cy, camera_from_world: rows }) {
  const near = 0.05;
  const far = 50;
  const camera = new PerspectiveCamera();
  camera.matrixAutoUpdate = false;
  camera.matrix
    .multiplyMatrices(new Matrix4().makeScale(1, -1, -1), new Matrix4().set(...rows))
    .invert();
  camera.updateMatrixWorld(true);
  camera.projectionMatrix.set(
    (2 * fx) / width, 0, 1 - (2 * cx + 1) / width, 0,
    0, (2 * fy) / height, (2 * cy + 1) / height - 1, 0,
    0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near),
    0, 0, -1, 0);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  return camera;
}

/** Thinned depth as points in the world. */
export class DepthPoints {
  constructor(camera) {
    this.camera = camera;
    this.worldFromCamera = new Matrix4().set(...camera.camera_from_world).invert();
  }

  async load() {
    this.track = await new Track(this.camera.depth.track).load();
    const geometry = new BufferGeometry();
    this.positions = new Float32Array(3 * this.track.points);
    geometry.setAttribute('position', new BufferAttribute(this.positions, 3));
    this.object = new Points(geometry, new PointsMaterial({ size: 2.5, sizeAttenuation: false }));
    this.object.frustumCulled = false;
    return this;
  }

  show(frame) {
    const { values } = this.track.at(frame);
    const { fx, fy, cx, cy, depth } = this.camera;
    const point = new Vector3();
    let count = 0;
    for (let i = 0; i < values.length; ++i) {
      if (values[i] === 0) continue;
      const z = depth.step * values[i];
      const u = depth.stride * (i % depth.columns);
      const v = depth.stride * Math.floor(i / depth.columns);
      point.set(((u - cx) * z) / fx, ((v - cy) * z) / fy, z).applyMatrix4(this.worldFromCamera);
      point.toArray(this.positions, 3 * count++);
    }
    this.object.geometry.setDrawRange(0, count);
    this.object.geometry.attributes.position.needsUpdate = true;
  }
}

const kViews = { Front: [0, 0.12, 1], Side: [1, 0.12, 0], Back: [0, 0.12, -1], '3/4': [0.8, 0.35, 0.9] };

export class Replay {
  constructor(canvas, surfaces, depthPoints, camera) {
    this.canvas = canvas;
    this.surfaces = surfaces;
    this.depthPoints = depthPoints;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.scene = new Scene();
    this.scene.add(new HemisphereLight(0xffffff, 0x8a8f98, 1.6));
    const sun = new DirectionalLight(0xffffff, 1.9);
    sun.position.set(1.5, 3, 2.5);
    this.scene.add(sun);
    for (const surface of surfaces) this.scene.add(surface.mesh);
    if (depthPoints) this.scene.add(depthPoints.object);
    this.lens = new PerspectiveCamera(32, 1, 0.05, 100);
    this.recording = camera ? recordingCamera(camera) : null;
    this.controls = new OrbitControls(this.lens, canvas);
    this.controls.addEventListener('change', () => this.invalidate());
    this.afterRender = () => {};
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  views() {
    return Object.keys(kViews).concat(this.recording ? ['Camera'] : []);
  }

  /** The box that the surfaces are in now. */
  box() {
    const box = new Box3();
    for (const { kind, positions } of this.surfaces) {
      if (kind !== 'truth') box.union(new Box3().setFromArray(positions));
    }
    return box;
  }

  lookFrom(name) {
    const box = this.box();
    const center = box.getCenter(new Vector3());
    const radius = 0.5 * box.getSize(new Vector3()).length();
    this.controls.target.copy(center);
    if (name === 'Camera') {
      const eye = new Vector3().setFromMatrixPosition(this.recording.matrix);
      this.lens.position.copy(eye);
    } else {
      const distance = (0.9 * radius) / Math.sin(((0.5 * this.lens.fov) / 180) * Math.PI);
      this.lens.position.copy(center).addScaledVector(new Vector3(...kViews[name]).normalize(), distance);
    }
    this.controls.update();
    this.invalidate();
  }

  setTheme(style) {
    this.background = new Color(style.getPropertyValue('--view').trim());
    const line = new Color(style.getPropertyValue('--grid').trim());
    if (this.floor) this.scene.remove(this.floor);
    this.floor = new GridHelper(6, 24, line, line);
    this.scene.add(this.floor);
    if (this.depthPoints) this.depthPoints.object.material.color.set(style.getPropertyValue('--accent').trim());
    this.invalidate();
  }

  show(frame, coloring) {
    for (const surface of this.surfaces) surface.show(frame, coloring);
    this.depthPoints?.show(frame);
    this.invalidate();
  }

  color(frame, coloring) {
    for (const surface of this.surfaces) surface.color(frame, coloring);
    this.invalidate();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.lens.aspect = clientWidth / clientHeight;
    this.lens.updateProjectionMatrix();
    this.render();
  }

  /** At the next moment that the browser paints. */
  invalidate() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => this.render());
  }

  render() {
    cancelAnimationFrame(this.pending);
    this.pending = undefined;
    this.afterRender();
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, clientWidth, clientHeight);
    this.renderer.setClearColor(this.background ?? 0xffffff, 1);
    this.renderer.render(this.scene, this.lens);
  }

  /** The surfaces alone, from the recording's camera, drawn into another canvas. */
  renderOver(target) {
    const ratio = this.renderer.getPixelRatio();
    const width = Math.min(target.width, this.canvas.width);
    const height = Math.min(target.height, this.canvas.height);
    const floorShown = this.floor?.visible;
    if (this.floor) this.floor.visible = false;
    this.renderer.setViewport(0, 0, width / ratio, height / ratio);
    this.renderer.setScissor(0, 0, width / ratio, height / ratio);
    this.renderer.setScissorTest(true);
    this.renderer.setClearColor(0x000000, 0);
    this.renderer.render(this.scene, this.recording);
    if (this.floor) this.floor.visible = floorShown;
    const context = target.getContext('2d');
    context.clearRect(0, 0, target.width, target.height);
    context.drawImage(
      this.canvas, 0, this.canvas.height - height, width, height, 0, 0, target.width, target.height);
  }
}
