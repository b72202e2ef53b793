import { RealizerError } from "./frames.js";

const GATHERING = 3000; // ms; addresses that are found later are left out of the offer
const CHECKING = 1000; // ms; so often picture and sound are compared
const CLOSE = 8; // ms; so close to each other they are left alone
const FARTHEST = 1000; // ms
const SHARE = 0.6; // of a difference that is corrected at once: what is measured is uneven

/**
 * Receive the picture and the sound of a session by WebRTC, from the service as an ASGI application; browsers only.
 *
 *   const face = await watch({ url: "http://127.0.0.1:8765/", session: "show", size: "512x512" });
 *   video.srcObject = face.stream;
 *
 * @param {object} options
 * @param {string|URL} [options.url] of the application; default: where this file comes from
 * @param {string} options.session name of the session, which is opened if it is not there
 * @param {string} [options.token] the access token, if the service requires one
 * @param {string} [options.size] and fps, camera, light, background, character: of the pictures
 * @param {number} [options.buffer] how long the browser should hold back picture and sound, ms; default: as it likes
 * @returns {Promise<{stream: MediaStream, connection: RTCPeerConnection, close: function}>}
 */
export async function watch({ url, session, token, buffer, ...options }) {
  const target = new URL(`sessions/${encodeURIComponent(session)}/webrtc`, url ?? import.meta.url);
  for (const [name, value] of Object.entries({ ...options, token })) if (value != null) target.searchParams.set(name, value);
  const connection = new RTCPeerConnection();
  const stream = new MediaStream();
  connection.ontrack = ({ track }) => stream.addTrack(track);
  try {
    for (const kind of ["video", "audio"]) connection.addTransceiver(kind, { direction: "recvonly" });
    if (buffer) for (const receiver of connection.getReceivers()) receiver.jitterBufferTarget = Number(buffer);
    await connection.setLocalDescription();
    await new Promise((resolve) => {
      const check = () => connection.iceGatheringState === "complete" && resolve();
      connection.addEventListener("icegatheringstatechange", check);
      setTimeout(resolve, GATHERING);
      check();
    });
    const { type, sdp } = connection.localDescription;
    // As text, which needs no preflight request from a page of another origin.
    const answer = await fetch(target, { method: "POST", headers: { "Content-Type": "text/plain" }, body: JSON.stringify({ type, sdp }) });
    const body = await answer.json();
    if (!answer.ok) throw new RealizerError(body.error);
    await connection.setRemoteDescription(body);
    synchronize(connection, Number(buffer ?? 0));
  } catch (error) {
    connection.close();
    throw error;
  }
  return { stream, connection, close: () => connection.close() };
}

/**
 * Hold back the pictures, or the sound, so that both are played together. A browser does this too, but slowly: Chromium takes
 * half a minute, in which lips are early by up to a quarter of a second.
 */
export function synchronize(connection, buffer) {
  const receivers = Object.fromEntries(connection.getReceivers().map((receiver) => [receiver.track.kind, receiver]));
  let held = 0; // ms; pictures if positive, else sound
  const check = setInterval(async () => {
    if (connection.connectionState === "closed") return clearInterval(check);
    const played = {};
    for (const { type, kind, estimatedPlayoutTimestamp } of (await connection.getStats()).values())
      if (type === "inbound-rtp") played[kind] = estimatedPlayoutTimestamp;
    const early = played.video - played.audio;
    if (!(Math.abs(early) > CLOSE)) return; // or not known yet
    held = Math.max(-FARTHEST, Math.min(FARTHEST, held + SHARE * early));
    receivers.video.jitterBufferTarget = buffer + Math.max(0, held);
    receivers.audio.jitterBufferTarget = buffer + Math.max(0, -held);
  }, CHECKING);
}
