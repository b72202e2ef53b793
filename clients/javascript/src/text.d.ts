/** What a voice is given of a text, as `realizer.spoken_text` of Python gives it. */
export interface SpokenText {
  /** The words alone. */
  text: string;
  /** The words with SSML and behaviours. */
  markup: string;
  /** Each behaviour with the number of characters before it. */
  behaviours: [number, string][];
  /** Sentences about what is left out. */
  warnings: string[];
}

export interface SpokenTextOptions {
  /** Whether emoji and emoticons that are known become behaviours; true by default. */
  emoji?: boolean;
  /** "skip" leaves blocks of code out, "say" says "code" for each. */
  code?: "skip" | "say";
}

export function spokenText(text: string, language?: string, options?: SpokenTextOptions): SpokenText;
