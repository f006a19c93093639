// Scrubber, play, speed, keys.

export class Transport {
  /** `show(frame)` is called for every frame that is come to. */
  constructor({ frames, framesPerSecond, numbers, show }) {
    Object.assign(this, { frames, framesPerSecond, numbers, show, frame: -1, playing: false });
    this.scrub = document.getElementById('scrub');
    this.button = document.getElementById('play');
    this.label = document.getElementById('time');
    this.speed = document.getElementById('speed');
    this.scrub.max = frames - 1;
    this.scrub.addEventListener('input', () => this.go(Number(this.scrub.value)));
    this.button.addEventListener('click', () => this.toggle());
    document.addEventListener('keydown', (event) => this.key(event));
  }

  key(event) {
    if (event.target.matches('input:not([type=range]), select, textarea, button')) return;
    const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -this.frames, End: this.frames };
    if (event.key === ' ') this.toggle();
    else if (event.key in steps) this.go(this.frame + steps[event.key]);
    else return;
    event.preventDefault();
  }

  go(frame) {
    const wanted = Math.min(this.frames - 1, Math.max(0, Math.round(frame)));
    if (wanted === this.frame) return;
    this.frame = wanted;
    this.scrub.value = wanted;
    const seconds = (wanted / this.framesPerSecond).toFixed(2);
    this.label.textContent = `frame ${this.numbers[wanted]} · ${seconds} s`;
    this.show(wanted);
  }

  toggle() {
    this.playing = !this.playing;
    this.button.innerHTML = this.playing ? '&#10074;&#10074;' : '&#9654;';
    if (!this.playing) return;
    let position = this.frame >= this.frames - 1 ? 0 : this.frame;
    let last = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      if (Math.floor(position) !== this.frame) position = this.frame; // somebody scrubbed
      position += ((now - last) / 1000) * this.framesPerSecond * Number(this.speed.value);
      last = now;
      if (position >= this.frames) position = 0;
      this.go(Math.floor(position));
      requestAnimationFrame(step);
    };
    this.go(position);
    requestAnimationFrame(step);
  }
}
