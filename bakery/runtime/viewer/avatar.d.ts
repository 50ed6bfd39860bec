/** An avatar bundle in a canvas. */

export interface Atlas {
  file: string;
  columns: number;
  rows: number;
  names: string[];
}

/** Where a bundle comes from, when it is not a URL: web/avatar.json, and the files beside it. */
export interface Source {
  description: Record<string, any>;
  file(name: string): Promise<Uint8Array>;
}

export interface View {
  /** Head space to camera space, nine numbers row by row. */
  rotation: number[];
  /** Millimetres; the camera looks along -z. */
  translation: number[];
  /** Pixels. */
  focal: number;
  /** Principal point, pixels from the top left. */
  center: number[];
  width: number;
  height: number;
}

export interface Options {
  stage: 'studio' | 'photo';
  /** False shows the neutral texture alone. */
  dynamic: boolean;
  /** The layer on the skin, and hair that has volume. */
  hair: boolean;
  /** Level of detail of hair that has volume, 0 the finest; null: as the picture needs, coarser on phones. */
  hairLevel: 0 | 1 | 2 | null;
  mouth: 'image' | 'geometry';
  /**
   * Another light than the portrait's: nine rows of RGB as `bakery/geometry/harmonics.py` has them, of mean 1
   * and relative to the head. null is the portrait's own.
   */
  light: number[][] | null;
  layer: 'color' | 'mask' | 'coverage' | 'uv';
  /** Whose activation mask the layer `mask` shows. */
  layerExpression: string;
  /** Colours of the studio, sRGB 0..1: behind the head, and towards the border. */
  wall: [number, number, number];
  floor: [number, number, number];
}

/** What the last frame cost. */
export interface Stats {
  drawCalls: number;
  uniformBytes: number;
  /** Of JavaScript. */
  milliseconds: number;
  /** Level of detail of hair that has volume; null where none was drawn. */
  hairLevel: number | null;
  /** Passes over the mouth sheet and the face texture; 0 when nothing changed. */
  medians: number;
  compositions: number;
}

/** Something that a person can mend; its message says how. */
export class AvatarError extends Error {}

/** Degrees of yaw and pitch that the gaze pictures cover. */
export const MOST_GAZE: [number, number];

/**
 * Load a bundle.
 * @param source URL of a bundle or of its web/ folder, or a Source.
 */
export function load(
  source: string | Source,
  options: { canvas: HTMLCanvasElement | OffscreenCanvas; antialias?: boolean },
): Promise<Avatar>;

export class Avatar {
  readonly canvas: HTMLCanvasElement | OffscreenCanvas;
  /** The 52 ARKit names in order. */
  readonly expressions: string[];
  /** Weights in the order of `expressions`. */
  readonly weights: Float32Array;
  readonly hasPhoto: boolean;
  readonly hasHair: boolean;
  readonly stats: Stats;
  options: Options;
  /** Degrees, and pixels of shift over the height. */
  orbit: { yaw: number; pitch: number; zoom: number; shift: number[] };
  /** Yaw to the subject's left, pitch up, roll to its left shoulder; degrees. */
  head: number[];
  /** Gaze by itself, degrees, held within 35 aside and 30 up or down; null follows the eyeLook weights. */
  direction: number[] | null;
  /** Degrees: yaw to the subject's left, pitch up. */
  readonly gaze: number[];

  set(weights: Record<string, number>): this;
  get(name: string): number;
  reset(): this;
  look(yaw: number, pitch: number): this;
  turn(yaw: number, pitch: number, roll?: number): this;
  render(): void;
  /** Rows from the top, RGBA, as the reference of the project draws: one sample a pixel. */
  capture(wanted: { width: number; height: number; view?: View }): Uint8Array;
  view(width?: number, height?: number): View;
  frontView(size: number): View;
  dispose(): void;
}
