// What the camera saw, with the capture drawn over it.
import { blockText } from './blocks.js';

export class CameraView {
  constructor(figure, camera, replay) {
    this.pictures = camera.pictures;
    this.image = figure.querySelector('img');
    this.canvas = figure.querySelector('canvas');
    this.replay = replay;
    this.canvas.width = Math.min(640, camera.width);
    this.canvas.height = Math.round((this.canvas.width * camera.height) / camera.width);
    this.image.style.aspectRatio = `${camera.width} / ${camera.height}`;
    const slider = figure.querySelector('#overlay');
    const fade = () => (this.canvas.style.opacity = slider.value / 100);
    slider.addEventListener('input', fade);
    fade();
    replay.afterRender = () => replay.renderOver(this.canvas);
    figure.hidden = false;
  }

  show(frame) {
    const block = this.pictures[frame];
    this.image.style.visibility = block === null ? 'hidden' : 'visible';
    if (block !== null) this.image.src = `data:image/jpeg;base64,${blockText(block)}`;
  }
}
