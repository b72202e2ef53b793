/**
 * A client of the BML realizer: it sends BML and receives feedback, frames and sound.
 *
 *   import { Realizer, Clock, Sound } from "bml-realizer-client"; // or "http://127.0.0.1:8765/realizer.js"
 *
 *   const realizer = new Realizer({ url: "ws://127.0.0.1:8765/ws", session: "show" });
 *   realizer.onfeedback = (element) => console.log(element.getAttribute("id"));
 *   await realizer.connect();
 *   const { names } = await realizer.arkit({ fps: 30 }, (frame) => move(head, frame.values()));
 *   await realizer.play('<bml id="hello"><speech id="s"><text>Hello there.</text></speech></bml>');
 *
 * A language model speaks:
 *
 *   const speech = realizer.speech("turn");
 *   for await (const token of model) await speech.append(token);
 *   speech.close();
 *
 * Another voice speaks, and the lips follow its words, or its sound alone:
 *
 *   await realizer.say(wav, { words: [[0.1, "Hello"], [0.5, "there"]] });
 *   const voice = realizer.voice({ rate: 24000 });
 *   for await (const pcm of parts) voice.write(pcm);
 *   voice.close();
 *
 * Sound in a page, with the face on its clock:
 *
 *   const clock = new Clock();
 *   const sound = new Sound(clock);
 *   button.onclick = () => sound.start(); // browsers require a gesture
 *   await realizer.subscribe("audio", { rate: sound.rate }, (p) => sound.packet(p.time, p.values(), p.forget));
 *   realizer.subscribe("arkit", {}, (frame) => clock.heard(frame.time, performance.now() / 1000));
 *   // the session time to show now: sound.playhead() ?? clock.playhead(performance.now() / 1000)
 *
 * What the messages are: asyncapi.json, which the service serves beside realizer.js.
 */
export { RealizerError, VERSION, frameOf, packPicture } from "./frames.js";
export { isMarkup } from "./markup.js";
export { Clock, DELAY } from "./playout.js";
export { BMLA, Realizer } from "./realizer.js";
export { Sound } from "./sound.js";
export { Speech } from "./speech.js";
export { Voice } from "./voice.js";
export { watch } from "./watch.js";
