import type { Object3D, Box3 } from "three";
import type { Realizer } from "./index.js";

/** ARKit's name of a morph target, also of `mouthSmile_L` and `Face.JawOpen`; undefined for another one. */
export function shapeOf(name: string): string | undefined;

/** Load a GLB or a VRM; rejects with an Error that says what is wrong with the file. */
export function loadAvatar(url: string | URL): Promise<Avatar>;

/** An avatar in a scene of three.js. */
export class Avatar {
  /** The object to add to a scene; it looks along +z. */
  readonly scene: Object3D;
  /** ARKit's names of the shapes that it has. */
  readonly shapes: string[];
  /** The part of the scene to look at. */
  readonly bounds: Box3;
  /** Show a frame of the stream arkit; `passed` seconds move hair and cloth of a VRM. */
  show(names: readonly string[], values: ArrayLike<number>, passed?: number): void;
  dispose(): void;
}

/** The element `<bml-face url session token character avatar muted captions>`; it fires `load` and `error`. */
export class BmlFace extends HTMLElement {
  /** The client of the session; null while the element is in no page. */
  readonly realizer: Realizer | null;
  /** The avatar that is shown; null before it is loaded. */
  readonly avatar: Avatar | null;
}

declare global {
  interface HTMLElementTagNameMap {
    "bml-face": BmlFace;
  }
}
