// Records the face over its backdrop and the sound to a film, with the browser's own recorder.

const TYPES = ["video/mp4;codecs=avc1.42E01E,mp4a.40.2", "video/webm;codecs=vp9,opus", "video/webm;codecs=vp8,opus", "video/webm"];
const RATE = 30; // frames a second
const BITS = 6_000_000; // a second

export class Recorder {
  constructor(stage, sound) {
    Object.assign(this, { stage, sound, recorder: null });
    this.canvas = document.createElement("canvas");
    this.pen = this.canvas.getContext("2d", { alpha: false });
  }

  get on() {
    return this.recorder !== null;
  }

  // Sides are even, as encoders require.
  start() {
    const { canvas } = this.stage;
    Object.assign(this.canvas, { width: canvas.width & ~1, height: canvas.height & ~1 });
    const stream = this.canvas.captureStream(RATE);
    if (this.sound.context) {
      this.heard = this.sound.context.createMediaStreamDestination();
      // A film begins with its first sound, and silence counts as sound.
      this.silence = new ConstantSourceNode(this.sound.context, { offset: 0 });
      this.silence.connect(this.heard);
      this.silence.start();
      for (const track of this.heard.stream.getAudioTracks()) stream.addTrack(track);
    }
    const mimeType = TYPES.find((type) => MediaRecorder.isTypeSupported(type));
    this.recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond: BITS });
    this.parts = [];
    this.recorder.ondataavailable = ({ data }) => data.size && this.parts.push(data);
    this.recorder.start(1000);
    this.began = performance.now();
  }

  // Return the film and its suffix.
  async stop() {
    const { recorder } = this;
    const stopped = new Promise((done) => (recorder.onstop = done));
    recorder.stop();
    await stopped;
    for (const track of recorder.stream.getTracks()) track.stop();
    this.silence?.stop();
    this.recorder = this.heard = this.silence = null;
    const type = recorder.mimeType.split(";")[0];
    return { blob: new Blob(this.parts, { type }), suffix: type === "video/mp4" ? "mp4" : "webm" };
  }

  get seconds() {
    return (performance.now() - this.began) / 1000;
  }

  // Call it right after the stage has drawn; later the picture is gone.
  draw() {
    const { pen, canvas, stage } = this;
    stage.paintBackdrop(pen, canvas.width, canvas.height);
    pen.drawImage(stage.canvas, 0, 0, canvas.width, canvas.height);
  }

  // Add a sound packet to the film, at its time.
  packet(time, samples) {
    const { context, anchor, rate } = this.sound;
    if (!this.heard || anchor === null || !samples.length || anchor + time < context.currentTime) return;
    const buffer = context.createBuffer(1, samples.length, rate);
    buffer.getChannelData(0).set(Float32Array.from(samples, (value) => value / 32768));
    const source = new AudioBufferSourceNode(context, { buffer });
    source.connect(this.heard);
    source.start(anchor + time);
  }
}
